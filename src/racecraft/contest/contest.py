"""`hold_race`: several models race, each alone against the clock or all on one road, and are placed.

time-trial, object-avoidance, head-to-bot   a road for each, equal to the others' to the last bit; several trials, each
                                            from another place of the lap, of which the median counts
head-to-model (2), grid (2 to 8)            one road, a staggered grid, cars that see and hit each other; one trial
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecraft.agent.sensor_suite import FRONT_CAMERA
from racecraft.contest.classification import Standing, classify
from racecraft.contest.terms import RaceTerms, check_kind
from racecraft.errors import ConfigError, NonFiniteAction
from racecraft.race.conditions import Conditions
from racecraft.race.entry import Entry
from racecraft.race.evaluation import Driver, begin_anew, evaluate, race_simulation
from racecraft.race.marshal import Marshal
from racecraft.race.provenance import provenance
from racecraft.race.results import Trial
from racecraft.replay.replay import Replay
from racecraft.sim.camera import CameraSpec


@dataclass(frozen=True, kw_only=True)
class Contest:
    """A race that was held."""

    terms: RaceTerms
    """What it was held by."""
    names: tuple[str, ...]
    """Of the entries."""
    cameras: tuple[CameraSpec, ...]
    """What each of them sees with."""
    trials: tuple[tuple[Trial, ...], ...]
    """What each of them did, trial by trial."""

    @property
    def conditions(self) -> Conditions:
        """That everybody drove under."""
        return self.terms.conditions

    @property
    def standings(self) -> list[Standing]:
        """The result, the winner first."""
        return classify(
            self.trials,
            ranking=self.terms.ranking,
            minimum_laps=self.terms.minimum_laps,
            ranks_all=self.terms.shares_road,
        )

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
        if self.terms.shares_road:
            return [("race", _replay(self.terms, self.names, [trials[0] for trials in self.trials]))]
        return [
            (name, _replay(self.terms, _trial_names(name, len(trials)), trials, camera=camera))
            for name, camera, trials in zip(self.names, self.cameras, self.trials, strict=True)
        ]

    def to_dict(self) -> dict[str, Any]:
        """As JSON: the announcement, and the results."""
        terms = self.terms
        return {
            "type": terms.kind,
            "track": terms.conditions.track.name,
            "seed": terms.conditions.seed,
            **terms.announcement.to_dict(),
            "driven": provenance(terms.conditions).to_dict(),
            "results": result_rows(self.names, self.trials, self.standings),
        }


def result_rows(
    names: Sequence[str], trials: Sequence[Sequence[Trial]], standings: Sequence[Standing]
) -> list[dict[str, Any]]:
    """A result as JSON, the winner first."""
    return [
        {
            "name": names[standing.car],
            **{name: value for name, value in standing.to_dict().items() if name != "car"},
            "lap_seconds": [list(trial.lap_times) for trial in trials[standing.car]],
        }
        for standing in standings
    ]


def hold_race(entries: Sequence[Entry], terms: RaceTerms, *, num_threads: int = 0) -> Contest:
    """Race.

    Args:
        entries: Models at the start, in the order of the grid.
        terms: What the race is held by; on one road for as many cars as there are entries.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: The number of entries does not go with the race.
        NonFiniteAction: The network of an entry that has a road for itself gives NaN; the message names it.
    """
    check_kind(terms.kind, len(entries))
    driven: tuple[tuple[Trial, ...], ...]
    if terms.shares_road:
        together = race_together(entries, terms.conditions, num_threads=num_threads)
        driven = tuple((trial,) for trial in together)
    else:
        driven = tuple(drive_alone(entry, terms, num_threads=num_threads) for entry in entries)
    return Contest(
        terms=terms,
        names=tuple(entry.name for entry in entries),
        cameras=tuple(entry.sensors.camera() for entry in entries),
        trials=driven,
    )


def drive_alone(entry: Entry, terms: RaceTerms, *, num_threads: int = 0) -> tuple[Trial, ...]:
    """One entry's race against the clock, trial by trial."""
    conditions = terms.conditions
    return evaluate(
        entry,
        conditions.track,
        rules=conditions.rules,
        num_trials=terms.num_trials,
        seed=conditions.seed,
        vehicle=conditions.vehicle,
        objects=conditions.objects,
        randomize=conditions.randomize,
        num_threads=num_threads,
    ).trials


def _replay(
    terms: RaceTerms, names: Sequence[str], trials: Sequence[Trial], *, camera: CameraSpec | None = None
) -> Replay:
    conditions = terms.conditions
    return Replay(
        title=f"{terms.kind} on {conditions.track.name}",
        conditions=conditions if camera is None else replace(conditions, camera=camera),
        names=tuple(names),
        cars=tuple(trials),
        rewards=tuple(trial.recording.rewards for trial in trials),
        race=terms.announcement,
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

    A car whose driver gives NaN stands still from then on, until the rules have it out of the race: that is its own
    loss, and none of the others'.

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
    for driver in drivers:
        begin_anew(driver)
    actions = np.zeros((len(drivers), 2), dtype=np.float32)
    lost: set[int] = set()
    while marshal.is_racing:
        seen = {suite: suite.read(one) for suite, one in eyes.items()}
        for car, (driver, suite) in enumerate(zip(drivers, suites, strict=True)):
            if car in lost:
                continue
            sight = simulation.state if suite is None else seen[suite]
            try:
                actions[car] = driver(sight[car : car + 1])[0]
            except NonFiniteAction:
                lost.add(car)
                actions[car] = 0.0
        marshal.step(actions)
    return marshal.trials()
