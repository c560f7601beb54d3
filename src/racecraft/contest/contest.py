"""`hold_race`: several models race, each alone against the clock or all on one road, and are placed.

time-trial, object-avoidance, head-to-bot   a road for each, equal to the others' to the last bit; several trials, each
                                            from another place of the lap, of which the median counts
head-to-model (2), grid (2 to 8)            one road, a staggered grid, cars that see and hit each other; one trial
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from racecraft.agent.sensor_suite import FRONT_CAMERA
from racecraft.contest.classification import Standing, classify
from racecraft.contest.standings import RANKINGS
from racecraft.errors import ConfigError, did_you_mean
from racecraft.race.conditions import Conditions
from racecraft.race.entry import Entry
from racecraft.race.evaluation import Driver, evaluate, race_simulation
from racecraft.race.marshal import Marshal
from racecraft.race.results import Trial
from racecraft.replay.replay import Replay
from racecraft.sim.camera import CameraSpec

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
class Contest:
    """A race that was held."""

    kind: str
    """Of `RACE_KINDS`."""
    conditions: Conditions
    """The same for everybody."""
    names: tuple[str, ...]
    """Of the entries."""
    cameras: tuple[CameraSpec, ...]
    """What each of them sees with."""
    trials: tuple[tuple[Trial, ...], ...]
    """What each of them did, trial by trial."""
    ranking: str
    """``total``, ``best`` or ``average``."""
    minimum_laps: int
    """Completed laps that a trial must have for a score."""

    @property
    def shares_road(self) -> bool:
        """Whether all cars were on one road."""
        return self.kind in TOGETHER

    @property
    def standings(self) -> list[Standing]:
        """The result, the winner first."""
        return classify(
            self.trials,
            ranking=self.ranking,
            minimum_laps=self.minimum_laps,
            ranks_all=self.shares_road,
        )

    @property
    def num_trials(self) -> int:
        """Of each entry."""
        return len(self.trials[0])

    @property
    def shown_trial(self) -> int:
        """The one to film, from 0: whose score is nearest to the winner's median."""
        winner = self.standings[0]
        if winner.score is None:
            return 0
        away = [math.inf if score is None else abs(score - winner.score) for score in winner.scores]
        return away.index(min(away))

    def replays(self) -> list[tuple[str, Replay]]:
        """Replays by what to call them: one for each entry, or one of all where they shared a road."""
        title = f"{self.kind} on {self.conditions.track.name}"
        if self.shares_road:
            trials = [trials[0] for trials in self.trials]
            return [("race", _replay(title, self.conditions, self.names, trials))]
        return [
            (name, _replay(title, replace(self.conditions, camera=camera), _trial_names(name, len(trials)), trials))
            for name, camera, trials in zip(self.names, self.cameras, self.trials, strict=True)
        ]

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        conditions = self.conditions
        return {
            "type": self.kind,
            "track": conditions.track.name,
            "seed": conditions.seed,
            "rules": conditions.rules.to_dict(),
            "objects": conditions.objects.to_dict(),
            "ranking": self.ranking,
            "minimum_laps": self.minimum_laps,
            "trials": self.num_trials,
            "results": [
                {
                    "name": self.names[standing.car],
                    **{name: value for name, value in standing.to_dict().items() if name != "car"},
                    "lap_seconds": [list(trial.lap_times) for trial in self.trials[standing.car]],
                }
                for standing in self.standings
            ],
        }


def hold_race(
    entries: Sequence[Entry],
    conditions: Conditions,
    *,
    kind: str = "time-trial",
    ranking: str = "total",
    minimum_laps: int | None = None,
    num_trials: int | None = None,
    num_threads: int = 0,
) -> Contest:
    """Race.

    Args:
        entries: Models at the start, in the order of the grid.
        conditions: Track, rules, vehicle, objects, seed; everybody has the very same.
        kind: Of `RACE_KINDS`.
        ranking: ``total`` time, ``best`` lap or ``average`` of the best `minimum_laps` laps in a row.
        minimum_laps: Completed laps that a trial must have for a score; by default all for ``total``, three for
            ``average``, one for ``best``.
        num_trials: Of each entry that drives alone, 5 by default; cars on one road have one.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: No such race or ranking, or the number of entries or of trials does not go with it.
        NonFiniteAction: An entry's network gives NaN; the message names it.
    """
    check_kind(kind, len(entries))
    trials = check_trials(kind, num_trials)
    laps = conditions.rules.laps
    needed = {"total": laps, "average": min(3, laps)}.get(ranking, 1) if minimum_laps is None else minimum_laps
    if ranking not in RANKINGS:
        hint = did_you_mean(ranking, RANKINGS)
        raise ConfigError(f"ranking is {ranking!r}; allowed are {', '.join(RANKINGS)}.", hint=hint)
    if not 1 <= needed <= laps:
        raise ConfigError(f"minimum_laps is {needed}; allowed is 1 to {laps}, the laps of the race.")
    driven: tuple[tuple[Trial, ...], ...]
    if kind in TOGETHER:
        conditions = replace(shared_road(conditions, len(entries)), camera=conditions.camera or CameraSpec())
        together = race_together(entries, conditions, num_threads=num_threads)
        driven = tuple((trial,) for trial in together)
    else:
        driven = tuple(_alone(entry, conditions, num_trials=trials, num_threads=num_threads) for entry in entries)
    return Contest(
        kind=kind,
        conditions=conditions,
        names=tuple(entry.name for entry in entries),
        cameras=tuple(entry.sensors.camera() for entry in entries),
        trials=driven,
        ranking=ranking,
        minimum_laps=needed,
    )


def check_kind(kind: str, num_entries: int) -> None:
    """Refuse a race that there is not, or with too few or too many cars.

    Raises:
        ConfigError: Says what is allowed.
    """
    if kind not in RACE_KINDS:
        hint = did_you_mean(kind, RACE_KINDS)
        raise ConfigError(f"Race type is {kind!r}; allowed are {', '.join(RACE_KINDS)}.", hint=hint)
    low, high = {"head-to-model": (2, 2), "grid": (2, MAX_GRID)}.get(kind, (1, MAX_ENTRIES))
    if not low <= num_entries <= high:
        allowed = str(low) if low == high else f"{low} to {high}"
        raise ConfigError(f"A {kind} race has {num_entries} models; allowed are {allowed}.")


def check_trials(kind: str, num_trials: int | None) -> int:
    """How many trials each entry of a race has.

    Raises:
        ConfigError: As many do not go with the race.
    """
    high = 1 if kind in TOGETHER else MAX_TRIALS
    number = min(TRIALS, high) if num_trials is None else num_trials
    if not 1 <= number <= high:
        allowed = "1: all are on one road" if high == 1 else f"1 to {high}"
        raise ConfigError(f"A {kind} race has {number} trials; allowed are {allowed}.")
    return number


def _alone(entry: Entry, conditions: Conditions, *, num_trials: int, num_threads: int) -> tuple[Trial, ...]:
    """One entry's race against the clock."""
    return evaluate(
        entry,
        conditions.track,
        rules=conditions.rules,
        num_trials=num_trials,
        seed=conditions.seed,
        vehicle=conditions.vehicle,
        objects=conditions.objects,
        randomize=conditions.randomize,
        num_threads=num_threads,
    ).trials


def _replay(title: str, conditions: Conditions, names: Sequence[str], trials: Sequence[Trial]) -> Replay:
    return Replay(
        title=title,
        conditions=conditions,
        names=tuple(names),
        cars=tuple(trials),
        rewards=tuple(trial.recording.rewards for trial in trials),
    )


def _trial_names(name: str, number: int) -> list[str]:
    return [name] if number == 1 else [f"{name}, trial {trial + 1}" for trial in range(number)]


def race_together(drivers: Sequence[Driver], conditions: Conditions, *, num_threads: int = 0) -> tuple[Trial, ...]:
    """A race of several cars on one road, in the order of the grid, until the last has finished or is out.

    Args:
        drivers: Of the cars. Each is called with what its own car's sensors tell (1, ...): those of its attribute
            ``sensors``, by default the front camera; or, where its attribute ``sees`` is ``"state"``, the privileged
            state (1, S).
        conditions: With `cars_per_race` equal to the number of drivers.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: The conditions are of another number of cars, or the road is no circuit and has several laps.
    """
    if conditions.cars_per_race != len(drivers):
        raise ConfigError(f"There are {len(drivers)} drivers for a race of {conditions.cars_per_race} cars.")
    simulation = race_simulation(conditions, num_cars=len(drivers), num_threads=num_threads)
    suites = [
        None if getattr(driver, "sees", "frames") == "state" else getattr(driver, "sensors", FRONT_CAMERA)
        for driver in drivers
    ]
    eyes = {
        suite: simulation
        if conditions.camera == suite.camera() and not suite.lidar_name
        else race_simulation(
            replace(conditions, camera=suite.camera()),
            num_cars=len(drivers),
            has_lidar=bool(suite.lidar_name),
            num_threads=num_threads,
        )
        for suite in dict.fromkeys(suites)
        if suite is not None
    }
    followers = [one for one in eyes.values() if one is not simulation]
    marshal = Marshal(simulation, conditions.rules, seed=conditions.seed, followers=followers)
    actions = np.zeros((len(drivers), 2), dtype=np.float32)
    while marshal.is_racing:
        seen = {suite: suite.read(one) for suite, one in eyes.items()}
        for car, (driver, suite) in enumerate(zip(drivers, suites, strict=True)):
            sight = simulation.state if suite is None else seen[suite]
            actions[car] = driver(sight[car : car + 1])[0]
        marshal.step(actions)
    return marshal.trials()


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
