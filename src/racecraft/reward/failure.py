"""What is said of a reward function that failed: one sentence, the line at fault, the params, the last prints.

The same for a function in a worker process and for one in a browser's tab, which has only Python and no NumPy.
"""

from __future__ import annotations

import re
from typing import Any, Final

from racecraft.errors import printable
from racecraft.reward.params import format_params
from racecraft.reward.worker_process import FILENAME, SIZE

SHOWN_LINES: Final = 5  # of what was printed, in an error
SHOWN_WIDTH: Final = 200  # characters of such a line
SHOWN_BYTES: Final = 4 * SHOWN_LINES * SHOWN_WIDTH  # that hold them

HINTS: Final = {
    r"only 0-dimensional arrays can": "NumPy makes a number only of an array without dimensions, since 2.4. "
    "Write array[0] or array.item() where it has one element.",
    r"IndexError: .*\n    .*object(?!(?s:.*)'objects_location':)": "Nothing is on this track, so the lists of objects "
    "are empty, as at AWS. Choose a race with objects, or ask first for len(params['objects_location']).",
    r"TypeError: (.*indices must be integers .*not float|'float' object cannot be interpreted as an integer)": "What "
    "params count, such as steps, are floats, as at AWS. Write int(params['steps']).",
    r"AttributeError: 'dict' object has no attribute 'has_key'": "That was Python 2. Write 'speed' in params.",
}
"""What to do about it, by what a failure that is told in full says: patterns."""


def hint_about(text: str) -> str:
    """What to do about a failure, where what is `told` of it does not say it."""
    return next((hint for pattern, hint in HINTS.items() if re.search(pattern, text)), "")


def told(text: str, source: str, *, line: int, is_loading: bool, params: dict[str, Any] | None, printed: str) -> str:
    """A failure in full.

    Args:
        text: What happened, such as "raised KeyError: 'x'".
        source: Text of the user's file.
        line: Line of it, from 1, or -1 where that is not known.
        is_loading: The file was being loaded.
        params: What the function was called with, where that is known.
        printed: What it printed last.
    """
    lines = source.splitlines()
    message = f"{FILENAME}, line {line}: " if line > 0 else f"{FILENAME}: "
    message += f"the {'file' if is_loading else 'reward function'} {text}"
    message += "" if message.endswith(".") else "."
    if 0 < line <= len(lines):
        message += f"\n    {printable(lines[line - 1].strip())}"
    if is_loading:
        message += "\nIt failed while the file was loaded, before the first call."
    elif params is not None:
        message += f"\nIt was called with params = {format_params(params)}"
    if last := _last_lines(printed):
        message += "\nIt printed last:" + "".join(f"\n    {line}" for line in last)
    return message


def kept_prints(ring: memoryview, count: int) -> str:
    """The last ``count`` bytes of all that went into a `PrintRing`'s memory, as far as they are kept."""
    (written,) = SIZE.unpack_from(ring)
    data = bytes(ring[SIZE.size :])
    room = len(data)
    count = min(count, written, room)
    if not count:
        return ""
    end = written % room
    kept = data[end - count : end] if count <= end else data[room - (count - end) :] + data[:end]
    return kept.decode("utf-8", "replace")


def _last_lines(printed: str) -> list[str]:
    """Short, and without what could drive a terminal."""
    lines = [line for line in printed.splitlines() if line.strip()]
    shown = (line[:SHOWN_WIDTH] + "…" * (len(line) > SHOWN_WIDTH) for line in lines[-SHOWN_LINES:])
    return [printable(line) for line in shown]
