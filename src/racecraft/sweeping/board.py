"""The leaderboard of a sweep, from what its runs say: means over seeds with their intervals, and who is tied."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from racecraft.race.statistics import mean_interval, wilson_interval
from racecraft.run import RunFolder, judged_laps
from racecraft.run.history import read_history

WHOLE: Final = 1.0 - 1e-9
"""Completion of an evaluation in which every car came round."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one training came to."""

    steps: int
    """Camera steps so far."""
    laps_after: int | None
    """Camera steps after which all cars of an evaluation came round for the first time."""
    best_lap: float | None
    """s, of all its evaluations."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A mean over the seeds that came so far."""

    mean: float | None
    low: float | None
    """Of the interval that holds the true mean with 95 %; None where a single seed tells nothing."""
    high: float | None
    count: int
    """Seeds it is of."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """A setting on the board."""

    place: int
    setting: str
    words: dict[str, Any]
    seeds: int
    """That have begun."""
    laps_after: Figure
    """Camera steps."""
    best_lap: Figure
    """s"""
    is_tied: bool
    """Whether the difference to the first place could be chance."""


@dataclass(frozen=True, kw_only=True)
class Board:
    """The settings, the best first."""

    goal: str
    places: tuple[Place, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)


def outcome_of(folder: RunFolder) -> Outcome:
    """What a training came to so far; what it began with, where another run gave that, is none of it.

    Raises:
        RunError: The run cannot be read.
    """
    driven = [one for one in judged_laps(folder) if one.stamp is None and one.step > 0]
    points, _ = read_history(folder.history)
    last = folder.checkpoints.last
    return Outcome(
        steps=max([last.step if last is not None else 0, *(int(point.get("step") or 0) for point in points[-1:])]),
        laps_after=next((one.step for one in driven if (one.completion or 0.0) >= WHOLE), None),
        best_lap=min((one.best_lap for one in driven if one.best_lap is not None), default=None),
    )


def board_of(goal: str, settings: Mapping[str, dict[str, Any]], outcomes: Mapping[str, Mapping[int, Outcome]]) -> Board:
    """The leaderboard.

    The first are those of which most seeds reached the goal, and among these the smallest mean.

    Args:
        goal: ``laps`` or ``lap_time``.
        settings: What each says, by name.
        outcomes: By setting and seed, of those that have begun.
    """

    def values(setting: str) -> dict[int, float | None]:
        return {seed: _value(goal, outcome) for seed, outcome in outcomes.get(setting, {}).items()}

    def key(setting: str) -> tuple[float, float]:
        begun = values(setting)
        if not begun:
            return math.inf, math.inf
        reached = _known(begun.values())
        return -len(reached) / len(begun), sum(reached) / len(reached) if reached else math.inf

    order = sorted(settings, key=key)
    first = values(order[0]) if order else {}
    return Board(
        goal=goal,
        places=tuple(
            Place(
                place=number,
                setting=setting,
                words=settings[setting],
                seeds=len(outcomes.get(setting, {})),
                laps_after=_figure([one.laps_after for one in outcomes.get(setting, {}).values()]),
                best_lap=_figure([one.best_lap for one in outcomes.get(setting, {}).values()]),
                is_tied=number > 1 and is_tied(first, values(setting)),
            )
            for number, setting in enumerate(order, 1)
        ),
    )


def is_tied(first: Mapping[int, float | None], other: Mapping[int, float | None]) -> bool:
    """Whether nobody can tell two settings apart: the interval of their differences, seed by seed, holds 0.

    A seed that reached the goal with one of them alone was slower with the other by nobody knows how much. Where there
    are such seeds, they are tied unless the first was faster with more seeds than chance gives (a sign test), or only
    the other failed and was slower also where it did not. Never tied are those of which the first reached the goal so
    much more often that Wilson's intervals of the shares lie apart.

    Args:
        first: What each seed that has begun came to; None for one that has not reached the goal.
        other: The same of the other.
    """
    share, others = (wilson_interval(len(_known(one.values())), len(one)) for one in (first, other))
    if others.high < share.low:
        return False
    pairs = [(value, other[seed]) for seed, value in first.items() if seed in other]
    differences = [theirs - ours for ours, theirs in pairs if ours is not None and theirs is not None]
    ahead = sum(ours is not None and theirs is None for ours, theirs in pairs)
    behind = sum(ours is None and theirs is not None for ours, theirs in pairs)
    interval = mean_interval(differences)
    if ahead == behind == 0:
        return interval.low <= 0.0 <= interval.high
    faster = ahead + sum(difference > 0.0 for difference in differences)
    slower = behind + sum(difference < 0.0 for difference in differences)
    return not (_is_beyond_chance(faster, slower) or (behind == 0 and interval.low > 0.0))


def _is_beyond_chance(more: int, less: int) -> bool:
    """Whether so many heads and so few tails, or fewer, come of less than 2.5 % of all throws of a fair coin."""
    count = more + less
    return 40 * sum(math.comb(count, tails) for tails in range(less + 1)) < 1 << count


def _value(goal: str, outcome: Outcome) -> float | None:
    return outcome.best_lap if goal == "lap_time" else outcome.laps_after


def _known(values: Iterable[float | None]) -> list[float]:
    return [float(value) for value in values if value is not None]


def _figure(values: Sequence[float | None]) -> Figure:
    known = _known(values)
    if not known:
        return Figure(mean=None, low=None, high=None, count=0)
    mean = sum(known) / len(known)
    if len(known) == 1:
        return Figure(mean=mean, low=None, high=None, count=1)
    interval = mean_interval(known, low=0.0)
    return Figure(mean=mean, low=interval.low, high=interval.high, count=len(known))
