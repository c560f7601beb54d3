"""A replay file inside a PNG picture, as a chunk that viewers pass over; `racecraft verify` reads it from there."""

from __future__ import annotations

import struct
from typing import Final

from racecraft.errors import ReplayError

CHUNK: Final = b"rcRp"
"""Name of the chunk: no viewer needs it, it is nobody else's, and it may be copied along when a picture is changed."""
SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
MAX_CHUNKS: Final = 100_000
"""That are looked through."""


def is_picture(data: bytes) -> bool:
    """Whether a file's content is a PNG's."""
    return data.startswith(SIGNATURE)


def replay_in(data: bytes, *, name: str) -> bytes:
    """The replay file in a picture, which may come from a stranger.

    Args:
        data: The picture's content.
        name: What messages call it.

    Raises:
        ReplayError: There is none in it, or the picture is cut off.
    """
    place = len(SIGNATURE)
    for _ in range(MAX_CHUNKS):
        if place + 12 > len(data):
            break
        (length,) = struct.unpack_from(">I", data, place)
        if data[place + 4 : place + 8] == CHUNK and place + 12 + length <= len(data):
            return data[place + 8 : place + 8 + length]
        place += 12 + length
    raise ReplayError(
        f"{name} is a picture without a replay inside.",
        hint="Apps that send pictures often write them anew: send the file.",
    )
