"""What a race is held by: settled and checked before anybody enters, the same for all, and announced.

settings -> *race_terms* -> RaceTerms -> announcement (published), conditions (driven under)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from racecraft.checks import check_choice, check_whole, require
from racecraft.contest.standings import RANKINGS
from racecraft.errors import ConfigError
from racecraft.race.announcement import Announcement
from racecraft.race.conditions import Conditions
from racecraft.sim.camera import CameraSpec
from racecraft.track.track import Track

ALONE: Final = ("time-trial", "object-avoidance", "head-to-bot")
TOGETHER: Final = ("head-to-model", "grid")
RACE_KINDS: Final = ALONE + TOGETHER
"""What `racecraft race` can hold."""
MAX_ENTRIES: Final = 1000
MAX_GRID: Final = 8
"""Cars on one road."""
TRIALS: Final = 5
"""Of each entry that drives alone, unless a race asks for more or fewer."""
MAX_TRIALS: Final = 99


@dataclass(frozen=True, kw_only=True)
class RaceTerms:
    """Everything that decides a race but who enters it; from `race_terms`."""

    kind: str
    """Of `RACE_KINDS`."""
    conditions: Conditions
    """The same for everybody, the seed included."""
    ranking: str
    """``total``, ``best`` or ``average``."""
    minimum_laps: int
    """Completed laps that a trial must have for a score."""
    num_trials: int
    """Of each entry."""
    announcement: Announcement
    """What is published of it; with its secret, which is kept until the race is over."""

    @property
    def shares_road(self) -> bool:
        """Whether all cars are on one road."""
        return self.kind in TOGETHER


def race_terms(
    conditions: Conditions,
    *,
    kind: str = "time-trial",
    num_cars: int = 1,
    ranking: str = "total",
    minimum_laps: int | None = None,
    num_trials: int | None = None,
    secret: bytes | None = None,
    final: Mapping[str, Any] | None = None,
) -> RaceTerms:
    """Settle what a race is held by.

    Args:
        conditions: Track, rules, vehicle, objects; their seed counts where there is no secret.
        kind: Of `RACE_KINDS`.
        num_cars: Entries; where each drives alone their number means nothing.
        ranking: ``total`` time, ``best`` lap or ``average`` of the best `minimum_laps` laps in a row.
        minimum_laps: Completed laps that a trial must have for a score: all for ``total``, which would else be won by
            who gave up first; by default `laps_needed`: three for ``average`` and one for ``best``.
        num_trials: Of each entry that drives alone, 5 by default; cars on one road have one.
        secret: 32 bytes that the seed is drawn from, or None for one that everybody may know.
        final: What else is announced of a race of duels, from `racecraft.contest.finals.FinalTerms`.

    Raises:
        ConfigError: No such race or ranking, or the number of entries, laps or trials does not go with it.
    """
    check_kind(kind, num_cars)
    check_choice("ranking", ranking, RANKINGS)
    trials, laps = check_trials(kind, num_trials), conditions.rules.laps
    needed = laps_needed(ranking, laps) if minimum_laps is None else minimum_laps
    is_within = type(needed) is int and 1 <= needed <= laps
    require("minimum_laps", needed, is_within, f"1 to {laps}, the laps of the race")
    if ranking == "total" and needed < laps:
        raise ConfigError(
            f"A race ranked by the total time needs all {laps} laps, as fewer take less; minimum_laps is {needed}.",
            hint="Leave minimum_laps out, or rank by the best lap or the best average.",
        )
    if kind in TOGETHER:
        conditions = replace(shared_road(conditions, num_cars), camera=conditions.camera or CameraSpec())
    announcement = Announcement.of(
        conditions,
        kind=kind,
        ranking=ranking,
        minimum_laps=needed,
        num_trials=trials,
        secret=secret,
        final=final,
    )
    return RaceTerms(
        kind=kind,
        conditions=replace(conditions, seed=announcement.seed or 0),
        ranking=ranking,
        minimum_laps=needed,
        num_trials=trials,
        announcement=announcement,
    )


def laps_needed(ranking: str, laps: int) -> int:
    """Completed laps that a trial of so many must have for a score unless a race asks for another number."""
    return {"total": laps, "average": min(3, laps)}.get(ranking, 1)


def announced_terms(announcement: Announcement, track: Track) -> RaceTerms:
    """What an announced race is held by, its secret included.

    Raises:
        ConfigError: It is of another track, its starts are a secret, or it has a setting that is not one of ours.
    """
    if announcement.is_secret:
        raise ConfigError("The race's starts are a secret; only who knows it can hold the race.")
    document = announcement.document
    check_trials(document["kind"], document["trials"])
    return RaceTerms(
        kind=document["kind"],
        conditions=announcement.conditions(track),
        ranking=document["ranking"],
        minimum_laps=document["minimum_laps"],
        num_trials=document["trials"],
        announcement=announcement,
    )


def check_kind(kind: str, num_entries: int) -> None:
    """Refuse a race that there is not, or with too few or too many cars.

    Raises:
        ConfigError: Says what is allowed.
    """
    check_choice("Race type", kind, RACE_KINDS)
    low, high = {"head-to-model": (2, 2), "grid": (2, MAX_GRID)}.get(kind, (1, MAX_ENTRIES))
    if not low <= num_entries <= high:
        allowed = str(low) if low == high else f"{low} to {high}"
        raise ConfigError(f"A {kind} race is of {allowed} models; this one has {num_entries}.")


def check_trials(kind: str, num_trials: int | None) -> int:
    """How many trials each entry of a race has.

    Raises:
        ConfigError: As many do not go with the race.
    """
    high = 1 if kind in TOGETHER else MAX_TRIALS
    number = min(TRIALS, high) if num_trials is None else num_trials
    if type(number) is not int:
        check_whole("num_trials", number, 1, high, is_plain=True)
    if not 1 <= number <= high:
        allowed = "1: all are on one road" if high == 1 else f"1 to {high}"
        raise ConfigError(f"A {kind} race has {number} trials; allowed are {allowed}.")
    return number


def shared_road(conditions: Conditions, num_cars: int) -> Conditions:
    """The same on one road, where laps flow: nobody could stop for a standing start among the others.

    Raises:
        ConfigError: The road is no circuit and the race has several laps.
    """
    if conditions.rules.laps > 1 and not conditions.track.is_closed:
        raise ConfigError(
            f"Cars on one road race one lap on {conditions.track.name}, which is no circuit; laps is "
            f"{conditions.rules.laps}."
        )
    rules = replace(conditions.rules, is_continuous=True)
    return replace(conditions, rules=rules, cars_per_race=num_cars)
