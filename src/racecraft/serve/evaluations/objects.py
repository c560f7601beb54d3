"""Where boxes and other cars were while somebody drove: the replay says it, AWS's file of steps does not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.analysis import TracedLap
from racecraft.errors import ReplayError
from racecraft.race.recording import Recording
from racecraft.replay.replay import read_replay
from racecraft.run import RunFolder
from racecraft.serve.evaluations.schemas import RoadObject
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS
from racecraft.sim.objects import OBJECT_KINDS

MAX_SHOWN: Final = 8_000_000
"""Numbers of a replay that the server reads to show it, 64 MB in memory: six hours of driving, or a hundred minutes
among six objects. A worker may have written the file, and many may ask."""
STILL: Final = 1e-6  # m and rad; what moves less stands
RACERS: Final = ("racer", "frozen_racer", "gone_racer")


def objects_of(folder: RunFolder, stamp: str, laps: Sequence[TracedLap]) -> dict[int, list[RoadObject]]:
    """What was on the road in each lap, by the lap's number; nothing where no replay says it."""
    path = folder.evaluation_replay(stamp)
    if not path.is_file():
        return {}
    try:
        replay = read_replay(path, max_numbers=MAX_SHOWN)
    except ReplayError:
        return {}
    if not replay.conditions.num_objects:
        return {}
    driven = [car.recording.lap(number) for car in replay.cars for number in _laps(car.recording)]
    return {
        lap.number: objects_in(driven[lap.number - 1].rows)
        for lap in laps
        if lap.number <= len(driven) and len(driven[lap.number - 1]) == len(lap.time)
    }


def _laps(recording: Recording) -> list[int]:
    return [int(number) for number in np.unique(recording.lap_numbers)]


def objects_in(rows: NDArray[np.float64], *, has_racers: bool = True) -> list[RoadObject]:
    """What was on the road besides the car that was driven.

    Args:
        rows: Of a recording, objects included  (T, row_width).
        has_racers: Whether other cars of the same race are among it.
    """
    table = rows[:, len(ROW_COLUMNS) + len(OBJECT_HEADER) :].reshape(len(rows), -1, len(OBJECT_COLUMNS))
    found = []
    for index in range(table.shape[1]):
        kind = OBJECT_KINDS[int(table[0, index, 0])]
        poses = table[:, index, 1:4]
        if np.ptp(poses, axis=0).max(initial=0.0) < STILL:
            poses = poses[:1]
        x, y, heading = (column.round(3).tolist() for column in poses.T)
        if kind != "gone_racer" and (has_racers or kind not in RACERS):
            found.append(RoadObject(kind=kind, x=x, y=y, heading=heading))
    return found
