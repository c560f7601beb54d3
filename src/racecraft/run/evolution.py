"""What a policy drove while it learned: a lap of some of its evaluations, all from the same start, a line of JSON each.

    {"kind": "lap", "step": 8192, "lap_time": null, "completion": 0.31, "poses": [[x, y, heading], ...]}

A pose is the car's origin in whole mm and mrad, every 1/15 s. The more steps lie behind, the rarer a lap is kept, so
that a training of any length keeps a few dozen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_number
from racecraft.run.folder import RunFolder
from racecraft.run.history import read_history

RATIO: Final = 1.2
"""Between the steps of two laps that are kept, about."""
MAX_BYTES: Final = 1 << 23
"""That are read; sixty laps of a minute are one million."""
MAX_POSES: Final = 3000
MAX_PLACE: Final = 10**9
"""mm and mrad; tracks lie within 10 km of their origin."""
MAX_STEP: Final = 1000
"""mm along x or y between two poses; a car drives 270."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """A lap, or the attempt at one."""

    step: int
    """Camera steps of training behind the policy that drove."""
    lap_time: float | None
    """s, of a whole lap."""
    completion: float
    """Share of the lap driven, 0 to 1."""
    poses: NDArray[np.int64]
    """x, y [mm] and heading [mrad] of the car's origin, every 1/15 s  (T, 3)."""

    def point(self) -> dict[str, Any]:
        """As a line of the file."""
        return {
            "step": self.step,
            "lap_time": self.lap_time,
            "completion": round(self.completion, 4),
            "poses": self.poses.tolist(),
        }


def is_kept(step: int, before: int) -> bool:
    """Whether the lap driven after so many steps is kept, where the evaluation before it was after `before` steps."""
    return before <= 0 or _place(step) > _place(before)


def read_drives(folder: RunFolder) -> list[Drive]:
    """The laps that a training kept, in their order; lines that are damaged are passed over."""
    points, _ = read_history(folder.evolution, max_bytes=MAX_BYTES)
    return [drive for drive in map(_drive, points) if drive is not None]


def records(drives: list[Drive], best: Drive | None = None) -> list[Drive]:
    """Those that came further, or round faster, than all before them, and less far than `best`.

    The best is so by all trials of an evaluation; in a single lap an earlier one may have had more luck.
    """
    if best is not None:
        drives = [drive for drive in drives if _rank(drive) < _rank(best)]
    found: list[Drive] = []
    for drive in drives:
        if not found or _rank(drive) > _rank(found[-1]):
            found.append(drive)
    return found


def evenly(drives: list[Drive], most: int) -> list[Drive]:
    """At most so many of them, the first and the last among them."""
    if len(drives) <= most:
        return drives
    return [drives[round(place)] for place in np.linspace(0, len(drives) - 1, most).tolist()]


def _rank(drive: Drive) -> tuple[float, float]:
    return drive.completion, -(drive.lap_time if drive.lap_time is not None else math.inf)


def _place(step: int) -> int:
    return math.floor(math.log(max(step, 1)) / math.log(RATIO))


def _drive(point: dict[str, Any]) -> Drive | None:
    try:
        lap_time, completion, poses = point["lap_time"], point["completion"], np.array(point["poses"])
        check_number("completion", completion, -math.inf)
        if lap_time is not None:
            check_number("lap_time", lap_time, 0.0)
        if poses.dtype != np.int64 or poses.ndim != 2 or poses.shape[1] != 3 or not 2 <= len(poses) <= MAX_POSES:
            return None
        if poses.min() < -MAX_PLACE or poses.max() > MAX_PLACE:
            return None
        if np.abs(np.diff(poses[:, :2], axis=0)).max() > MAX_STEP:
            return None  # a film would draw the way there, dot by dot
        return Drive(
            step=int(point["step"]),
            lap_time=None if lap_time is None else float(lap_time),
            completion=min(max(float(completion), 0.0), 1.0),
            poses=poses,
        )
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
