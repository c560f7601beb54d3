"""Laps read back from a sim-trace: where a car was when, so that two laps can be laid over each other.

A trace holds commands; the speed that a car really had comes from its places a control step apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.recording import REFERENCE_AHEAD, STANDING, poses_seen
from racecraft.run.simtrace import read_simtrace
from racecraft.sim.simulation import CONTROL_DT
from racecraft.track import Track

Floats = NDArray[np.float64]

MAX_ROWS: Final = 60_000
"""Of one file; an evaluation of 20 trials of 20 laps has as many."""
MIN_ROWS: Final = 5
ROUNDED: Final = 1e-3  # s by which a file's times may be off
JUMP: Final = 1.0  # m between two steps: the car was put somewhere else


@dataclass(frozen=True, eq=False)
class TracedLap:
    """One lap of a trace, or the attempt at one; R rows, SI units and radians."""

    number: int
    """Within the trace, from 1, as AWS counts trials."""
    status: str
    """Of its last row; of a whole lap ``lap_complete``, whatever a simulator wrote there."""
    time: Floats
    """s since its first row  (R,)."""
    share: Floats
    """Of the lap driven, 0 to 1, never falling  (R,)."""
    points: Floats
    """x, y of the point 0.14 m ahead of the car's origin  (R, 2)."""
    heading: Floats
    steering_angle: Floats
    """Commanded."""
    throttle: Floats
    """Commanded speed, m/s."""
    reward: Floats
    is_placed: NDArray[np.bool_]
    """Whether the car did not drive to where it is: it was put there, or stands  (R,)."""
    penalty_seconds: float = 0.0
    """s that it stood for its mistakes."""
    puts: tuple[int, ...] = ()
    """Rows in which the car stands where it was put after a mistake: it did not drive there."""
    goes_on: bool = False
    """Whether the car drove on from the lap before, instead of starting anew."""

    @property
    def is_complete(self) -> bool:
        """Whether it crossed the line."""
        return self.status == "lap_complete"

    @property
    def seconds(self) -> float:
        """How long it took; a lap's row of preparation counts."""
        return float(self.time[-1]) + CONTROL_DT

    @cached_property
    def speed(self) -> Floats:
        """Driven speed, m/s, from the places of neighbouring steps; 0 where the car was put elsewhere  (R,)."""
        step = np.hypot(*np.diff(self.points, axis=0).T)
        pace = step / np.maximum(np.diff(self.time), 0.5 * CONTROL_DT)
        before, after = np.concatenate([pace[:1], pace]), np.concatenate([pace, pace[-1:]])
        for row in self.puts:
            after[row - 1], before[row] = before[row - 1], 0.0
        return np.asarray(0.5 * (before + after))

    def seen_from(self, age: float) -> Floats:
        """X [m], y [m] and heading [rad] of the car's origin when pictures of this age (s) were taken  (R, 3)."""
        ahead = REFERENCE_AHEAD * np.stack([np.cos(self.heading), np.sin(self.heading)], axis=1)
        is_put = np.isin(np.arange(len(self.time)), self.puts)
        return poses_seen(np.column_stack([self.points - ahead, self.heading]), age, is_put=is_put)

    @property
    def commands(self) -> NDArray[np.float32]:
        """Steering angle [rad] and speed [m/s] told since the row before; NaN where the car did not do it  (R, 2)."""
        told = np.full((len(self.time), 2), np.nan, np.float32)
        told[1:] = np.column_stack([self.steering_angle, self.throttle])[:-1]
        told[1:][self.is_placed[1:] | self.is_placed[:-1]] = np.nan
        return told

    def time_at(self, shares: Floats) -> Floats:
        """When it reached some shares of the lap, s since it began: a step before its first row."""
        reached = np.interp(shares, np.append(0.0, self.share), np.append(0.0, self.time + CONTROL_DT))
        return np.where(shares > 0.0, reached, 0.0)


def read_laps(path: str | Path) -> list[TracedLap]:
    """The laps of a sim-trace file.

    Raises:
        RunError: It is not readable, no sim-trace, or too long.
    """
    return split_laps(read_simtrace(path, max_rows=MAX_ROWS))


def split_laps(columns: dict[str, NDArray[Any]]) -> list[TracedLap]:
    """The laps in the columns of a sim-trace; AWS calls each an episode. Stubs of a few rows are left out."""
    episode = columns["episode"]
    if not len(episode):
        return []
    starts = np.concatenate([[0], np.flatnonzero(np.diff(episode)) + 1, [len(episode)]])
    statuses = columns.get("episode_status")
    laps: list[TracedLap] = []
    for begin, end in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        if end - begin < MIN_ROWS:
            continue
        rows = slice(begin, end)
        time = _on_steps(columns["tstamp"][rows].astype(np.float64))
        points = np.column_stack([columns["X"][rows], columns["Y"][rows]]).astype(np.float64)
        is_paused = np.zeros(end - begin, bool) if statuses is None else statuses[rows] == "pause"
        is_put = (is_paused[1:] & ~is_paused[:-1]) | (np.hypot(*np.diff(points, axis=0).T) > JUMP)
        share = np.maximum.accumulate(np.clip(columns["progress"][rows] / 100.0, 0.0, 1.0))
        status = str(statuses[end - 1]) if statuses is not None else ""
        if status in ("", "in_progress") and share[-1] >= 1.0:  # AWS's word for a lap that flows into the next
            status = "lap_complete"
        stands = np.zeros(end - begin, bool) if statuses is None else np.isin(statuses[rows], STANDING)
        laps.append(
            TracedLap(
                number=int(episode[begin]) + 1,
                status=status,
                time=time - time[0],
                share=share,
                points=points,
                heading=np.radians(columns["yaw"][rows]),
                steering_angle=np.radians(columns["steer"][rows]),
                throttle=columns["throttle"][rows].astype(np.float64),
                reward=columns["reward"][rows].astype(np.float64),
                is_placed=stands | np.append(False, is_put),
                penalty_seconds=CONTROL_DT * int(is_paused.sum()),
                puts=tuple((np.flatnonzero(is_put) + 1).tolist()),
                goes_on=bool(laps) and not stands[0] and math.dist(laps[-1].points[-1], points[0]) <= JUMP,
            )
        )
    return laps


def in_one(laps: Sequence[TracedLap]) -> TracedLap:
    """Laps of which each goes on from the one before, as a single one with the last one's number."""
    names = ("share", "points", "heading", "steering_angle", "throttle", "reward", "is_placed")
    arrays: dict[str, Any] = {name: np.concatenate([getattr(lap, name) for lap in laps]) for name in names}
    begins = np.cumsum([0, *(len(lap.time) for lap in laps)]).tolist()
    return replace(
        laps[-1],
        time=np.arange(begins[-1]) * CONTROL_DT,
        puts=tuple(begin + row for begin, lap in zip(begins, laps, strict=False) for row in lap.puts),
        **arrays,
    )


def _on_steps(seconds: Floats) -> Floats:
    """Times that a trace of ours has rounded to ms, as the steps that they were; another's as they are."""
    steps = np.round(seconds / CONTROL_DT) * CONTROL_DT
    return steps if np.abs(steps - seconds).max() < ROUNDED else seconds


def start_place(track: Track, lap: TracedLap) -> float:
    """Place on the centre line, m, where a lap's shares count from."""
    place = float(track.project(lap.points[0])[0])
    return place - float(lap.share[0]) * track.length


def driven_direction(track: Track, paths: Sequence[Floats]) -> Track:
    """The track in the direction in which most of some paths drive it; m, each (R, 2)."""
    forward = 0.0
    for points in paths:
        places = track.project(points)[0]
        step = np.diff(places)
        forward += float(np.sign(step[np.abs(step) < JUMP]).sum())
    return track if forward >= 0 else track.reversed()
