"""Fits the car's parameters to logs: damped least squares over windows driven open loop, judged on unseen episodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_number, check_whole
from racecraft.errors import RunError
from racecraft.fidelity.dynamics import REPORTED_STEPS, Windows, reported_errors, windows_of
from racecraft.fidelity.given import log_files, track_of, vehicle_of
from racecraft.fidelity.logs import GIVE_APART, Faults, Log, read_logs
from racecraft.fidelity.rules import require_length
from racecraft.sim.vehicle import LIMITS, Vehicle

if TYPE_CHECKING:
    from racecraft.track.track import Track

SEARCHED: Final[dict[str, tuple[float, float]]] = {
    "yaw_inertia": (0.06, 0.8),
    "front_axle": (0.03, 0.25),
    "rear_axle": (0.03, 0.25),
    "front_load": (0.15, 0.85),
    "front_friction": (0.1, 2.0),
    "rear_friction": (0.1, 2.0),
    "front_stiffness": (0.5, 20.0),
    "drive_acceleration": (0.5, 15.0),
    "brake_acceleration": (0.5, 15.0),
    "speed_time_constant": (0.03, 0.6),
    "steering_time_constant": (0.02, 0.8),
    "steering_bias": (-0.15, 0.15),
    "speed_gain": (0.8, 1.2),
}
"""What is fitted, and where it is looked for. The rest, logs of driving cannot tell apart."""
_STEPS: Final = np.array([3, 5, 7, 10, 12, 15]) - 1
_METRES: Final = np.array([0.02, 0.03, 0.048, 0.07, 0.09, 0.12])  # typical errors after _STEPS
_RADIANS: Final = np.radians([5.0, 7.5, 10.0, 12.5, 14.5, 17.5])
_BALANCE: Final = 1.6
"""Least yaw moment that the rear tyres can hold over the front ones'. Logs hold few slides, so the fit alone does not
know whether a car at its limit ploughs or spins; the original's plough."""
_NUDGE: Final = 2e-3  # of a parameter's range, for derivatives
MAX_ROWS: Final = 400_000
MIN_WINDOWS: Final = 50


@dataclass(frozen=True)
class Calibration:
    """A fitted car and how well it predicts episodes that the fit never saw."""

    vehicle: Vehicle
    preset: Vehicle
    windows: int  # fitted
    held_out_windows: int
    errors: NDArray[np.float64]  # m and rad after REPORTED_STEPS on held-out windows   (W, 3, 2)
    preset_errors: NDArray[np.float64]
    fitted: tuple[str, ...]  # names of the parameters that were free
    moved: int  # times that somebody moved the car by hand

    def to_dict(self) -> dict[str, Any]:
        """What ``racecraft calibrate --json`` prints."""
        return {
            "windows": self.windows,
            "held_out_windows": self.held_out_windows,
            "moved_by_hand": self.moved,
            "vehicle": {name: getattr(self.vehicle, name) for name in LIMITS},
            "fitted": list(self.fitted),
            "held_out": _medians(self.errors),
            "preset": _medians(self.preset_errors),
        }


def calibrate(
    logs: str | Path | Iterable[str | Path],
    *,
    vehicle: str | Path | Vehicle = "v5",
    track: str | Path | Track | None = None,
    held_out: float = 0.3,
    num_windows: int = 2000,
    iterations: int = 12,
) -> Calibration:
    """Fit a car to logs. Rotation and place do not matter, so no track is needed.

    Args:
        logs: Sim-traces, as for `replay`.
        vehicle: Where the fit starts, and what it is compared with.
        track: Logs of another track are refused.
        held_out: Share of the driving that only judges.
        num_windows: Windows to fit.
        iterations: Steps of the fit at most.

    Raises:
        RunError: The logs cannot be read, or hold too little driving.
        ConfigError: There is no log, or a setting is out of range.
        TrackError: There is no such track.
    """
    check_number("held_out", held_out, 0.05, 0.9)
    check_whole("num_windows", num_windows, MIN_WINDOWS)
    check_whole("iterations", iterations, 1)
    start = vehicle_of(vehicle)
    windows, moved = _load(log_files(logs), None if track is None else track_of(track))
    fit, judged = _split(windows, held_out, num_windows)
    car = _fit(start, fit, iterations)
    return Calibration(
        vehicle=car,
        preset=start,
        windows=len(fit),
        held_out_windows=len(judged),
        errors=reported_errors(judged, car),
        preset_errors=reported_errors(judged, start),
        fitted=tuple(SEARCHED),
        moved=moved,
    )


def _load(paths: Sequence[str | Path], track: Track | None) -> tuple[Windows, int]:
    """Windows, and how often somebody moved the car by hand."""
    read: list[Log] = []
    rows = 0
    for log in read_logs(paths, Faults()):
        if track is not None:
            require_length(track, log)
        read.append(log)
        rows += len(log)
        if rows >= MAX_ROWS:
            break
    windows = windows_of(read)
    if windows is None or len(windows) < 2 * MIN_WINDOWS:
        found = 0 if windows is None else len(windows)
        raise RunError(
            f"The logs hold {found} windows of 21 rows in a row; a fit needs {2 * MIN_WINDOWS} at least.",
            hint=f"Give more logs, or longer ones. {GIVE_APART}",
        )
    return windows, sum(int(log.is_moved.sum()) for log in read)


def _split(windows: Windows, held_out: float, num_windows: int) -> tuple[Windows, Windows]:
    """Windows to fit and windows to judge by, from different stretches of the log."""
    random = np.random.default_rng(0)
    # Whole stretches, so that windows of both kinds do not overlap; episodes are about as long.
    stretch = windows.first // 200
    names = np.unique(stretch)
    judges = random.permutation(names)[: max(1, round(held_out * len(names)))]
    is_judge = np.isin(stretch, judges)
    # A window that reaches into the next stretch is dropped if that one is of the other kind.
    crosses = np.isin((windows.first + 20) // 200, judges) != is_judge
    chosen = []
    for wanted, most in ((~is_judge & ~crosses, num_windows), (is_judge & ~crosses, 4 * num_windows)):
        numbers = random.permutation(np.flatnonzero(wanted))[:most]
        if len(numbers) < MIN_WINDOWS // 2:
            raise RunError("The logs are too short to hold some of them out.", hint="Give more logs, or longer ones.")
        chosen.append(windows.take(np.sort(numbers)))
    return chosen[0], chosen[1]


def _fit(start: Vehicle, windows: Windows, iterations: int) -> Vehicle:
    """Levenberg-Marquardt with derivatives by small differences, errors weighted so that outliers count less."""
    names = list(SEARCHED)
    low, high = np.array(list(SEARCHED.values())).T
    all_names = list(LIMITS)
    truth = windows.truth()[:, _STEPS]

    def residuals(unit: NDArray[np.float64]) -> NDArray[np.float64]:
        values = start.values()
        for name, value in zip(names, low + unit * (high - low), strict=True):
            values[all_names.index(name)] = float(value)
        rear = all_names.index("rear_friction")
        values[rear] = max(values[rear], _least_rear_friction(dict(zip(all_names, values, strict=True))))
        return _residuals(windows.drive_values(values)[:, _STEPS], truth)

    place = np.array([getattr(start, name) for name in names])
    unit = np.clip((place - low) / (high - low), 0.0, 1.0)
    now = residuals(unit)
    damping = 1e-2
    for _ in range(iterations):
        weight = 1.0 / np.sqrt(1.0 + (now**2).sum(axis=-1, keepdims=True))
        slopes = np.empty((len(names), now.size))
        for index in range(len(names)):
            nudge = _NUDGE if unit[index] + _NUDGE <= 1.0 else -_NUDGE
            beside = unit.copy()
            beside[index] += nudge
            slopes[index] = np.clip((residuals(beside) - now) / nudge, -300.0, 300.0).ravel()
        weighted = slopes * np.broadcast_to(weight, now.shape).ravel()
        normal, slope = weighted @ slopes.T, weighted @ now.ravel()
        free = ~(((unit <= 0.0) & (slope > 0.0)) | ((unit >= 1.0) & (slope < 0.0)))
        for _ in range(6):
            system = normal[np.ix_(free, free)]
            system = system + damping * np.diag(np.diag(system) + 1e-6 * np.trace(system))
            step = np.zeros(len(names))
            step[free] = -np.linalg.solve(system, slope[free])
            there = np.clip(unit + np.clip(step, -0.25, 0.25), 0.0, 1.0)
            then = residuals(there)
            gain = _cost(now) - _cost(then)
            if gain > 0.0:
                break
            damping *= 4.0
        else:
            break
        unit, now, damping = there, then, max(damping / 3.0, 1e-5)
        if gain < 1e-5:
            break
    fitted = {name: float(f"{value:.5g}") for name, value in zip(names, low + unit * (high - low), strict=True)}
    least = _least_rear_friction({**asdict(start), **fitted})
    fitted["rear_friction"] = float(f"{max(fitted['rear_friction'], least):.5g}")
    return replace(start, **fitted)


def _least_rear_friction(car: dict[str, float]) -> float:
    front = car["front_axle"] * car["front_load"] * car["front_friction"]
    least = _BALANCE * front / (car["rear_axle"] * (1.0 - car["front_load"]))
    return min(least, LIMITS["rear_friction"][1])


def _residuals(prediction: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Errors along x and y and in heading, over typical ones   (W, S, 3)."""
    turn = prediction[..., 2] - truth[..., 2]
    turn = np.arctan2(np.sin(turn), np.cos(turn))
    ahead = 0.14 * np.stack([np.cos(prediction[..., 2]) - np.cos(truth[..., 2])], axis=-1)
    aside = 0.14 * np.stack([np.sin(prediction[..., 2]) - np.sin(truth[..., 2])], axis=-1)
    dx = (prediction[..., :1] - truth[..., :1] + ahead) / _METRES[:, None]
    dy = (prediction[..., 1:2] - truth[..., 1:2] + aside) / _METRES[:, None]
    found = np.concatenate([dx, dy, turn[..., None] / _RADIANS[:, None]], axis=-1)
    return np.asarray(np.nan_to_num(found, nan=30.0, posinf=30.0, neginf=-30.0))


def _cost(residuals: NDArray[np.float64]) -> float:
    return float(np.mean(np.sqrt(1.0 + (residuals**2).sum(axis=-1))))


def _medians(errors: NDArray[np.float64]) -> dict[str, dict[str, float]]:
    middle = np.median(errors, axis=0)
    return {
        "position_error_m": {str(s): float(v) for s, v in zip(REPORTED_STEPS, middle[:, 0], strict=True)},
        "heading_error_deg": {str(s): float(v) for s, v in zip(REPORTED_STEPS, np.degrees(middle[:, 1]), strict=True)},
    }
