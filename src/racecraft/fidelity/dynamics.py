"""Drives the simulated car open loop through windows of a log, with the log's commands and time stamps.

A window is 6 rows that tell the model how the car moves, then 15 steps on its own. Every window of a log is driven
by the native core at once (native/src/replay_kernel.hpp).

The stamp of a row belongs to the pose of the *next* one in most of the original's logs: the motion from row i to i + 1
lasted t[i] - t[i - 1]. Older versions moved by a fixed 1/15 s whatever the stamp says. `step_durations` finds out
which of the two a log is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.fidelity.logs import Log
from racecraft.sim.logged import drive_windows
from racecraft.sim.simulation import CONTROL_DT
from racecraft.sim.vehicle import Vehicle

KNOWN_ROWS: Final = 6
FREE_STEPS: Final = 15
REPORTED_STEPS: Final = (5, 10, 15)
WINDOW_ROWS: Final = KNOWN_ROWS + FREE_STEPS
REFERENCE_AHEAD: Final = 0.14  # m, from the car's origin to the logged point
DURATIONS: Final = (0.02, 0.15)  # s; a step outside was no step of 15 Hz
CLOCKS: Final = ("late", "prompt", "steady")


@dataclass(frozen=True)
class Windows:
    """Windows of one or more logs, ready to be driven."""

    poses: NDArray[np.float64]  # car's origin and heading   (R, 3)
    commands: NDArray[np.float32]  # rad and m/s   (R, 2)
    durations: NDArray[np.float32]  # s   (R,)
    first: NDArray[np.int64]  # row where each window begins   (W,)
    source: tuple[str, ...]  # file of each block of rows
    lines: NDArray[np.int64]  # of the file   (R,)
    clock: str

    def __len__(self) -> int:
        return len(self.first)

    def take(self, chosen: NDArray[np.int64]) -> Windows:
        """Some of the windows, by number."""
        return Windows(
            self.poses, self.commands, self.durations, self.first[chosen], self.source, self.lines, self.clock
        )

    def truth(self) -> NDArray[np.float64]:
        """Logged poses of the free steps   (W, FREE_STEPS, 3)."""
        rows = self.first[:, None] + np.arange(KNOWN_ROWS, WINDOW_ROWS)
        return np.asarray(self.poses[rows])

    def drive(self, vehicle: Vehicle) -> NDArray[np.float64]:
        """Predicted poses of the free steps   (W, FREE_STEPS, 3)."""
        return self.drive_values(vehicle.values())

    def drive_values(self, values: list[float]) -> NDArray[np.float64]:
        """The same for a car given as its parameters' values."""
        return drive_windows(
            values,
            poses=self.poses,
            commands=self.commands,
            durations=self.durations,
            first=self.first,
            known=KNOWN_ROWS,
            free=FREE_STEPS,
        )


def windows_of(logs: Iterable[Log], *, stride: int = 1) -> Windows | None:
    """Every `stride`-th window of some logs of one kind; None if no episode is long enough."""
    logs = list(logs)
    poses, commands, durations, first, lines = [], [], [], [], []
    clock = clock_of(logs)
    begin = 0
    for log in logs:
        origin_x = log.x - REFERENCE_AHEAD * np.cos(log.heading)
        origin_y = log.y - REFERENCE_AHEAD * np.sin(log.heading)
        lasts = step_durations(log, clock)
        poses.append(np.column_stack([origin_x, origin_y, log.heading]))
        commands.append(np.column_stack([log.steering_angle, log.speed]).astype(np.float32))
        durations.append(lasts.astype(np.float32))
        lines.append(log.lines)
        is_step = (lasts >= DURATIONS[0]) & (lasts <= DURATIONS[1])
        # a car that stands for a penalty was put there, and does not do what it is told
        stands = log.is_paused | np.append(log.is_paused[1:], False)
        # Windows of drivable steps within one episode: count the steps that are none.
        faults = np.concatenate([[0], np.cumsum(~is_step | log.is_prepare | stands)])
        number = np.cumsum(log.is_first)
        starts = np.arange(0, max(0, len(log) - WINDOW_ROWS + 1), stride)
        if len(starts):
            whole = number[starts] == number[starts + WINDOW_ROWS - 1]
            drivable = faults[starts + WINDOW_ROWS - 1] == faults[starts]
            first.append(starts[whole & drivable] + begin)
        begin += len(log)
    if not first or not sum(map(len, first)):
        return None
    return Windows(
        np.concatenate(poses),
        np.concatenate(commands),
        np.concatenate(durations),
        np.concatenate(first).astype(np.int64),
        tuple(log.source for log in logs),
        np.concatenate(lines),
        clock,
    )


def step_durations(log: Log, clock: str) -> NDArray[np.float64]:
    """How long the motion from each row to the next lasted by one reading of the stamps; NaN where unknown   (R,)."""
    if clock == "steady":
        return np.full(len(log), CONTROL_DT)
    lasts = np.full(len(log), np.nan)
    passed = np.diff(log.time)
    if clock == "late":
        lasts[1:] = np.where(log.is_first[1:], np.nan, passed)
    else:
        lasts[:-1] = np.where(log.is_first[1:], np.nan, passed)
    return lasts


def clock_of(logs: Iterable[Log]) -> str:
    """Which reading of the stamps explains best how far the car moved from row to row."""
    share: dict[str, list[NDArray[np.float64]]] = {clock: [] for clock in CLOCKS}
    for log in logs:
        moved = np.hypot(np.diff(log.x), np.diff(log.y))
        if len(moved) < 12:
            continue
        smooth = np.convolve(moved, np.ones(11) / 11, mode="same")
        inner = np.zeros(len(moved), dtype=np.bool_)
        inner[5:-6] = True
        # within one episode, and moving
        number = np.cumsum(log.is_first)
        whole = np.zeros_like(inner)
        whole[5:-6] = number[:-12] == number[12:]
        inner &= whole & (smooth > 0.02)
        for clock in CLOCKS:
            lasts = step_durations(log, clock)[:-1]
            share[clock].append((moved / np.maximum(smooth, 1e-9) - lasts / CONTROL_DT)[inner])
    spread = {clock: _spread(parts) for clock, parts in share.items()}
    return min(spread, key=spread.__getitem__)


def _spread(parts: list[NDArray[np.float64]]) -> float:
    values = np.concatenate(parts) if parts else np.zeros(0)
    values = values[np.isfinite(values)]
    return float(values.std()) if len(values) > 20 else float("inf")


def errors_of(prediction: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Error in m of the logged point and in rad of the heading   (W, steps, 2)."""
    cos, sin = np.cos(prediction[..., 2]), np.sin(prediction[..., 2])
    true_cos, true_sin = np.cos(truth[..., 2]), np.sin(truth[..., 2])
    dx = prediction[..., 0] - truth[..., 0] + REFERENCE_AHEAD * (cos - true_cos)
    dy = prediction[..., 1] - truth[..., 1] + REFERENCE_AHEAD * (sin - true_sin)
    turn = np.abs(np.arctan2(sin * true_cos - cos * true_sin, cos * true_cos + sin * true_sin))
    return np.stack([np.hypot(dx, dy), turn], axis=-1)


def reported_errors(windows: Windows, vehicle: Vehicle) -> NDArray[np.float64]:
    """Errors after `REPORTED_STEPS`   (W, 3, 2)."""
    steps = np.array(REPORTED_STEPS) - 1
    return errors_of(windows.drive(vehicle)[:, steps], windows.truth()[:, steps])
