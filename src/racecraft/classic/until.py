"""When learning ends: a return in evaluation, steps, or wall clock; the first one reached."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

from racecraft.errors import ConfigError
from racecraft.training.stop import Until

_RETURN: Final = re.compile(r"\s*(?:return\s+(-?\d+(?:\.\d+)?)|(-?\d+(?:\.\d+)?)\s+return)\s*", re.IGNORECASE)
_MAX_TEXT: Final = 400  # characters


@dataclass(frozen=True, kw_only=True)
class Goal:
    """Limits of learning."""

    mean_return: float = math.inf
    """Mean of greedy episodes; infinity means none."""
    steps: int = 0
    """Of all worlds; 0 takes the settings'."""
    seconds: float = math.inf
    """Wall clock of this session; infinity means none."""

    @classmethod
    def parse(cls, text: str) -> Goal:
        """Read ``"475 return"``, ``"20,000 steps"``, ``"2 minutes"`` or several joined by ``or``.

        Raises:
            ConfigError: The text has another form, or a number is out of range.
        """
        hint = "Write it like '475 return', '20000 steps', '2 minutes', or join several with 'or'."
        if not isinstance(text, str) or len(text) > _MAX_TEXT:
            raise ConfigError(f"until is {str(text)[:40]!r}.", hint=hint)
        parts = re.split(r"\bor\b", text)
        returns = [match for match in map(_RETURN.fullmatch, parts) if match]
        rest = [part for part in parts if not _RETURN.fullmatch(part)]
        if len(returns) > 1:
            raise ConfigError(f"until is {text!r}; it limits the return twice.", hint=hint)
        try:
            limits = Until.parse(" or ".join(rest)) if rest else None
        except ConfigError as error:
            raise ConfigError(f"until is {text!r}, which is not understood.", hint=hint) from error
        if limits is not None and (limits.laps or limits.lap_time or limits.no_better_lap):
            raise ConfigError(f"until is {text!r}; laps are for 'racecraft train'.", hint=hint)
        return cls(
            mean_return=float(returns[0][1] or returns[0][2]) if returns else math.inf,
            steps=limits.steps if limits else 0,
            seconds=(limits.seconds or math.inf) if limits else math.inf,
        )
