"""How strong models are, by the results of their races: OpenSkill's Plackett-Luce rating with its uncertainty.

placings of a race -> *rate* -> every entry's mean and deviation -> next race
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from racecraft.errors import ConfigError
from racecraft.extras import needed_for

MEAN: Final = 25.0
"""Of a model that has not raced."""
DEVIATION: Final = MEAN / 3.0
"""Its uncertainty, one standard deviation."""


@dataclass(frozen=True)
class Rating:
    """What is believed about a model's strength: normally distributed."""

    mean: float = MEAN
    deviation: float = DEVIATION

    @property
    def floor(self) -> float:
        """Three deviations below the mean: what the model is worth almost certainly."""
        return self.mean - 3.0 * self.deviation


def rate(ratings: Sequence[Rating], places: Sequence[int]) -> list[Rating]:
    """The ratings after a race.

    Args:
        ratings: Of those who took part, before it.
        places: Where each came in, from 1; equal places are a tie.

    Raises:
        ConfigError: OpenSkill is not installed, or the lists are not equally long.
    """
    if len(ratings) != len(places):
        raise ConfigError(f"{len(ratings)} ratings and {len(places)} places; allowed is one place for each.")
    if len(ratings) < 2:
        return list(ratings)
    model = _model()
    teams = [[model.create_rating([rating.mean, rating.deviation])] for rating in ratings]
    rated = model.rate(teams, ranks=[float(place) for place in places])
    return [Rating(float(team[0].mu), float(team[0].sigma)) for team in rated]


def _model() -> Any:
    with needed_for("A table of ratings"):
        from openskill.models import PlackettLuce
    return PlackettLuce(mu=MEAN, sigma=DEVIATION)
