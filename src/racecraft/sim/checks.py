"""Settings of a simulation are numbers in a range; anything else is refused by name, value and range."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from racecraft.errors import ConfigError


def check_whole(name: str, value: Any, low: int, high: int) -> None:
    """Refuse what is not a whole number from low to high."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise ConfigError(f"{name} is {value!r}; allowed is a whole number from {low} to {high}.")


def check_number(name: str, value: Any, low: float, high: float) -> None:
    """Refuse what is not a number from low to high."""
    number = not isinstance(value, bool) and isinstance(value, int | float | np.integer | np.floating)
    if not number or not math.isfinite(value) or not low <= value <= high:
        raise ConfigError(f"{name} is {value!r}; allowed is a number from {low:g} to {high:g}.")


def check_type(name: str, value: Any, allowed: type | tuple[type, ...], advice: str) -> None:
    """Refuse a value of another type, saying what to give instead."""
    if not isinstance(value, allowed):
        raise ConfigError(f"{name} is {value!r}; {advice}.")
