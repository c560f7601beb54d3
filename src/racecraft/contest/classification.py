"""The result of a race: every car's place, by the rules of `racecraft.contest.standings`.

A car is ranked if it completed enough laps; in a race on one road every car is, those that did not finish last.
Pure functions of what the cars did.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.contest.standings import places, ranking_key, ranking_score
from racecraft.race.results import Trial


@dataclass(frozen=True, kw_only=True)
class Standing:
    """One car in the result of a race."""

    place: int | None
    """From 1; None for a car that is not ranked."""
    car: int
    """Index among the results that were classified."""
    score: float | None
    """s that it is ranked by; None if it is not, or did not finish."""
    gap: float | None
    """s behind the winner's score."""
    laps: int
    """Completed."""
    total: float
    """s on its clock at the end."""
    best: float | None
    """s of its fastest lap."""
    average: float | None
    """s, mean of its laps."""
    completion: float
    """Fraction of the whole distance."""
    off_track_count: int
    crash_count: int
    resets: int
    penalty_seconds: float
    status: str
    """How its race ended."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return dict(vars(self))


def classify(
    trials: Sequence[Trial], *, ranking: str = "total", minimum_laps: int = 1, ranks_all: bool = False
) -> list[Standing]:
    """Everybody's place, the winner first; cars that are not ranked come last, by the distance they drove.

    Args:
        trials: What each car did.
        ranking: ``total``, ``best`` or ``average``, as for `ranking_score`.
        minimum_laps: Completed laps that a car must have for a score.
        ranks_all: Whether cars without a score have a place, too, as in a race on one road.

    Raises:
        ConfigError: No such ranking, or fewer than one lap demanded.
    """
    scores = [ranking_score(trial.lap_times, ranking=ranking, minimum_laps=minimum_laps) for trial in trials]
    resets = [sum(lap.resets for lap in trial.laps) for trial in trials]
    keys = [
        ranking_key(score, lap_times=trial.lap_times, completion=trial.completion, resets=count)
        for trial, score, count in zip(trials, scores, resets, strict=True)
    ]
    found_places = places(keys)
    order = sorted(range(len(trials)), key=lambda car: (keys[car], car))
    best = min(scores, default=math.inf)
    found = []
    for car in order:
        is_ranked = math.isfinite(scores[car])
        place = found_places[car] if is_ranked or ranks_all else None
        found.append(_standing(trials[car], car, place, scores[car] if is_ranked else None, best))
    return found


def _standing(trial: Trial, car: int, place: int | None, score: float | None, best: float) -> Standing:
    times = trial.lap_times
    return Standing(
        place=place,
        car=car,
        score=score,
        gap=None if score is None else score - best,
        laps=len(times),
        total=trial.time,
        best=min(times, default=None),
        average=math.fsum(times) / len(times) if times else None,
        completion=trial.completion,
        off_track_count=sum(lap.off_track_count for lap in trial.laps),
        crash_count=sum(lap.crash_count for lap in trial.laps),
        resets=sum(lap.resets for lap in trial.laps),
        penalty_seconds=math.fsum(lap.penalty_seconds for lap in trial.laps),
        status=trial.status,
    )
