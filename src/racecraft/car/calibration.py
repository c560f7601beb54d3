"""What was measured on one car, in a small file: how far its wheels turn, how fast it drives, how late it answers.

turning circles, speeds at positions of the slider, pulse widths -> *calibrate* -> my-car.json -> *load_calibration*
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np

from racecraft.agent.action_space import MAX_SPEED, MAX_STEERING, MIN_SPEED, ActionSpace
from racecraft.car.command import Floats, largest, steering_share, throttle
from racecraft.checks import check_number, check_type, require
from racecraft.errors import ConfigError, did_you_mean
from racecraft.json_file import write_json_object
from racecraft.sim.parameter_file import read_parameters

NOMINAL: Final = "car"
"""Name of a car of which nothing was measured."""
WHEELBASE: Final = 0.164  # m, of the original's description of the car
SERVO_REACH: Final = (
    0.25  # ms of pulse width from the middle to full lock, by the car's defaults of 1.20, 1.45 and 1.70
)
MIN_LOCK: Final = 3.0  # degrees
MAX_LATENCY: Final = 0.133  # s, two of the simulator's steps
MAX_POINTS: Final = 20
_LIMITS: Final = {
    "left_degrees": (MIN_LOCK, MAX_STEERING),
    "right_degrees": (MIN_LOCK, MAX_STEERING),
    "latency_seconds": (0.0, MAX_LATENCY),
}


@dataclass(frozen=True, kw_only=True)
class CarCalibration:
    """One car. The defaults are a car of which nothing was measured: as far and as fast as the model was trained to."""

    left_degrees: float = MAX_STEERING
    """The wheels' angle at full lock to the left; the simulator's wheels turn 30° at most."""
    right_degrees: float = MAX_STEERING
    """The same to the right."""
    speeds: tuple[tuple[float, float], ...] = ()
    """Positions of the slider in percent and the speed in m/s that full throttle drives there, both rising; between two
    of them the speed runs straight, below the first from 0, above the last on in proportion."""
    slider_percent: float | None = None
    """Where the slider stands; None: where the largest speed of the model is driven, or at 100."""
    latency_seconds: float = 0.0
    """From the picture to the command's effect beyond what the simulator's car has, 0 to 0.133."""

    def __post_init__(self) -> None:
        for name, limits in _LIMITS.items():
            check_number(name, getattr(self, name), *limits)
        if self.slider_percent is not None:
            check_number("slider_percent", self.slider_percent, 1.0, 100.0)
        object.__setattr__(self, "speeds", _points(self.speeds))

    def slider(self, space: ActionSpace) -> float:
        """Where the slider stands for a model, as a share.

        Where no speed was measured and no position is given it is said to stand right: 1.
        """
        if self.slider_percent is not None:
            return self.slider_percent / 100
        fastest = largest(space)[1]
        positions, speeds = _curve(self.speeds)
        if not self.speeds or fastest >= speeds[-1] * 100 / positions[-1]:
            return 1.0
        if fastest > speeds[-1]:
            return float(fastest / speeds[-1] * positions[-1] / 100)
        return float(np.interp(fastest, speeds, positions) / 100)

    def speed(self, share: Floats, fastest: float) -> Floats:
        """m/s at shares of the throttle, the slider's included.

        Args:
            share: 0 to 1  (N,).
            fastest: m/s at full throttle where nothing was measured.
        """
        if not self.speeds:
            return share * fastest
        positions, speeds = _curve(self.speeds)
        percent = 100 * share
        beyond = speeds[-1] * percent / positions[-1]
        return np.where(percent > positions[-1], beyond, np.interp(percent, positions, speeds))

    def fastest(self, space: ActionSpace) -> float:
        """M/s that full throttle drives with a model, be it more than the simulator's car can."""
        return float(self.speed(np.array([self.slider(space)]), largest(space)[1])[0])

    def commands(self, chosen: Floats, space: ActionSpace) -> Floats:
        """What the wheels and the motor do for choices of a model, as far as the simulator's car can: 0.1 to 4 m/s.

        Args:
            chosen: Angles in rad and speeds in m/s as the metadata lists them  (N, 2).
            space: The model's action space.

        Returns:
            Angles of the wheels in rad, left positive, and speeds in m/s  (N, 2).
        """
        share = steering_share(chosen[:, 0], space)
        angles = share * np.radians(np.where(share > 0, self.left_degrees, self.right_degrees))
        speeds = self.speed(self.slider(space) * throttle(chosen[:, 1], space), largest(space)[1])
        return np.column_stack([angles, speeds.clip(MIN_SPEED, MAX_SPEED)])

    def save(self, path: str | Path) -> None:
        """Write a file that `load_calibration` reads.

        Raises:
            ConfigError: It cannot be written.
        """
        write_json_object(path, asdict(self))


def load_calibration(name_or_path: str | Path) -> CarCalibration:
    """A car's file, or ``car`` for one of which nothing was measured.

    Raises:
        ConfigError: No such file, or a value outside its range.
    """
    check_type("car", name_or_path, (str, PathLike), f"use {NOMINAL!r} or a file's path")
    if str(name_or_path) == NOMINAL:
        return CarCalibration()
    data = read_parameters(name_or_path, kind="Car", presets=[NOMINAL])
    known = [field.name for field in fields(CarCalibration)]
    for key in data:
        if key not in known:
            raise ConfigError(
                f"Car file {str(name_or_path)!r} has an unknown parameter {key!r}.", hint=did_you_mean(key, known)
            )
    return CarCalibration(**data)


def calibrate(
    *,
    circles: tuple[float | None, float | None] = (None, None),
    servo: Sequence[float] | None = None,
    speeds: Sequence[tuple[float, float]] = (),
    slider: float | None = None,
    latency: float = 0.0,
) -> CarCalibration:
    """A car from a few measured numbers.

    Args:
        circles: Diameters in m of the slow circles at full lock, to the left and to the right, that the middle between
            the rear wheels drives; None where it was not measured.
        servo: Pulse widths in ms of full left, straight and full right, as the car's page has them. Where no circle
            was measured the lock follows from them: 30° for the 0.25 ms of the car's defaults.
        speeds: Positions of the slider in percent, and the speed in m/s driven there at full throttle.
        slider: Where it stands, percent.
        latency: s.

    Raises:
        ConfigError: A number is outside its range, or nothing was measured.
    """
    if circles == (None, None) and servo is None and not speeds and slider is None and not latency:
        raise ConfigError(
            "Nothing was measured.", hint="Give --circle-left, --circle-right, --servo, --speed, --slider or --latency."
        )
    is_pair = isinstance(circles, list | tuple) and len(circles) == 2
    require("circles", circles, is_pair, "two diameters in m, to the left and to the right, None for one not measured")
    reach: tuple[float, float] = (SERVO_REACH, SERVO_REACH)
    if servo is not None:
        reach = _reach(servo)
    locks = []
    for side, circle, width in zip(("left", "right"), circles, reach, strict=True):
        if circle is None:
            degrees, what = MAX_STEERING * width / SERVO_REACH, f"The servo's pulse of {width:g} ms to the {side}"
        else:
            check_number(f"circle-{side}", circle, 0.1, 50.0)
            degrees = math.degrees(math.atan(WHEELBASE / (circle / 2)))
            what = f"A circle of {circle:g} m to the {side}"
        degrees = round(degrees, 3)
        if not MIN_LOCK <= degrees <= MAX_STEERING:
            raise ConfigError(f"{what} means wheels at {degrees:g}°; allowed is {MIN_LOCK:g}° to {MAX_STEERING:g}°.")
        locks.append(degrees)
    return CarCalibration(
        left_degrees=locks[0],
        right_degrees=locks[1],
        speeds=tuple(sorted(_points(speeds, is_sorted=False))),
        slider_percent=slider,
        latency_seconds=latency,
    )


def _reach(servo: Sequence[float]) -> tuple[float, float]:
    """From straight to either lock, ms."""
    allowed = "three pulse widths of 0.5 to 2.5 ms: full left, straight, full right, straight between the others"
    require("servo", servo, isinstance(servo, list | tuple) and len(servo) == 3, allowed)
    for width in servo:
        check_number("servo", width, 0.5, 2.5)
    left, middle, right = servo
    require("servo", list(servo), min(left, right) < middle < max(left, right), allowed)
    return abs(left - middle), abs(right - middle)


def _points(given: Any, *, is_sorted: bool = True) -> tuple[tuple[float, float], ...]:
    """Speeds, checked: a file may hold anything; who measures may do so in any order."""
    allowed = f"at most {MAX_POINTS} pairs of slider in percent and speed in m/s, both rising"
    is_list = isinstance(given, list | tuple) and len(given) <= MAX_POINTS
    require(
        "speeds", given, is_list and all(isinstance(pair, list | tuple) and len(pair) == 2 for pair in given), allowed
    )
    for position, speed in given:
        check_number("speeds: slider", position, 1.0, 100.0)
        check_number("speeds: speed", speed, 0.05, 10.0)
    points = tuple((float(position), float(speed)) for position, speed in given)
    rising = not is_sorted or all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(points))
    require("speeds", list(points), rising, allowed)
    return points


def _curve(points: tuple[tuple[float, float], ...]) -> tuple[Floats, Floats]:
    """Positions in percent and speeds, from standing on  (P + 1,) each."""
    positions, speeds = np.array([(0.0, 0.0), *points]).T
    return positions, speeds
