"""Who is ahead: what a race is ranked by, and places from that; everywhere, by these exact rules. Pure functions.

1. A trial with enough completed laps has a score: total time, best lap, or the best average. That of an entry is the
   median of its trials', which are one or several; the lower one wins, in whole milliseconds as AWS times.
2. Equal scores: the faster best lap; then fewer resets; else both share the place, and the next one is left out.
3. Those without a score: who drove further, to the tenth of a per cent of the distance; then fewer resets.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import Final

from racecraft.checks import check_choice, check_whole

Key = tuple[float, ...]
"""What places are decided by: less is better, equals share a place."""
RANKINGS: Final = ("total", "best", "average")
"""Sum of all laps; fastest lap; or mean of the fastest run of consecutive laps. Less is better."""


def ranking_score(lap_times: Sequence[float], *, ranking: str = "total", minimum_laps: int = 1) -> float:
    """What a trial is ranked by, s; infinite when too few laps were completed.

    Args:
        lap_times: s of the completed laps, penalties included, in the order they were driven.
        ranking: ``total`` of all laps, ``best`` lap, or ``average`` of the best `minimum_laps` laps in a row.
        minimum_laps: Completed laps that a trial must have for a score.

    Raises:
        ConfigError: No such ranking, or fewer than one lap demanded.
    """
    check_choice("ranking", ranking, RANKINGS)
    check_whole("minimum_laps", minimum_laps, 1)
    if len(lap_times) < minimum_laps:
        return math.inf
    if ranking == "best":
        return min(lap_times)
    if ranking == "total":
        return math.fsum(lap_times)
    windows = (lap_times[i : i + minimum_laps] for i in range(len(lap_times) - minimum_laps + 1))
    return min(math.fsum(window) / minimum_laps for window in windows)


def median_score(scores: Sequence[float]) -> float:
    """What several trials are ranked by, s: the median of their scores, infinite where too many of them are.

    Of an even number it is the mean of the two in the middle.
    """
    return statistics.median(scores)


def ranking_key(score: float, *, lap_times: Sequence[float], completion: float, resets: int) -> Key:
    """What places are decided by, by the rules above.

    Args:
        score: As `median_score` gives it, s; infinite for one that has none.
        lap_times: s of the completed laps of all trials.
        completion: Fraction of the whole distance, the mean of all trials.
        resets: In all trials.
    """
    if not math.isfinite(score):
        return (1.0, float(-round(1000 * completion)), float(resets), 0.0)
    return (0.0, float(round(1000 * score)), float(round(1000 * min(lap_times))), float(resets))


def places(keys: Sequence[Key]) -> list[int]:
    """The place of each key, from 1: less is better, equals share a place and the next one is left out."""
    ordered = sorted(keys)
    return [ordered.index(key) + 1 for key in keys]
