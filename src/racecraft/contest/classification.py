"""The result of a race: every entry's place, by the rules of `racecraft.contest.standings`.

An entry is ranked if enough of its trials have a score; in a race on one road every entry is, those that did not finish
last. Pure functions of what the cars did.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.contest.standings import median_score, places, ranking_key, ranking_score
from racecraft.race.results import Trial


@dataclass(frozen=True, kw_only=True)
class Standing:
    """One entry in the result of a race."""

    place: int | None
    """From 1; None for an entry that is not ranked."""
    car: int
    """Index among the results that were classified."""
    score: float | None
    """s that it is ranked by, the median of `scores`; None if it is not, or did not finish."""
    gap: float | None
    """s behind the winner's score."""
    scores: tuple[float | None, ...]
    """s of each trial; None for one with too few laps."""
    laps: int
    """Completed in all trials."""
    total: float
    """s on the clock at the end, the median of the trials."""
    best: float | None
    """s of its fastest lap."""
    average: float | None
    """s, mean of its laps."""
    completion: float
    """Fraction of the whole distance, the mean of the trials."""
    off_track_count: int
    crash_count: int
    resets: int
    penalty_seconds: float
    statuses: tuple[str, ...]
    """How each of its trials ended."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {**vars(self), "scores": list(self.scores), "statuses": list(self.statuses)}

    def in_whole_ms(self) -> dict[str, Any]:
        """All that places are decided by, as a league's board has it."""
        return {
            "score_ms": None if self.score is None else round(1000 * self.score),
            "best_lap_ms": None if self.best is None else round(1000 * self.best),
            "resets": self.resets,
            "completion": self.completion,
        }


def classify(
    results: Sequence[Sequence[Trial]], *, ranking: str = "total", minimum_laps: int = 1, ranks_all: bool = False
) -> list[Standing]:
    """Everybody's place, the winner first; entries that are not ranked come last, by the distance they drove.

    Args:
        results: What each entry did, in one trial or several.
        ranking: ``total``, ``best`` or ``average``, as for `ranking_score`.
        minimum_laps: Completed laps that a trial must have for a score.
        ranks_all: Whether entries without a score have a place, too, as in a race on one road.

    Raises:
        ConfigError: No such ranking, or fewer than one lap demanded.
    """
    scores = [
        tuple(ranking_score(trial.lap_times, ranking=ranking, minimum_laps=minimum_laps) for trial in trials)
        for trials in results
    ]
    medians = [median_score(each) for each in scores]
    keys = [
        ranking_key(
            median,
            lap_times=[time for trial in trials for time in trial.lap_times],
            completion=_completion(trials),
            resets=sum(lap.resets for trial in trials for lap in trial.laps),
        )
        for trials, median in zip(results, medians, strict=True)
    ]
    found_places = places(keys)
    order = sorted(range(len(results)), key=lambda car: (keys[car], car))
    best = min(medians, default=math.inf)
    found = []
    for car in order:
        is_ranked = math.isfinite(medians[car])
        place = found_places[car] if is_ranked or ranks_all else None
        score = medians[car] if is_ranked else None
        found.append(_standing(results[car], car, place, score, scores=scores[car], best=best))
    return found


def _completion(trials: Sequence[Trial]) -> float:
    return math.fsum(trial.completion for trial in trials) / len(trials)


def _standing(
    trials: Sequence[Trial], car: int, place: int | None, score: float | None, *, scores: Sequence[float], best: float
) -> Standing:
    times = [time for trial in trials for time in trial.lap_times]
    laps = [lap for trial in trials for lap in trial.laps]
    return Standing(
        place=place,
        car=car,
        score=score,
        gap=None if score is None else score - best,
        scores=tuple(one if math.isfinite(one) else None for one in scores),
        laps=len(times),
        total=statistics.median(trial.time for trial in trials),
        best=min(times, default=None),
        average=math.fsum(times) / len(times) if times else None,
        completion=_completion(trials),
        off_track_count=sum(lap.off_track_count for lap in laps),
        crash_count=sum(lap.crash_count for lap in laps),
        resets=sum(lap.resets for lap in laps),
        penalty_seconds=math.fsum(lap.penalty_seconds for lap in laps),
        statuses=tuple(trial.status for trial in trials),
    )
