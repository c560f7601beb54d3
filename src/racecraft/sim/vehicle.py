"""The car's parameters, presets and files, for the native model (native/include/racecraft/vehicle.hpp)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Final

from racecraft.errors import ConfigError, did_you_mean
from racecraft.sim.checks import check_number

MAX_FILE_BYTES: Final = 100_000


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Parameters of the dynamic single-track model. Defaults are the ``v5`` preset.

    Fitted by eye to the behaviour of the original's logs: understeer 0.025 s²/m, effective wheelbase 0.25 m
    (four wheels turning at the same speed scrub, which acts like a longer car), 3.2 m/s² from rest.
    """

    mass: float = 7.5
    """kg; matters where forces, not accelerations, are given."""
    yaw_inertia: float = 0.10
    """kg m², about the vertical axis."""
    front_axle: float = 0.125
    """m from the car's origin to the effective front axle."""
    rear_axle: float = 0.125
    """m from the car's origin to the effective rear axle."""
    friction: float = 0.75
    """Tyre force limit over load; what a tyre gives along and across shares this circle."""
    front_stiffness: float = 3.2
    """Lateral force of the front tyres over load, per unit of slip; softer than the rear makes understeer."""
    rear_stiffness: float = 10.0
    """Lateral force of the rear tyres over load, per unit of slip."""
    slip_speed: float = 0.4
    """m/s below which slip is computed at this speed, so that a standing car feels no tyre force."""
    drive_acceleration: float = 3.2
    """m/s², what the motors give at most."""
    brake_acceleration: float = 6.5
    """m/s², positive, what the motors brake at most."""
    speed_time_constant: float = 0.2
    """s, of the speed controller near its command."""
    steering_time_constant: float = 0.15
    """s, of the steering servo."""
    steering_rate: float = 10.0
    """rad/s, limit of the steering servo."""
    steering_bias: float = 0.0
    """rad, added to every steering command."""
    speed_gain: float = 1.0
    """Speed reached over speed commanded, on a straight."""

    def __post_init__(self) -> None:
        for field in fields(self):
            check_number(f"Vehicle parameter {field.name}", getattr(self, field.name), *LIMITS[field.name])
        least = MIN_INERTIA_RATIO * self.mass * self.front_axle * self.rear_axle
        if self.yaw_inertia < least:
            raise ConfigError(
                f"Vehicle parameter yaw_inertia is {self.yaw_inertia!r}; a car of {self.mass:g} kg with these axles "
                f"needs at least {least:.3g} kg m²."
            )

    def values(self) -> list[float]:
        """The parameters in the native core's order."""
        return [float(getattr(self, field.name)) for field in fields(self)]

    def save(self, path: str | Path) -> None:
        """Write a vehicle file that `load_vehicle` reads."""
        Path(path).write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")


LIMITS: Final[dict[str, tuple[float, float]]] = {
    "mass": (0.1, 1000.0),
    "yaw_inertia": (0.0001, 10000.0),
    "front_axle": (0.05, 2.0),
    "rear_axle": (0.05, 2.0),
    "friction": (0.05, 3.0),
    "front_stiffness": (0.5, 20.0),
    "rear_stiffness": (0.5, 20.0),
    "slip_speed": (0.3, 5.0),
    "drive_acceleration": (0.1, 30.0),
    "brake_acceleration": (0.1, 30.0),
    "speed_time_constant": (0.03, 10.0),
    "steering_time_constant": (0.02, 10.0),
    "steering_rate": (0.1, 100.0),
    "steering_bias": (-0.3, 0.3),
    "speed_gain": (0.1, 1.5),
}
"""Allowed range of every parameter; native/tests/vehicle_test.cpp drives a car at every corner of it."""

MIN_INERTIA_RATIO: Final = 0.25
"""Least yaw_inertia over mass x front_axle x rear_axle: below it the car turns faster than the substeps can follow."""

PRESETS: Final[dict[str, Vehicle]] = {
    "v4": Vehicle(
        front_stiffness=5.0,
        steering_time_constant=0.5,
        speed_time_constant=0.25,
        speed_gain=0.98,
        drive_acceleration=6.0,
    ),
    "v5": Vehicle(),
    "v6": Vehicle(
        front_stiffness=6.0,
        steering_time_constant=0.2,
        speed_time_constant=0.07,
        drive_acceleration=7.0,
        brake_acceleration=7.0,
        speed_gain=0.97,
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
    path = Path(name_or_path)
    if not path.is_file():
        raise ConfigError(
            f"Vehicle {name!r} is neither a preset ({', '.join(PRESETS)}) nor a file.",
            hint=did_you_mean(name, PRESETS),
        )
    if path.stat().st_size > MAX_FILE_BYTES:
        raise ConfigError(f"Vehicle file {name!r} has more than {MAX_FILE_BYTES} bytes; it should hold a few numbers.")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"Vehicle file {name!r} is not JSON: {error}.") from error
    if not isinstance(data, dict):
        raise ConfigError(f"Vehicle file {name!r} must hold one JSON object, not {type(data).__name__}.")
    for key in data:
        if key not in LIMITS:
            raise ConfigError(
                f"Vehicle file {name!r} has an unknown parameter {key!r}. {did_you_mean(key, LIMITS)}".strip()
            )
    return Vehicle(**data)
