"""The marshal: watches every car of an evaluation, counts laps and mistakes, and puts cars back on the track.

One step of the simulation is one call of `step`. A mistake costs what it costs in the original:

    off track in step t -> placed in the nearest lane, where it was in step t - 1, wheels straight, standing
    (object near)          or behind the object, in the other lane
                        -> stands for the penalty (status ``pause``, the clock runs), then drives on
    ... but with no resets left the trial is over, in the step of the mistake.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.placement import (
    avoiding_pose,
    clear_pose,
    driven_track,
    line_up,
    start_distance,
    start_offset,
    start_pose,
)
from racecraft.race.recording import REFERENCE_AHEAD, Recording
from racecraft.race.results import Lap, Trial
from racecraft.race.rules import RESET_STATUSES, RaceRules
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.simulation import CONTROL_DT, Simulation

_X, _Y, _HEADING, _PROGRESS, _OFFSET, _DISTANCE, _STATUS, _TIME, _LAP = (
    ROW_COLUMNS.index(name)
    for name in ("x", "y", "heading", "progress", "offset", "projection_distance", "status", "time", "lap")
)
_CRASHED_OBJECT: Final = len(ROW_COLUMNS) + OBJECT_HEADER.index("crashed_object")
_OBJECT_X, _OBJECT_Y = OBJECT_COLUMNS.index("object_x"), OBJECT_COLUMNS.index("object_y")
_LAP_COMPLETE: Final = STATUS_NAMES.index("lap_complete")
_PAUSE: Final = STATUS_NAMES.index("pause")
_TIME_UP: Final = STATUS_NAMES.index("time_up")


@dataclass(kw_only=True)
class _Car:
    """What the marshal remembers of one trial."""

    index: int
    resets_left: int
    start: float = 0.0  # m along the track where its laps begin
    status: str = ""  # how the trial ended; empty while it races
    rows: list[NDArray[np.float64]] = field(default_factory=list)
    clock: list[float] = field(default_factory=list)  # s at each row
    actions: list[NDArray[np.float32]] = field(default_factory=list)  # asked for at each row  (2,)
    laps: list[Lap] = field(default_factory=list)
    began: float = 0.0  # s on the clock when the simulation's present episode began
    laps_before: int = 0  # laps completed before that
    mistakes: Counter[str] = field(default_factory=Counter)  # of the present lap, by status
    crashes: Counter[int] = field(default_factory=Counter)  # of the trial, by object
    resets: int = 0  # in the present lap
    penalty: float = 0.0  # s, in the present lap


class Marshal:
    """Runs the rules over a simulation from `trial_simulation`, from the start on.

    Args:
        simulation: What is judged.
        rules: Laps, resets, penalties.
        seed: Of the starts.
        followers: Simulations that differ by their sensors only and are led through the very same race: the eyes of
            cars that see otherwise.
    """

    def __init__(
        self, simulation: Simulation, rules: RaceRules, *, seed: int, followers: Sequence[Simulation] = ()
    ) -> None:
        self._simulation = simulation
        self._all = (simulation, *followers)
        self._rules = rules
        self._seed = seed
        self._track = driven_track(simulation.tracks[0], rules)
        self._cars = [_Car(index=index, resets_left=rules.max_resets) for index in range(simulation.num_envs)]
        self._is_racing = np.ones(simulation.num_envs, dtype=np.bool_)
        for one in self._all:
            line_up(one, rules, seed=seed)
        for car in self._cars:
            self._log_start(car)

    @property
    def is_racing(self) -> bool:
        """Whether any trial goes on."""
        return bool(self._is_racing.any())

    def step(self, actions: NDArray[np.float32]) -> None:
        """Step the simulation, take note of what happened and do what the rules ask for.

        Args:
            actions: Of every car, steering angle [rad] and speed [m/s]; those of cars that race no more mean nothing
                (N, 2).
        """
        simulation, limit = self._simulation, self._rules.time_limit
        for one in self._all:
            one.step(actions)
        rows = simulation.judged.copy()
        is_event = (rows[:, _STATUS] == _LAP_COMPLETE) | simulation.terminated | simulation.truncated
        for car in self._cars:
            if car.status:
                continue
            row = rows[car.index]
            row[_LAP] += car.laps_before
            clock = car.began + float(row[_TIME])
            car.rows.append(row)
            car.clock.append(clock)
            car.actions.append(np.array(actions[car.index], dtype=np.float32))
            if row[_STATUS] == _PAUSE:  # the core keeps the progress of the mistake; log where the car stands
                row[_PROGRESS] = self._progress(car, row[_DISTANCE], near=row[_PROGRESS])
            # half a step of slack: the clock runs in steps of 1/15 s; time up comes before everything else
            if limit > 0.0 and clock >= limit - 0.5 * CONTROL_DT:
                row[_STATUS] = _TIME_UP
                self._end(car, row, clock)
            elif is_event[car.index]:
                self._event(car, row, clock)

    def rows_of(self, car: int) -> Sequence[NDArray[np.float64]]:
        """The steps of a car that are logged by now, the ones that prepare a start included; each (row_width,)."""
        return self._cars[car].rows

    def trials(self) -> tuple[Trial, ...]:
        """The results, once no car is racing."""
        return tuple(self._trial(car) for car in self._cars)

    def _event(self, car: _Car, row: NDArray[np.float64], clock: float) -> None:
        status = STATUS_NAMES[int(row[_STATUS])]
        if status == "lap_complete":
            self._finish_lap(car, row, clock)
            if len(car.laps) == self._rules.laps:
                self._retire(car, status)
            elif self._simulation.terminated[car.index]:
                self._start_again(car, clock)
        elif status in RESET_STATUSES:
            car.mistakes[status] += 1
            if car.resets_left > 0:
                self._put_back(car, status)
            else:
                self._end(car, row, clock)
        else:  # cut by the limit on steps
            self._end(car, row, clock)

    def _put_back(self, car: _Car, status: str) -> None:
        steps = self._rules.penalty_steps(status)
        crashed = int(car.rows[-1][_CRASHED_OBJECT]) if status == "crashed" else -1
        car.crashes[crashed] += crashed >= 0
        mercy = self._rules.mercy_after > 0 and crashed >= 0 and car.crashes[crashed] >= self._rules.mercy_after
        if mercy:
            car.crashes[crashed] = 0
        pose = avoiding_pose(self._track, car.rows[-2], crashed=crashed, mercy=mercy)
        if self._simulation.cars_per_race > 1:
            pose = clear_pose(self._track, pose, self._around(car))
        for one in self._all:
            one.set_pose(car.index, *pose)
            one.freeze(car.index, steps)
        car.resets_left -= 1
        car.resets += 1
        car.penalty += steps * CONTROL_DT

    def _around(self, car: _Car) -> NDArray[np.float64]:
        """Middles of all that is around a car now, those included that were put back in this very step  (K, 2)."""
        size = self._simulation.cars_per_race
        first = car.index // size * size
        others = [env for env in range(first, first + size) if env != car.index and not self._cars[env].status]
        objects = car.rows[-1][len(ROW_COLUMNS) + len(OBJECT_HEADER) :].reshape(-1, len(OBJECT_COLUMNS))
        things = objects[: self._simulation.objects.count, [_OBJECT_X, _OBJECT_Y]]
        return np.concatenate([things, self._simulation.vehicles[:2, others].T.astype(np.float64)])

    def _start_again(self, car: _Car, clock: float) -> None:
        mask = np.zeros(self._simulation.num_envs, dtype=np.bool_)
        mask[car.index] = True
        for one in self._all:
            one.reset(mask)
        if self._rules.starts == "line" and car.index > 0:
            offset, lap = start_offset(self._simulation, car.index), len(car.laps)
            pose = start_pose(self._track, self._rules, seed=self._seed, trial=car.index, lap=lap, offset=offset)
            for one in self._all:
                one.set_pose(car.index, *pose)
        car.began = clock
        car.laps_before = len(car.laps)
        car.resets_left = self._rules.max_resets
        self._log_start(car)

    def _log_start(self, car: _Car) -> None:
        """Log the prepare step, at the pose that the car was given since."""
        row = self._simulation.judged[car.index].copy()
        if self._rules.starts == "lap" or self._simulation.cars_per_race > 1:  # it stands where the simulation put it
            car.start = float(row[_DISTANCE] - row[_PROGRESS] * self._track.length)
            row[_LAP] = car.laps_before
            self._log(car, row)
            return
        car.start = start_distance(self._track, self._rules)
        x, y, heading = self._simulation.vehicles[:3, car.index].astype(np.float64).tolist()
        row[_X], row[_Y] = x + REFERENCE_AHEAD * np.cos(heading), y + REFERENCE_AHEAD * np.sin(heading)
        row[_HEADING] = heading
        row[_DISTANCE], row[_OFFSET] = self._track.project(row[[_X, _Y]])
        row[_LAP] = car.laps_before
        row[_PROGRESS] = self._progress(car, row[_DISTANCE], near=0.0)
        self._log(car, row)

    @staticmethod
    def _log(car: _Car, row: NDArray[np.float64]) -> None:
        car.rows.append(row)
        car.clock.append(car.began + float(row[_TIME]))
        car.actions.append(np.zeros(2, dtype=np.float32))

    def _finish_lap(self, car: _Car, row: NDArray[np.float64], clock: float) -> None:
        began = car.laps[-1].start_time + car.laps[-1].time if car.laps else 0.0
        status = STATUS_NAMES[int(row[_STATUS])]
        car.laps.append(
            Lap(
                number=len(car.laps) + 1,
                status=status,
                start_time=began,
                time=clock - began,
                completion=1.0 if status == "lap_complete" else float(np.clip(row[_PROGRESS], 0.0, 1.0)),
                off_track_count=car.mistakes["off_track"],
                crash_count=car.mistakes["crashed"],
                immobilized_count=car.mistakes["immobilized"],
                reversed_count=car.mistakes["reversed"],
                resets=car.resets,
                penalty_seconds=car.penalty,
            )
        )
        car.mistakes.clear()
        car.resets, car.penalty = 0, 0.0

    def _end(self, car: _Car, row: NDArray[np.float64], clock: float) -> None:
        self._finish_lap(car, row, clock)
        self._retire(car, car.laps[-1].status)

    def _retire(self, car: _Car, status: str) -> None:
        car.status = status
        self._is_racing[car.index] = False

    def _trial(self, car: _Car) -> Trial:
        rows = np.array(car.rows)
        rows.flags.writeable = False
        number = car.index % self._simulation.cars_per_race
        return Trial(
            index=car.index,
            laps=tuple(car.laps),
            status=car.status,
            completion=sum(lap.completion for lap in car.laps) / self._rules.laps,
            recording=Recording(self._track, rows, np.array(car.clock), np.array(car.actions), number),
        )

    def _progress(self, car: _Car, distance: float, *, near: float) -> float:
        """Fraction of the lap at a distance along the track; of a closed track's many, that near another."""
        track = self._track
        fraction = (distance - car.start) / track.length
        return float(fraction - np.round(fraction - near)) if track.is_closed else float(fraction)
