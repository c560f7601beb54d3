"""`verify`: drive a replay again from its stored actions; every number must come out the same, bit for bit.

replay -> its conditions -> simulation, marshal <- its actions, step by step
                                   |
                                   v
                 rows, laps, rewards == those of the replay ?   the first that differs ends it
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type
from racecraft.errors import RacecraftError, ReplayError
from racecraft.race.announcement import Announcement
from racecraft.race.evaluation import race_simulation
from racecraft.race.marshal import Marshal
from racecraft.race.provenance import Provenance, provenance, track_note, vehicle_note
from racecraft.race.results import Trial
from racecraft.replay.replay import Replay
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES
from racecraft.version import VERSION

SMALLEST_CAMERA: Final = 8
"""Pixels: only where the camera looks is part of the rules, not what it sees."""
START_TOLERANCE: Final = 1e-9
"""m and rad, of the row that prepares a start: it is computed by NumPy, whose sine may differ by a bit elsewhere."""

_STATUS: Final = ROW_COLUMNS.index("status")
_PREPARE: Final = STATUS_NAMES.index("prepare")


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The first thing that comes out otherwise."""

    car: int
    """From 0."""
    step: int
    """Of that car's recording, from 0."""
    what: str
    """Column of the row, ``reward``, ``laps``, ``length`` or ``result``."""
    stored: Any
    """In the replay."""
    driven: Any
    """When driven again."""

    @property
    def sentence(self) -> str:
        """For people."""
        seconds = (self.step + 1) / 15.0
        return (
            f"Car {self.car + 1} differs first in step {self.step} ({seconds:.2f} s): "
            f"{self.what} is {self.stored} in the file and {self.driven} when driven."
        )


@dataclass(frozen=True, kw_only=True)
class Verification:
    """What came of driving a replay again."""

    replay: Replay
    difference: Difference | None
    """None if every bit is the same."""
    foul: str = ""
    """What it has otherwise than the race it is to be of, in words; empty where that is its race, or there is none."""

    @property
    def is_genuine(self) -> bool:
        """Whether the replay is what its actions lead to, and of its race, where it has one."""
        return self.difference is None and not self.foul

    @property
    def num_steps(self) -> int:
        """Steps of all cars."""
        return sum(len(car.recording) for car in self.replay.cars)

    @property
    def version_note(self) -> str:
        """Why a genuine replay may come out otherwise; empty where it was written by this version."""
        here, there = VERSION, self.replay.written_by
        return (
            "" if here == there else f"It was written by Racecraft {there}; this is {here}, which may drive otherwise."
        )

    @property
    def track_note(self) -> str:
        """Whether the track is the one that is known by its name: a file may hold a wider one."""
        return track_note(self.replay.conditions.track)

    @property
    def vehicle_note(self) -> str:
        """The preset's name, or that it is none."""
        return vehicle_note(self.replay.conditions.vehicle)

    @cached_property
    def provenance(self) -> Provenance:
        """By whose rules, in whose car, on whose track: what a genuine replay is worth."""
        return provenance(self.replay.conditions)

    @property
    def sentence(self) -> str:
        """The verdict: genuine or not, by whose rules, and what of them is not everybody's."""
        if self.difference is not None:
            return f"Not genuine: {self.difference.sentence}"
        if self.foul:
            return f"Not of its race: {self.foul}."
        return f"Genuine{self.provenance.verdict}."

    @property
    def race_note(self) -> str:
        """Which race it is of, and what that proves; empty where it is of none."""
        race = self.replay.race
        if race is None:
            return ""
        starts = "its seed was known" if "seed" in race.document else "its secret gives these starts"
        if race.is_secret:
            starts = "it is not over, so nobody can check the starts"
        return f"Of the race {race.commitment}: {starts}."

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        found, race = self.difference, self.replay.race
        return {
            "is_genuine": self.is_genuine,
            "verdict": self.sentence,
            "title": self.replay.title,
            "cars": len(self.replay.cars),
            "steps": self.num_steps,
            "track": self.replay.conditions.track.name,
            "track_note": self.track_note,
            "vehicle": self.vehicle_note,
            "driven": self.provenance.to_dict(),
            "written_by": self.replay.written_by,
            "race": None if race is None else race.commitment,
            "foul": self.foul,
            "difference": None
            if found is None
            else {field.name: getattr(found, field.name) for field in fields(found)} | {"sentence": found.sentence},
        }


def verify(replay: Replay, *, race: Announcement | str | None = None, num_threads: int = 0) -> Verification:
    """Drive a replay again.

    Args:
        replay: Of anybody.
        race: That it must be of, as it was published: its announcement, or its commitment alone; by default the one
            that it says it is of.
        num_threads: 0 takes one per core.

    Raises:
        ReplayError: Its track or its settings cannot be driven at all.
        ConfigError: It is no replay, or the race is none.
    """
    check_type("replay", replay, Replay, "use what read_replay(path) gives")
    kinds = (Announcement, str, type(None))
    check_type("race", race, kinds, "use a commitment, or Announcement.from_dict(...) of what was published")
    return replace(_driven_again(replay, num_threads=num_threads), foul=_foul(replay, race))


def _driven_again(replay: Replay, *, num_threads: int) -> Verification:
    conditions, num_cars = replay.conditions, len(replay.cars)
    if conditions.camera is not None:
        small = replace(conditions.camera, width=SMALLEST_CAMERA, height=SMALLEST_CAMERA)
        conditions = replace(conditions, camera=small)
    try:
        simulation = race_simulation(conditions, num_cars=num_cars, num_threads=num_threads)
        marshal = Marshal(simulation, conditions.rules, seed=conditions.seed)
    except RacecraftError as error:
        raise ReplayError(f"The replay cannot be driven: {error}") from error
    compared = [0] * num_cars
    while True:
        for car in range(num_cars):  # whatever was logged since
            found = _first_difference(replay.cars[car], marshal.rows_of(car), car=car, begin=compared[car])
            if found is not None:
                return Verification(replay=replay, difference=found)
            compared[car] = len(marshal.rows_of(car))
        if not marshal.is_racing:
            break
        actions = np.zeros((num_cars, 2), dtype=np.float32)
        for car, trial in enumerate(replay.cars):
            if compared[car] < len(trial.recording):
                actions[car] = trial.recording.actions[compared[car]]
        marshal.step(actions)
    for car, driven in enumerate(marshal.trials()):
        found = _result_difference(replay.cars[car], driven, replay.rewards[car], car=car)
        if found is not None:
            return Verification(replay=replay, difference=found)
    return Verification(replay=replay, difference=None)


def _foul(replay: Replay, race: Announcement | str | None) -> str:
    """What a replay has otherwise than the race that it must be of, or that it says it is of."""
    if isinstance(race, str):
        if replay.race is None:
            return f"it names no race, and must be of {race}"
        if replay.race.commitment != race:
            return f"its race has the commitment {replay.race.commitment}, not {race}"
    announced = race if isinstance(race, Announcement) else replay.race
    return "" if announced is None else announced.mismatch(replay.conditions, num_cars=len(replay.cars))


def _first_difference(stored: Trial, driven: Any, *, car: int, begin: int) -> Difference | None:
    rows = stored.recording.rows
    for step in range(begin, len(driven)):
        if step >= len(rows):
            return Difference(car=car, step=len(rows), what="length", stored=len(rows), driven="longer")
        if (rows[step].view(np.uint64) == driven[step].view(np.uint64)).all():
            continue
        differs = _differs(rows[step], driven[step])
        if differs.any():
            column = int(np.flatnonzero(differs)[0])
            return Difference(
                car=car,
                step=step,
                what=column_name(column),
                stored=float(rows[step, column]),
                driven=float(driven[step][column]),
            )
    return None


def _differs(stored: NDArray[np.float64], driven: NDArray[np.float64]) -> NDArray[np.bool_]:
    if stored[_STATUS] == driven[_STATUS] == _PREPARE:
        return np.asarray(np.abs(stored - driven) > START_TOLERANCE)
    return np.asarray(stored.view(np.uint64) != driven.view(np.uint64))


def _result_difference(stored: Trial, driven: Trial, rewards: NDArray[np.float64], *, car: int) -> Difference | None:
    steps = len(driven.recording)
    if len(stored.recording) != steps:
        return Difference(car=car, step=steps, what="length", stored=len(stored.recording), driven=steps)
    unpaid = np.flatnonzero(rewards.view(np.uint64) != driven.recording.rewards.view(np.uint64))
    if len(unpaid):
        step = int(unpaid[0])
        paid = float(driven.recording.rewards[step])
        return Difference(car=car, step=step, what="reward", stored=float(rewards[step]), driven=paid)
    asked = np.flatnonzero((stored.recording.actions != driven.recording.actions).any(axis=1))
    if len(asked):  # an action where nobody is asked for one
        step = int(asked[0])
        what = (stored.recording.actions[step].tolist(), driven.recording.actions[step].tolist())
        return Difference(car=car, step=step, what="action", stored=what[0], driven=what[1])
    ends = [step for step, kind in driven.recording.events if kind != "prepare"] or [steps - 1]
    for number in range(max(len(stored.laps), len(driven.laps))):
        laps = [trial.laps[number] if number < len(trial.laps) else None for trial in (stored, driven)]
        if laps[0] != laps[1]:
            numbers = driven.recording.lap_numbers
            last = np.flatnonzero(numbers == number + 1)
            step = int(last[-1]) if len(last) else ends[-1]
            return Difference(car=car, step=step, what="lap", stored=laps[0], driven=laps[1])
    if (stored.status, stored.completion) != (driven.status, driven.completion):
        results = [f"{trial.status}, {trial.completion}" for trial in (stored, driven)]
        return Difference(car=car, step=steps - 1, what="result", stored=results[0], driven=results[1])
    return None


def column_name(column: int) -> str:
    """Name of a row's column, those of objects included."""
    if column < len(ROW_COLUMNS):
        return ROW_COLUMNS[column]
    column -= len(ROW_COLUMNS)
    if column < len(OBJECT_HEADER):
        return OBJECT_HEADER[column]
    column -= len(OBJECT_HEADER)
    return f"{OBJECT_COLUMNS[column % len(OBJECT_COLUMNS)]} of object {column // len(OBJECT_COLUMNS)}"
