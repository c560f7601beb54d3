"""Cars that people drive themselves.

The browser keeps the time: it asks for a step every 1/15 s and is told where the car is. So a closed tab costs
nothing, a slow network loses no step, and nobody can drive faster than the simulator allows. There are few drives at a
time, and one that nobody asks about is forgotten.

    controls ──▶ Simulation (one car, no camera) ──▶ judged row ──▶ lap times, penalties, pose
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import Counter
from typing import Final

import numpy as np

from racecraft.race.placement import reset_pose
from racecraft.race.rules import RESET_STATUSES
from racecraft.serve.driving.schemas import Controls, DrivenLap, DriveState
from racecraft.serve.problems import Conflict, NotFound
from racecraft.sim import CONTROL_DT, ROW_COLUMNS, STATUS_NAMES, Simulation, Start
from racecraft.track import Track

MAX_DRIVES: Final = 8
IDLE: Final = 300.0  # s after which a drive that nobody asks about is forgotten
PENALTY: Final = 1.0  # s that a car stands after leaving the track
LONGEST_TRACE: Final = 15 * 300  # steps of a lap that are remembered
_STATUS, _TIME, _PROGRESS = (ROW_COLUMNS.index(name) for name in ("status", "time", "progress"))


class DrivenCar:
    """One car on one track, driven by hand.

    Args:
        track: Where.
        vehicle: Preset.
        direction: ``forward`` or ``reverse``.
        user_id: Who drives.
    """

    def __init__(self, track: Track, *, vehicle: str, direction: str, user_id: int) -> None:
        self.track, self.vehicle, self.direction, self.user_id = track, vehicle, direction, user_id
        self.lock = threading.Lock()
        self._simulation = Simulation(
            track,
            vehicle=vehicle,
            camera=None,
            start=Start(mode="fixed"),
            direction=direction,
            laps=1_000_000 if track.is_closed else 1,
            max_steps=2**31 - 1,
            num_threads=1,
        )
        self._simulation.reset()
        self._driven = self._simulation.driven_track(0)
        self._began = 0.0  # time at which the present lap began
        self._lap, self._mistakes, self._standing = 1, 0, 0
        self._before = self._simulation.judged[0].copy()
        self._trace: list[list[int]] = []

    @property
    def pose(self) -> list[int]:
        """X, y, heading, speed, steering in mm and mrad; share of the lap in 1/1000."""
        x, y, heading, speed, _, _, steering = self._simulation.vehicles[:, 0].tolist()
        progress = float(self._simulation.judged[0, _PROGRESS])
        return [round(1000 * value) for value in (x, y, heading, speed, steering, progress)]

    def step(self, controls: Controls) -> tuple[DriveState, list[list[int]]]:
        """Drive on.

        Returns:
            Where the car is, and, when a lap was completed, its trace: x, y, heading of every step in mm and mrad.
        """
        mistake, finished, trace = "", None, []
        for _ in range(controls.steps):
            self._simulation.step([[controls.steering, controls.speed]])
            row = self._simulation.judged[0].copy()
            status = STATUS_NAMES[int(row[_STATUS])]
            self._standing = max(0, self._standing - 1)
            if len(self._trace) < LONGEST_TRACE:
                self._trace.append(self.pose[:3])
            if status == "lap_complete":
                whole = self._trace if len(self._trace) < LONGEST_TRACE else []
                finished, trace = self._finish(float(row[_TIME])), whole
                break  # a lap to an answer
            if status in RESET_STATUSES:
                self._put_back(status)
                mistake = "" if status == "immobilized" else status
            self._before = row
        clock = float(self._simulation.judged[0, _TIME]) - self._began if finished is None else 0.0
        state = DriveState(
            pose=self.pose,
            clock=max(0.0, clock),
            lap=self._lap,
            standing=self._standing * CONTROL_DT,
            mistake=mistake,
            mistakes=self._mistakes,
            finished=finished,
        )
        return state, trace

    def _finish(self, now: float) -> DrivenLap:
        lap = DrivenLap(number=self._lap, seconds=round(now - self._began, 4), mistakes=self._mistakes, is_best=False)
        self._lap, self._mistakes, self._trace, self._began = self._lap + 1, 0, [], now
        if not self._driven.is_closed:  # an open road begins anew
            self._simulation.reset()
            self._began = 0.0
        self._before = self._simulation.judged[0].copy()
        return lap

    def _put_back(self, status: str) -> None:
        """A driver who waits is left alone; one who left the road stands where they left it."""
        if status == "immobilized":
            x, y, heading = self._simulation.vehicles[:3, 0].astype(np.float64).tolist()
            self._simulation.set_pose(0, x, y, heading)
            return
        self._mistakes += 1
        self._standing = round(PENALTY / CONTROL_DT)
        self._simulation.set_pose(0, *reset_pose(self._driven, self._before))
        self._simulation.freeze(0, self._standing)


class Drives:
    """The cars that are being driven."""

    def __init__(self) -> None:
        self._cars: dict[str, tuple[float, DrivenCar]] = {}
        self._lock = threading.Lock()

    def begin(self, track: Track, *, vehicle: str, direction: str, user_id: int) -> tuple[str, DrivenCar]:
        """Give a driver a car; when there are many, their oldest one is taken, or that of who has most.

        Raises:
            Conflict: Too many others are driving, each one car.
        """
        with self._lock:
            self._make_room(user_id)
        # a road of somebody's own can take half a minute, in which all others drive on
        key, car = secrets.token_hex(8), DrivenCar(track, vehicle=vehicle, direction=direction, user_id=user_id)
        with self._lock:
            self._make_room(user_id)
            self._cars[key] = (time.monotonic(), car)
            return key, car

    def _make_room(self, user_id: int) -> None:
        now = time.monotonic()
        self._cars = {key: (at, car) for key, (at, car) in self._cars.items() if now - at < IDLE}
        if len(self._cars) < MAX_DRIVES:
            return
        theirs = Counter(car.user_id for _, car in self._cars.values())
        most = user_id if theirs[user_id] else max(theirs, key=lambda user: theirs[user])
        if most != user_id and theirs[most] == 1:
            raise Conflict(f"{MAX_DRIVES} cars are being driven already.", hint="Try again in a minute.")
        del self._cars[min((at, key) for key, (at, car) in self._cars.items() if car.user_id == most)[1]]

    def car(self, key: str, *, user_id: int) -> DrivenCar:
        """A driver's car.

        Raises:
            NotFound: There is none of this id any more.
        """
        with self._lock:
            found = self._cars.get(key)
            if found is None or found[1].user_id != user_id:
                raise NotFound("This drive is over.", hint="Begin another.")
            self._cars[key] = (time.monotonic(), found[1])
            return found[1]

    def end(self, key: str, *, user_id: int) -> None:
        """Take a car away."""
        with self._lock:
            if key in self._cars and self._cars[key][1].user_id == user_id:
                del self._cars[key]
