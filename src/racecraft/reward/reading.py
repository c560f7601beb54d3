"""Who reads a reward function's source: whoever asks, or for a server another process.

Python's compiler lets nothing else of its process run meanwhile, and takes seconds for a source of 120,000 characters,
hours for 700 that are made for it. So whatever parses a source is marked with `reads`, and a process that others wait
for says once, with `read_by`, who does it in its place (`racecraft.reward.aside`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, TypeVar

Found = TypeVar("Found")
Reader = Callable[[str, str], Any]
"""What a function of this name finds in a source; raises what it raises."""

_readers: list[Reader] = []


def reads(function: Callable[[str], Found]) -> Callable[[str], Found]:
    """Mark a function of a source's text alone: in a process with a reader that is asked instead."""

    @wraps(function)
    def read(source: str) -> Found:
        if not _readers:
            return function(source)
        found: Found = _readers[-1](function.__name__, source)
        return found

    return read


@contextmanager
def read_by(reader: Reader) -> Iterator[None]:
    """Have a reader asked by all threads of this process until the block ends."""
    _readers.append(reader)
    try:
        yield
    finally:
        _readers.remove(reader)
