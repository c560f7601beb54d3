"""`hold_race`: several models race, each alone against the clock or all on one road, and are placed.

time-trial, object-avoidance, head-to-bot   a road for each, equal to the others' to the last bit
head-to-model (2), grid (2 to 8)            one road, a staggered grid, cars that see and hit each other
"""

from __future__ import annotations

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


@dataclass(frozen=True, kw_only=True)
class Contest:
    """A race that was held."""

    kind: str
    """Of `RACE_KINDS`."""
    conditions: Conditions
    """The same for everybody."""
    names: tuple[str, ...]
    """Of the entries."""
    trials: tuple[Trial, ...]
    """What each of them did."""
    ranking: str
    """``total``, ``best`` or ``average``."""
    minimum_laps: int
    """Completed laps that an entry must have to be ranked."""

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

    def replays(self) -> list[tuple[str, Replay]]:
        """Replays by what to call them: one for each entry, or one of all where they shared a road."""
        title = f"{self.kind} on {self.conditions.track.name}"
        if self.shares_road:
            return [("race", self._replay(title, range(len(self.names))))]
        return [(name, self._replay(title, [index])) for index, name in enumerate(self.names)]

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
            "results": [
                {
                    "name": self.names[standing.car],
                    **{name: value for name, value in standing.to_dict().items() if name != "car"},
                    "lap_seconds": list(self.trials[standing.car].lap_times),
                }
                for standing in self.standings
            ],
        }

    def _replay(self, title: str, cars: Sequence[int]) -> Replay:
        trials = tuple(self.trials[car] for car in cars)
        return Replay(
            title=title,
            conditions=self.conditions,
            names=tuple(self.names[car] for car in cars),
            cars=trials,
            rewards=tuple(trial.recording.rewards for trial in trials),
        )


def hold_race(
    entries: Sequence[Entry],
    conditions: Conditions,
    *,
    kind: str = "time-trial",
    ranking: str = "total",
    minimum_laps: int | None = None,
    num_threads: int = 0,
) -> Contest:
    """Race.

    Args:
        entries: Models at the start, in the order of the grid.
        conditions: Track, rules, vehicle, objects, seed; everybody has the very same.
        kind: Of `RACE_KINDS`.
        ranking: ``total`` time, ``best`` lap or ``average`` of the best `minimum_laps` laps in a row.
        minimum_laps: Completed laps that an entry must have to be ranked; by default all for ``total``, three for
            ``average``, one for ``best``.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: No such race or ranking, or the number of entries does not go with it.
    """
    check_kind(kind, len(entries))
    laps = conditions.rules.laps
    needed = {"total": laps, "average": min(3, laps)}.get(ranking, 1) if minimum_laps is None else minimum_laps
    if ranking not in RANKINGS:
        hint = did_you_mean(ranking, RANKINGS)
        raise ConfigError(f"ranking is {ranking!r}; allowed are {', '.join(RANKINGS)}.", hint=hint)
    if not 1 <= needed <= laps:
        raise ConfigError(f"minimum_laps is {needed}; allowed is 1 to {laps}, the laps of the race.")
    if kind in TOGETHER:
        conditions = replace(shared_road(conditions, len(entries)), camera=conditions.camera or CameraSpec())
        trials = race_together([entry.policy for entry in entries], conditions, num_threads=num_threads)
    else:
        trials = tuple(_alone(entry, conditions, num_threads=num_threads) for entry in entries)
    return Contest(
        kind=kind,
        conditions=conditions,
        names=tuple(entry.name for entry in entries),
        trials=trials,
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


def _alone(entry: Entry, conditions: Conditions, *, num_threads: int) -> Trial:
    """One entry's race against the clock."""
    return evaluate(
        entry.policy,
        conditions.track,
        rules=conditions.rules,
        num_trials=1,
        seed=conditions.seed,
        vehicle=conditions.vehicle,
        objects=conditions.objects,
        randomize=conditions.randomize,
        num_threads=num_threads,
    ).trials[0]


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
