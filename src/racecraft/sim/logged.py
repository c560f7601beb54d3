"""Drives somebody else ran, before the core: judged by its rules, and driven again by its cars.

racecraft.fidelity reads the logs; these are its two calls of the native core.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft import _native
from racecraft.sim.simulation import native_track
from racecraft.track.track import Track


class LogJudge:
    """The rules on one track.

    Args:
        track: In its own direction.
        reversed: Whether the log was driven against it.
    """

    def __init__(self, track: Track, *, reversed: bool = False) -> None:
        self.reversed = reversed
        self._track = native_track(track)

    def __call__(
        self,
        poses: NDArray[np.float64],
        commands: NDArray[np.float64],
        *,
        progress: NDArray[np.float64],
        is_first: NDArray[np.bool_],
        is_paused: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """What the simulation would have written of each row   (R, len(ROW_COLUMNS)).

        Args:
            poses: x and y of the point 0.14 m ahead of the car's origin in m, heading in rad   (R, 3).
            commands: Steering angle in rad and speed in m/s   (R, 2).
            progress: Fraction of a lap; read in first rows only, where it tells where the lap began   (R,).
            is_first: The row begins an episode   (R,).
            is_paused: The car stands for a penalty in this row   (R,).
        """
        log = np.ascontiguousarray(np.column_stack([poses, commands, progress, is_first, is_paused]), dtype=np.float64)
        return _native.judge_log(self._track, self.reversed, log)


def drive_windows(
    vehicle: list[float],
    *,
    poses: NDArray[np.float64],
    commands: NDArray[np.float32],
    durations: NDArray[np.float32],
    first: NDArray[np.int64],
    known: int,
    free: int,
    substeps: int = 8,
) -> NDArray[np.float64]:
    """Drive a car open loop through windows of a log, all of them at once.

    Args:
        vehicle: The car's parameters, `Vehicle.values`.
        poses: x and y of the car's origin in m, heading in rad   (R, 3).
        commands: Steering angle in rad and speed in m/s, acting from a row to the next   (R, 2).
        durations: Seconds from a row to the next   (R,).
        first: Row where each window begins   (W,).
        known: Rows that tell the model how the car moves.
        free: Rows after them that it predicts.
        substeps: Physics steps to a row.

    Returns:
        Predicted poses   (W, free, 3).
    """
    return _native.replay_windows(vehicle, poses, commands, durations, first, known, free, substeps)
