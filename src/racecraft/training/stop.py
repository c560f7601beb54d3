"""When training ends: a number of laps driven in evaluation, minutes of wall clock, or camera steps."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from racecraft.errors import ConfigError

_UNITS: Final = {
    "lap": ("laps", 1.0),
    "step": ("steps", 1.0),
    "s": ("seconds", 1.0),
    "sec": ("seconds", 1.0),
    "second": ("seconds", 1.0),
    "min": ("seconds", 60.0),
    "minute": ("seconds", 60.0),
    "h": ("seconds", 3600.0),
    "hour": ("seconds", 3600.0),
}
_FORM: Final = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([a-z]+?)s?\s*", re.IGNORECASE)
_EXAMPLES: Final = "'5 laps', '10 minutes', '90 s' or '200000 steps'"


@dataclass(frozen=True, kw_only=True)
class Until:
    """Limits of a training; 0 means none. The first one reached ends it."""

    laps: int = 0
    """Trials of one evaluation that must all complete their lap."""
    seconds: float = 0.0
    """Wall clock since the command started, across resumptions."""
    steps: int = 0
    """Camera steps, all cars together."""

    @classmethod
    def parse(cls, text: str) -> Until:
        """Read ``"5 laps"``, ``"10 minutes"``, ``"200000 steps"`` or several of them joined by ``or``.

        Raises:
            ConfigError: The text has another form, or a number is out of range.
        """
        limits: dict[str, float] = {}
        for part in re.split(r"\bor\b|,", text):
            match = _FORM.fullmatch(part)
            if match is None or match[2].lower() not in _UNITS:
                raise ConfigError(f"until is {text!r}; write it like {_EXAMPLES}, or join several with 'or'.")
            name, factor = _UNITS[match[2].lower()]
            value = float(match[1]) * factor
            if name != "seconds" and not value.is_integer():
                raise ConfigError(f"until is {text!r}; the number of {name} must be whole.")
            limits[name] = value
        return cls(
            laps=int(limits.get("laps", 0)),
            seconds=limits.get("seconds", 0.0),
            steps=int(limits.get("steps", 0)),
        )

    def __post_init__(self) -> None:
        if not (self.laps or self.seconds or self.steps):
            raise ConfigError(f"until sets no limit; write it like {_EXAMPLES}.")
        if not 0 <= self.laps <= 100:
            raise ConfigError(f"until asks for {self.laps} laps; allowed is 1 to 100.")
        if not 0 <= self.seconds <= 30 * 86400:
            raise ConfigError(f"until asks for {self.seconds:g} s; allowed is up to 30 days.")
        if not 0 <= self.steps <= 10**12:
            raise ConfigError(f"until asks for {self.steps} steps; allowed is up to 10^12.")

    def __str__(self) -> str:
        parts = []
        if self.laps:
            parts.append(f"{self.laps} laps")
        if self.seconds:
            parts.append(f"{self.seconds / 60:g} minutes" if self.seconds >= 60 else f"{self.seconds:g} s")
        if self.steps:
            parts.append(f"{self.steps} steps")
        return " or ".join(parts)
