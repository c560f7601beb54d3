"""The car's parameters, presets and files, for the native model (native/include/racecraft/vehicle.hpp)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Final

from racecraft.checks import check_number, make_plain
from racecraft.errors import ConfigError, did_you_mean
from racecraft.json_file import write_json_object
from racecraft.sim.parameter_file import read_parameters


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Parameters of the four-wheel model. Defaults are the ``v5`` preset.

    Presets are fitted to logs that the original wrote (``docs/fidelity.md`` has the errors on runs that the fit never
    saw; ``racecraft calibrate`` fits to yours). A value is that of a model, not of a ruler: what the wheels' hinges or
    the tyres' contact do in the original shows up in the nearest parameter here.
    """

    mass: float = 7.5
    """kg; matters where forces, not accelerations, are given."""
    yaw_inertia: float = 0.116
    """kg m², about the vertical axis."""
    front_axle: float = 0.117
    """m from the car's origin to the effective front axle."""
    rear_axle: float = 0.0767
    """m from the car's origin to the effective rear axle."""
    half_track: float = 0.08
    """m from the middle of an axle to its wheels; all four turn equally fast, and their scrub in a bend understeers."""
    front_load: float = 0.387
    """Share of the weight on the front axle."""
    front_friction: float = 0.32
    """Limit of the front tyres' lateral force over their load."""
    rear_friction: float = 0.494
    """Limit of the rear tyres' lateral force over their load."""
    front_stiffness: float = 7.92
    """Lateral force of the front tyres over their load, per unit of slip."""
    rear_stiffness: float = 12.0
    """Lateral force of the rear tyres over their load, per unit of slip."""
    slip_speed: float = 0.5
    """m/s below which slip is computed at this speed, so that a standing car feels no tyre force."""
    drive_acceleration: float = 3.39
    """m/s², what the motors give at most; beyond 3 times what the tyres hold across, that is the limit."""
    brake_acceleration: float = 4.05
    """m/s², positive, what the motors brake at most."""
    speed_time_constant: float = 0.123
    """s, of the speed near its command."""
    steering_time_constant: float = 0.02
    """s, of the steering servo."""
    steering_rate: float = 40.0
    """rad/s, limit of the steering servo."""
    steering_bias: float = 0.0252
    """rad, added to every steering command; the original pulls a little to the left."""
    speed_gain: float = 1.041
    """Speed reached over speed commanded, on a straight; the original's wheels are larger than its arithmetic."""

    def __post_init__(self) -> None:
        for field in fields(self):
            check_number(f"Vehicle parameter {field.name}", getattr(self, field.name), *LIMITS[field.name])
        make_plain(self)
        axle = max(self.front_axle, self.rear_axle)
        least = MIN_INERTIA_RATIO * self.mass * (axle**2 + self.half_track**2 + LEAST_REACH**2)
        if self.yaw_inertia < least:
            raise ConfigError(
                f"Vehicle parameter yaw_inertia is {self.yaw_inertia!r}; a car of {self.mass:g} kg with these axles "
                f"needs at least {least:.3g} kg m²."
            )

    def values(self) -> list[float]:
        """The parameters in the native core's order."""
        return [float(getattr(self, field.name)) for field in fields(self)]

    def save(self, path: str | Path) -> None:
        """Write a vehicle file that `load_vehicle` reads.

        Raises:
            ConfigError: It cannot be written.
        """
        write_json_object(path, asdict(self))


LIMITS: Final[dict[str, tuple[float, float]]] = {
    "mass": (0.1, 1000.0),
    "yaw_inertia": (0.0001, 10000.0),
    "front_axle": (0.02, 2.0),
    "rear_axle": (0.02, 2.0),
    "half_track": (0.0, 1.0),
    "front_load": (0.1, 0.9),
    "front_friction": (0.05, 3.0),
    "rear_friction": (0.05, 3.0),
    "front_stiffness": (0.5, 20.0),
    "rear_stiffness": (0.5, 20.0),
    "slip_speed": (0.3, 5.0),
    "drive_acceleration": (0.1, 30.0),
    "brake_acceleration": (0.1, 30.0),
    "speed_time_constant": (0.025, 10.0),
    "steering_time_constant": (0.015, 10.0),
    "steering_rate": (0.1, 100.0),
    "steering_bias": (-0.3, 0.3),
    "speed_gain": (0.1, 1.5),
}
"""Allowed range of every parameter; native/tests/vehicle_test.cpp drives a car at the corners of it."""

MIN_INERTIA_RATIO: Final = 0.25
LEAST_REACH: Final = 0.1  # m
"""Least yaw_inertia is MIN_INERTIA_RATIO x mass x (longer axle² + half_track² + LEAST_REACH²): below it the car turns
faster than the substeps can follow."""

PRESETS: Final[dict[str, Vehicle]] = {
    "v4": Vehicle(
        yaw_inertia=0.307,
        front_axle=0.084,
        rear_axle=0.0314,
        front_load=0.237,
        front_friction=1.67,
        rear_friction=2.0,
        front_stiffness=2.3,
        drive_acceleration=4.01,
        brake_acceleration=4.82,
        speed_time_constant=0.1433,
        steering_time_constant=0.0246,
        steering_bias=0.029,
        speed_gain=1.102,
    ),
    "v5": Vehicle(),
    "v6": Vehicle(
        yaw_inertia=0.1,
        front_axle=0.0823,
        rear_axle=0.0817,
        front_load=0.4035,
        front_friction=0.643,
        rear_friction=0.406,
        front_stiffness=13.66,
        drive_acceleration=5.78,
        brake_acceleration=9.36,
        speed_time_constant=0.0346,
        steering_time_constant=0.152,
        steering_bias=0.0012,
        speed_gain=1.035,
    ),
}
"""The original's generations of physics, by ``version`` of model_metadata.json."""


def load_vehicle(name_or_path: str | Path) -> Vehicle:
    """A preset by name, or a vehicle file.

    Raises:
        ConfigError: No such preset or file, or a parameter outside its range.
    """
    name = str(name_or_path)
    if name in PRESETS:
        return PRESETS[name]
    data = read_parameters(name, kind="Vehicle", presets=PRESETS)
    for key in data:
        if key not in LIMITS:
            raise ConfigError(
                f"Vehicle file {name!r} has an unknown parameter {key!r}. {did_you_mean(key, LIMITS)}".strip()
            )
    return Vehicle(**data)
