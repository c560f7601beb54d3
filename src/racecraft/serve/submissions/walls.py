"""The walls around who drives a stranger's entry: those of reward code, but for threads and a file to write.

Its weights are data, and are looked at as such; the walls are for the day on which that goes wrong. Whoever drives then
still reads the interpreter, the packages and its own entry alone (in a heat both); it writes into what it has open, and
has no network, no signals and no programs. What a kernel lacks is left out and said (`missing_walls`).
"""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from racecraft.reward.sandbox import find_confinement, make_plan

PACKAGES: Final = ("racecraft", "numpy", "safetensors")
MOST_MEMORY: Final = 1 << 32
"""Bytes of address space beyond what the judge has loaded; AWS's deepest network takes a quarter of it."""


def missing_walls() -> str:
    """What the kernel lacks, for a sentence; empty where the walls are complete."""
    return find_confinement().missing


def lock_in(*, entries: Sequence[Path], kept: tuple[int, ...], written: int) -> None:
    """Put up the walls around this process for good.

    Args:
        entries: The files that it may read.
        kept: File descriptors that it may go on using; others are closed.
        written: Bytes of the largest file that it may write.

    Raises:
        OSError: The kernel refuses a wall; the process must not go on.
    """
    from racecraft.reward.sandbox.inside import enter

    plan = _plan(written)
    memory = plan["memory_limit"] and plan["memory_limit"] + _taken()
    enter({**plan, "memory_limit": memory, "readable": [*plan["readable"], *map(str, entries)]}, kept)


def _taken() -> int:
    """Bytes of address space that this process has already."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


@functools.cache
def _plan(written: int) -> dict[str, Any]:
    return make_plan(
        find_confinement(), packages=PACKAGES, files=(), memory_limit=MOST_MEMORY, stages=("judging",), written=written
    )
