"""What comes of a job, as its row can keep it: JSON that both databases store and every page can be told.

Python writes NaN into JSON and takes it for JSON; SQLite then fails at every question about the row, and PostgreSQL
does at a zero character.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from racecraft.errors import RunError

MAX_DEPTH: Final = 32
"""Lists and objects within each other; those of jobs have five."""


def check_outcome(told: Mapping[str, Any] | None) -> None:
    """Refuse what would be written and could not be read again.

    Raises:
        RunError: It holds a number that is not finite, half of a letter, a zero character, or nothing of JSON's; or is
            nested too deeply.
    """
    if not _is_plain(told, MAX_DEPTH):
        raise RunError(
            "What came of a job cannot be kept; allowed are finite numbers, texts of whole letters without zero"
            f" characters, and {MAX_DEPTH} lists or objects within each other."
        )


def _is_plain(value: object, depth: int) -> bool:
    match value:
        case None | bool():
            return True
        case str():
            return "\0" not in value and (value.isascii() or not any("\ud800" <= mark <= "\udfff" for mark in value))
        case int() | float():
            return _is_finite(value)
        case Mapping():
            return (
                depth > 0
                and all(type(key) is str and _is_plain(key, 0) for key in value)
                and all(_is_plain(one, depth - 1) for one in value.values())
            )
        case list() | tuple():
            return depth > 0 and all(_is_plain(one, depth - 1) for one in value)
    return False


def _is_finite(number: float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # a whole number that is larger than any other
        return False
