"""The seal on a simulation's saved state: which roads it was driven on.

core's bytes | SHA-256 of the roads (32) | MARK (8)

States from before there were seals, and those of the browser's tab, end with the core's bytes, whose last one is a
flag, 0 or 1: none is taken for the other kind. Those without a seal are loaded as well; only roads of other lengths are
told apart then, by the core itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ShapeError
from racecraft.track.selection import joint_digest
from racecraft.track.track import Track

Bytes = NDArray[np.uint8]

MARK: Final = b"\x00on road"
SEAL_BYTES: Final = 32 + len(MARK)


def seal(state: Bytes, tracks: Sequence[Track]) -> Bytes:
    """The core's bytes, with the digest of the roads behind them."""
    digest = bytes.fromhex(joint_digest(tracks)) + MARK
    return np.concatenate([state, np.frombuffer(digest, np.uint8)])


def unseal(saved: Bytes, tracks: Sequence[Track]) -> Bytes:
    """The core's bytes.

    Raises:
        ShapeError: The state was saved on other roads.
    """
    if saved.ndim != 1 or saved[-len(MARK) :].tobytes() != MARK:
        return saved  # one without a seal, or damaged: the core judges it
    state, digest = saved[:-SEAL_BYTES], saved[-SEAL_BYTES : -len(MARK)].tobytes()
    if digest.hex() != joint_digest(tracks):
        raise ShapeError(
            "Saved simulation state was saved on another track.",
            hint="Make the simulation with the tracks that it was saved with, in their order.",
        )
    return state
