"""`hold_ladder`: many races between models, and what they say about each model's strength.

    models x tracks x starts -> schedule (round-robin, or Swiss) -> matches -> OpenSkill -> a table with uncertainty

Time trials, and races among boxes or bots, are matches, too: two models at the same start of the same track, compared
by the rules of a race. Each drives each start once, whoever it is compared with. In head-to-model races every match is
driven: from another place of the lap each time, and every other time with the other model in front.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from racecraft.checks import check_choice, check_whole
from racecraft.contest.classification import classify
from racecraft.contest.contest import race_together
from racecraft.contest.ratings import Rating, rate
from racecraft.contest.schedule import Pair, round_robin, swiss_round
from racecraft.contest.terms import ALONE, shared_road
from racecraft.errors import ConfigError
from racecraft.race.conditions import Conditions
from racecraft.race.entry import Entry
from racecraft.race.evaluation import evaluate
from racecraft.race.results import Trial
from racecraft.sim.camera import CameraSpec

LADDER_KINDS: Final = (*ALONE, "head-to-model")
SCHEDULES: Final = ("round-robin", "swiss")
MAX_ENTRIES: Final = 200
MAX_STARTS: Final = 1000

Course = tuple[int, int]
"""A match's track, by its number, and its start, from 0."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """Two models compared."""

    track: str
    start: int
    """Number of the start on that track, from 0."""
    cars: Pair
    """Indices of the models."""
    places: tuple[int, int]
    """Of them; equal for a draw."""
    seconds: tuple[float | None, float | None]
    """Total time of each; None for one that did not finish."""


@dataclass(frozen=True, kw_only=True)
class LadderRow:
    """One model in the table."""

    place: int
    name: str
    rating: Rating
    wins: int
    draws: int
    losses: int

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        rating = self.rating
        return {
            "place": self.place,
            "name": self.name,
            "rating": rating.mean,
            "deviation": rating.deviation,
            "floor": rating.floor,
            "wins": self.wins,
            "draws": self.draws,
            "losses": self.losses,
        }


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """A ladder that was held."""

    names: tuple[str, ...]
    """Of the models."""
    kind: str
    schedule: str
    seed: int
    tracks: tuple[str, ...]
    matches: tuple[Match, ...]
    ratings: tuple[Rating, ...]
    """Of each model, in the order of `names`."""

    @property
    def rows(self) -> list[LadderRow]:
        """The table, the strongest first; equal ratings share a place."""
        order = sorted(range(len(self.names)), key=lambda car: (-self.ratings[car].mean, car))
        found = []
        for car in order:
            outcomes = [match.places[match.cars.index(car)] - _other(match, car) for match in self.matches_of(car)]
            found.append(
                LadderRow(
                    place=1 + sum(rating.mean > self.ratings[car].mean for rating in self.ratings),
                    name=self.names[car],
                    rating=self.ratings[car],
                    wins=sum(outcome < 0 for outcome in outcomes),
                    draws=sum(outcome == 0 for outcome in outcomes),
                    losses=sum(outcome > 0 for outcome in outcomes),
                )
            )
        return found

    def matches_of(self, car: int) -> list[Match]:
        """The matches that a model took part in."""
        return [match for match in self.matches if car in match.cars]

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "type": self.kind,
            "schedule": self.schedule,
            "seed": self.seed,
            "tracks": list(self.tracks),
            "ladder": [row.to_dict() for row in self.rows],
            "matches": [
                {
                    "track": match.track,
                    "start": match.start,
                    "models": [self.names[car] for car in match.cars],
                    "places": list(match.places),
                    "seconds": list(match.seconds),
                }
                for match in self.matches
            ],
        }


def hold_ladder(
    entries: Sequence[Entry],
    courses: Sequence[Conditions],
    *,
    kind: str = "time-trial",
    schedule: str = "round-robin",
    starts: int = 3,
    rounds: int = 0,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
    watch: Callable[[Match, Sequence[Trial]], None] = lambda match, trials: None,
    num_threads: int = 0,
) -> Ladder:
    """Compare models.

    Args:
        entries: The models, two or more.
        courses: Track, rules, vehicle and objects of each course; starts are drawn from the seed of each.
        kind: ``time-trial``, ``object-avoidance``, ``head-to-bot`` or ``head-to-model``.
        schedule: ``round-robin``: everyone meets everyone at every start of every course; ``swiss``: each meets one of
            about the same strength in each round.
        starts: On each course.
        rounds: Of a Swiss schedule; by default enough to find the best, and as many as needed for every start.
        seed: Of the order in which matches count, and in which courses come.
        progress: Is told what is being driven.
        watch: Sees every match as it is decided, with what its two models did.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: A setting is outside its range, or OpenSkill is not installed.
    """
    check_ladder(len(entries), kind=kind, schedule=schedule, starts=starts, rounds=rounds)
    chance = random.Random(seed)
    trials = _Trials(entries, courses, starts=starts, progress=progress, num_threads=num_threads)
    plan = [(course, start) for course in range(len(courses)) for start in range(starts)]
    chance.shuffle(plan)
    matches: list[Match] = []
    ratings = [Rating() for _ in entries]

    def meet(pair: Pair, course: Course) -> Match:
        if kind == "head-to-model":
            driven = _duel([entries[car] for car in pair], courses[course[0]], course[1] / starts, course[1] % 2 == 1)
        else:
            driven = [trials.of(car, course) for car in pair]
        match = _compare(pair, driven, courses[course[0]], course[1])
        matches.append(match)
        watch(match, driven)
        for car, rating in zip(pair, rate([ratings[car] for car in pair], match.places), strict=True):
            ratings[car] = rating
        return match

    if schedule == "round-robin":
        pairs = [pair for group in round_robin(len(entries)) for pair in group]
        for course in plan:
            chance.shuffle(pairs)
            for pair in pairs:
                meet(pair, course)
    else:
        _hold_swiss(len(entries), rounds or _usual_rounds(len(entries), len(plan)), plan, meet)
    return Ladder(
        names=tuple(entry.name for entry in entries),
        kind=kind,
        schedule=schedule,
        seed=seed,
        tracks=tuple(course.track.name for course in courses),
        matches=tuple(matches),
        ratings=tuple(ratings),
    )


def planned_matches(num_entries: int, num_courses: int, *, schedule: str, starts: int, rounds: int) -> int:
    """How many matches a ladder has, by the settings of `hold_ladder`."""
    num_starts = num_courses * starts
    if schedule == "round-robin":
        return num_entries * (num_entries - 1) // 2 * num_starts
    return (rounds or _usual_rounds(num_entries, num_starts)) * (num_entries // 2)


def _usual_rounds(num_entries: int, num_starts: int) -> int:
    """Of a Swiss schedule: enough to find the best, and one for every start."""
    return max((num_entries - 1).bit_length() + 1, num_starts)


def _hold_swiss(num_entries: int, rounds: int, plan: Sequence[Course], meet: Callable[[Pair, Course], Match]) -> None:
    points = [0.0] * num_entries
    met: list[Pair] = []
    rested: list[int] = []
    for number in range(rounds):
        pairs = swiss_round(points, met, rested)
        playing = {car for pair in pairs for car in pair}
        for car in set(range(num_entries)) - playing:  # a round off counts as a win, as it does in chess
            points[car] += 1.0
            rested.append(car)
        for pair in pairs:
            places = meet(pair, plan[number % len(plan)]).places
            for car, place, other in zip(pair, places, reversed(places), strict=True):
                points[car] += 0.5 + 0.5 * (place < other) - 0.5 * (place > other)
            met.append(pair)


class _Trials:
    """What every model does at every start, driven when it is first asked for."""

    def __init__(
        self,
        entries: Sequence[Entry],
        courses: Sequence[Conditions],
        *,
        starts: int,
        progress: Callable[[str], None],
        num_threads: int,
    ) -> None:
        self._entries, self._courses, self._starts = entries, courses, starts
        self._progress, self._num_threads = progress, num_threads
        self._driven: dict[tuple[int, int], tuple[Trial, ...]] = {}

    def of(self, car: int, course: Course) -> Trial:
        key = (car, course[0])
        if key not in self._driven:
            entry, conditions = self._entries[car], self._courses[course[0]]
            self._progress(f"{entry.name} drives {conditions.track.name}, {self._starts} starts side by side")
            self._driven[key] = evaluate(
                entry,
                conditions.track,
                rules=conditions.rules,
                num_trials=self._starts,
                seed=conditions.seed,
                vehicle=conditions.vehicle,
                objects=conditions.objects,
                randomize=conditions.randomize,
                num_threads=self._num_threads,
            ).trials
        return self._driven[key][course[1]]


def _duel(entries: Sequence[Entry], conditions: Conditions, fraction: float, swaps: bool) -> list[Trial]:
    """What two models do on one road, from so much of a lap after the first start; swapped, the second is in front.

    The first start is where the rules say, or, where those of races start all over the lap, drawn from the seed.
    """
    rules = conditions.rules
    first = rules.start_offset if rules.starts == "line" else random.Random(conditions.seed).random()
    place = (first + fraction) % 1.0 if conditions.track.is_closed else 0.0
    rules = replace(rules, starts="line", start_offset=place)
    given = shared_road(replace(conditions, rules=rules, camera=conditions.camera or CameraSpec()), 2)
    order = [1, 0] if swaps else [0, 1]
    trials = race_together([entries[car] for car in order], given, num_threads=1)
    return [trials[order.index(car)] for car in range(2)]


def _compare(pair: Pair, trials: Sequence[Trial], conditions: Conditions, start: int) -> Match:
    standings = classify([[trial] for trial in trials], minimum_laps=conditions.rules.laps, ranks_all=True)
    places = {standing.car: standing.place or 0 for standing in standings}
    seconds = {standing.car: standing.score for standing in standings}
    return Match(
        track=conditions.track.name,
        start=start,
        cars=pair,
        places=(places[0], places[1]),
        seconds=(seconds[0], seconds[1]),
    )


def _other(match: Match, car: int) -> int:
    return match.places[1 - match.cars.index(car)]


def check_ladder(num_entries: int, *, kind: str, schedule: str, starts: int, rounds: int) -> None:
    """Refuse a ladder that cannot be held.

    Raises:
        ConfigError: Says what is allowed, or that OpenSkill is not installed.
    """
    if not 2 <= num_entries <= MAX_ENTRIES:
        raise ConfigError(f"A ladder is of 2 to {MAX_ENTRIES} models; this one has {num_entries}.")
    check_choice("Race type of a ladder", kind, LADDER_KINDS)
    check_choice("schedule", schedule, SCHEDULES)
    check_whole("starts", starts, 1, MAX_STARTS)
    check_whole("rounds", rounds, 0, MAX_STARTS)
    rate([Rating(), Rating()], [1, 2])  # find out whether it is installed before any race
