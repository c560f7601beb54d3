"""What one trial did, step by step: the source of its video, its racing line and its log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecraft.race.default_reward import centerline_rewards
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.simulation import CONTROL_DT
from racecraft.sim.views import ObjectView, views_of_objects
from racecraft.track.track import Track

REFERENCE_AHEAD = 0.14
"""m from the car's origin to the point that x and y speak of."""
SUBSTEPS = 8
"""Of physics in a control step, as `Simulation` has them unless it is told otherwise."""
STANDING = ("prepare", "pause", "park")
"""Statuses of steps in which a car does nothing that it is told."""


def poses_seen(poses: NDArray[np.float64], age: float, *, is_put: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Poses in which pictures of a camera of this age (s) were taken, between two steps  (T, 3).

    Args:
        poses: X [m], y [m] and heading [rad] of every step  (T, 3).
        age: Of the pictures, s.
        is_put: Whether the car did not drive to where it is in a step  (T,).
    """
    moved = np.diff(poses, axis=0)
    moved[:, 2] = np.arctan2(np.sin(moved[:, 2]), np.cos(moved[:, 2]))
    share = np.where(is_put[1:], 0.0, round(age / CONTROL_DT * SUBSTEPS) / SUBSTEPS)
    return np.vstack([poses[:1], poses[1:] - share[:, None] * moved])


@dataclass(frozen=True, eq=False)
class Recording:
    """The judged rows of a trial, one per control step, prepare steps included; T steps."""

    track: Track
    """In driving direction."""
    rows: NDArray[np.float64]
    """As the simulation gave them, objects included, with `lap` counted over the whole trial  (T, row_width)."""
    clock: NDArray[np.float64]
    """s since the trial began; the rows' own `time` begins anew with every standing start  (T,)."""
    actions: NDArray[np.float32]
    """What the driver asked for in every step, steering angle [rad] and speed [m/s], before any limit; zero in prepare
    steps, where nobody is asked  (T, 2)."""
    car: int = 0
    """Number of the car in its race."""

    def __len__(self) -> int:
        return len(self.rows)

    def column(self, name: str) -> NDArray[np.float64]:
        """A column of the rows by name, as a view  (T,)."""
        return self.rows[:, ROW_COLUMNS.index(name)]

    def objects(self, step: int, *, alpha: float = 1.0) -> list[ObjectView]:
        """What stood or drove on the track besides the car, as pictures show it.

        Args:
            step: Index of the row.
            alpha: How solid the cars are that stand as a penalty.
        """
        return views_of_objects(self.rows[step, len(ROW_COLUMNS) :], car=self.car, alpha=alpha)

    @cached_property
    def origins(self) -> NDArray[np.float64]:
        """x, y of the car's origin, m  (T, 2)."""
        heading = self.column("heading")
        ahead = REFERENCE_AHEAD * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        return np.asarray(np.stack([self.column("x"), self.column("y")], axis=1) - ahead)

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """X [m], y [m] and heading [rad] of the car's origin  (T, 3)."""
        return np.column_stack([self.origins, self.column("heading")])

    def seen_from(self, age: float) -> NDArray[np.float64]:
        """Poses, as `poses`, in which pictures of a camera of this age (s) were taken, between two steps  (T, 3)."""
        return poses_seen(self.poses, age, is_put=self.is_placed)

    @cached_property
    def is_placed(self) -> NDArray[np.bool_]:
        """Whether the car did not drive to where it is in a step: it was put there, or stands  (T,)."""
        return np.isin(self.column("status"), [STATUS_NAMES.index(name) for name in STANDING])

    @cached_property
    def distances(self) -> NDArray[np.float64]:
        """Laps driven since the start, whole and in part  (T,)."""
        driven = self.column("lap") + self.column("progress").clip(0.0, 1.0)
        is_line = self.column("status") == STATUS_NAMES.index("lap_complete")
        return np.where(is_line, self.column("lap"), driven)

    def steps_at(self, seconds: NDArray[np.float64]) -> NDArray[np.intp]:
        """The step that is shown at each of some times on the clock: the last one begun, at the end the last of all."""
        # half a step of slack: clocks count steps of 1/15 s
        steps = np.searchsorted(self.clock, seconds + 0.5 * CONTROL_DT, side="right") - 1
        return np.asarray(steps.clip(0))

    @cached_property
    def rewards(self) -> NDArray[np.float64]:
        """AWS's default reward, which evaluations log whatever the policy learned from; 0 while a car stands  (T,)."""
        return np.where(self.is_placed, 0.0, centerline_rewards(self.rows))

    @cached_property
    def events(self) -> list[tuple[int, str]]:
        """Steps in which something happened, and what: a start (``prepare``), a lap, a mistake, the end of the time."""
        quiet = ("in_progress", "pause", "park")
        return [(step, status) for step, status in enumerate(self.statuses) if status not in quiet]

    @cached_property
    def statuses(self) -> list[str]:
        """Status of every step by name  (T,)."""
        return [STATUS_NAMES[code] for code in self.column("status").astype(int)]

    @cached_property
    def lap_numbers(self) -> NDArray[np.int64]:
        """The lap that every step belongs to, from 1; the step that completes a lap is its last  (T,)."""
        completed = self.column("lap").astype(np.int64)
        is_last = self.column("status") == STATUS_NAMES.index("lap_complete")
        return np.asarray(completed + 1 - is_last)

    @cached_property
    def lap_clock(self) -> NDArray[np.float64]:
        """Seconds since the lap of every step began, of its first step already one step  (T,)."""
        first = np.concatenate(([True], np.diff(self.lap_numbers) != 0))
        began = self.clock[np.flatnonzero(first)][np.cumsum(first) - 1] - CONTROL_DT
        return np.asarray(self.clock - began)

    @cached_property
    def lap_times(self) -> dict[int, float]:
        """Times of the laps completed in this recording by their number, s."""
        times = {}
        for number in np.unique(self.lap_numbers).tolist():
            steps = np.flatnonzero(self.lap_numbers == number)
            if self.statuses[steps[-1]] == "lap_complete":
                times[number] = float(self.clock[steps[-1]] - self.clock[steps[0]]) + CONTROL_DT
        return times

    def until(self, seconds: float) -> Recording:
        """The steps up to a time on the clock."""
        return self._only(self.clock <= seconds)

    def lap(self, number: int) -> Recording:
        """The steps of one lap, numbered from 1."""
        return self._only(self.lap_numbers == number)

    def _only(self, steps: NDArray[np.bool_]) -> Recording:
        return replace(self, rows=self.rows[steps], clock=self.clock[steps], actions=self.actions[steps])
