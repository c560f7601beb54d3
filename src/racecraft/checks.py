"""What settings may be: whatever is not allowed is refused by name, value and what is, in one wording."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from racecraft.errors import ConfigError, did_you_mean

MAX_COUNT: Final = 10**9
"""Of steps, samples, ...: who asks for more has made a mistake."""
MAX_SHOWN: Final = 500
"""Characters of a value in a message: it may be a whole file."""


def require(name: str, value: Any, is_met: bool, allowed: str) -> None:
    """Refuse a value that does not meet what the words `allowed` say."""
    if not is_met:
        raise ConfigError(f"{name} is {shown(value)}; allowed is {allowed}.")


def is_number(value: Any, *, is_plain: bool = True) -> bool:
    """Whether a value is a finite number, which True and False are not.

    Args:
        value: Any object.
        is_plain: Whether NumPy's numbers are none, too.
    """
    kinds = int | float if is_plain else int | float | np.integer | np.floating
    if not isinstance(value, kinds) or isinstance(value, bool):
        return False
    return abs(value) <= sys.float_info.max if isinstance(value, int) else math.isfinite(value)


def check_whole(name: str, value: Any, low: int, high: int = MAX_COUNT, *, is_plain: bool = False) -> None:
    """Refuse what is not a whole number from low to high.

    Args:
        name: What messages call it.
        value: Any object.
        low: The least.
        high: The most.
        is_plain: Whether NumPy's numbers are refused, too: JSON, in which settings are kept, does not know them.
    """
    is_whole = isinstance(value, int if is_plain else int | np.integer) and not isinstance(value, bool)
    require(name, value, is_whole and low <= value <= high, f"a whole number from {low} to {high}")


def check_number(name: str, value: Any, low: float, high: float = math.inf, *, is_plain: bool = False) -> None:
    """Refuse what is not a finite number from low to high; the arguments are those of `check_whole`."""
    is_within = is_number(value, is_plain=is_plain) and low <= value <= high
    require(name, value, is_within, f"a number from {low:g}" + (f" to {high:g}" if high < math.inf else ""))


def check_flag(name: str, value: Any) -> None:
    """Refuse what is neither True nor False."""
    check_type(name, value, bool, "allowed are True and False")


def check_choice(name: str, value: Any, allowed: Iterable[str]) -> None:
    """Refuse what is none of these names, with a hint at what was perhaps meant."""
    known = tuple(allowed)
    if not isinstance(value, str) or value not in known:
        hint = did_you_mean(str(value), known)
        raise ConfigError(f"{name} is {shown(value)}; allowed are {', '.join(known)}.", hint=hint)


def check_type(name: str, value: Any, allowed: type | tuple[type, ...], advice: str) -> None:
    """Refuse a value of another type, saying what to give instead."""
    if not isinstance(value, allowed):
        raise ConfigError(f"{name} is {shown(value)}; {advice}.")


def check_path(name: str, value: Any, advice: str) -> None:
    """Refuse what is no path: another type, or a text that no file is ever called, saying what to give instead."""
    check_type(name, value, (str, os.PathLike), advice)
    try:
        is_one = b"\0" not in os.fsencode(value)
    except (TypeError, ValueError):
        is_one = False
    if not is_one:
        raise ConfigError(f"{name} is {shown(value)}; {advice}.")


def make_plain(settings: Any) -> None:
    """Turn NumPy's numbers among a frozen dataclass's fields into Python's, the only ones that JSON can keep."""
    for name, value in vars(settings).items():
        if isinstance(value, np.generic):
            object.__setattr__(settings, name, value.item())


def shown(value: Any) -> str:
    """A value for a message, cut where it is long."""
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 1]}…"
