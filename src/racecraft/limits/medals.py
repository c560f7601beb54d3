"""Medals for lap times: the author's is what our line driver really drives, the others a share slower."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

MEDALS: Final = {"author": 1.0, "gold": 1.06, "silver": 1.2, "bronze": 1.5}
"""Time over the author's: gold is a racer's lap, silver a fast one, bronze what a first training reaches."""


@dataclass(frozen=True, kw_only=True)
class Medals:
    """The times to reach, s."""

    author: float
    gold: float
    silver: float
    bronze: float

    @classmethod
    def from_author(cls, seconds: float) -> Medals:
        """Medals of a track on which the author's lap takes so long."""
        return cls(**{name: round(share * seconds, 2) for name, share in MEDALS.items()})

    def won_by(self, seconds: float) -> str:
        """The best medal that a lap time reaches, or an empty string."""
        return next((name for name in MEDALS if seconds <= getattr(self, name) + 1e-9), "")

    def next_after(self, seconds: float) -> str:
        """The medal that a lap time just misses, or an empty string when it has them all."""
        return next((name for name in reversed(MEDALS) if seconds > getattr(self, name) + 1e-9), "")
