"""Domain randomisation: every episode of every car in its own light, on its own tyres, behind its own camera.

Each quantity is a range, drawn from evenly by the native core (native/include/racecraft/randomization.hpp). A policy
that learned under many conditions does not rely on any of them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from racecraft.checks import check_choice, check_number, check_type, require
from racecraft.errors import ConfigError, did_you_mean
from racecraft.json_file import write_json_object
from racecraft.sim.camera import CameraSpec
from racecraft.sim.parameter_file import read_parameters
from racecraft.sim.vehicle import Vehicle

Range = tuple[float, float]
"""Least and greatest value."""


@dataclass(frozen=True, kw_only=True)
class Randomization:
    """Ranges from which each episode of a car draws its conditions, evenly and each quantity by itself.

    The defaults change nothing. A range of one point is a constant change: ``Randomization(friction=(0.8, 0.8))``.
    """

    friction: Range = (1.0, 1.0)
    """Factor on the friction of all tyres."""
    mass: Range = (1.0, 1.0)
    """Factor on mass and inertia; motors and brakes stay as strong as they are."""
    speed_gain: Range = (1.0, 1.0)
    """Factor on the speed reached: a full battery or an empty one."""
    steering_bias: Range = (0.0, 0.0)
    """rad, added to the vehicle's own."""
    latency: Range = (0.0, 0.0)
    """Control steps (1/15 s) before a command acts, 0 to 2; until then the ones before do."""
    camera_pitch: Range = (0.0, 0.0)
    """rad, further down."""
    camera_yaw: Range = (0.0, 0.0)
    """rad, to the left."""
    camera_height: Range = (0.0, 0.0)
    """m, higher."""
    camera_left: Range = (0.0, 0.0)
    """m, to the left."""
    camera_forward: Range = (0.0, 0.0)
    """m, ahead."""
    camera_fov: Range = (0.0, 0.0)
    """rad, wider horizontal field of view."""
    light: Range = (1.0, 1.0)
    """Factor on every brightness."""
    black_level: Range = (0.0, 0.0)
    """Added to every brightness, as a fraction of white."""
    gradient_across: Range = (0.0, 0.0)
    """Change of the light from the middle of the picture to its right edge, as a fraction."""
    gradient_down: Range = (0.0, 0.0)
    """Change of the light from the middle of the picture to its lower edge, as a fraction."""
    blur: Range = (0.0, 0.0)
    """Pixels, standard deviation."""
    pale_dashes: Range = (0.0, 0.0)
    """Share of the edge lines' colour in the dashes."""
    pale_walls: Range = (0.0, 0.0)
    """Share of white in the walls."""
    wall_height: Range = (0.0, 0.0)
    """m, higher walls; lower ones show more of the hall."""
    crowd: Range = (0.0, 0.0)
    """Contrast of what stands behind the walls and hangs on them, people and banners, 1 is all there is."""
    sheen: Range = (0.0, 0.0)
    """A lamp's reflection in the floor at its brightest, as a fraction of white."""
    folds: Range = (0.0, 0.0)
    """Light on one side of a fold in the floor and shade on the other, as a fraction of white."""
    vignette: Range = (0.0, 0.0)
    """Light lost half a picture away from the lens's middle, across or down, as a fraction."""
    vignette_across: Range = (0.0, 0.0)
    """Where that middle is: to the right, in halves of the picture."""
    vignette_down: Range = (0.0, 0.0)
    """Where that middle is: down, in halves of the picture."""
    defocus: Range = (0.0, 0.0)
    """Pixels that lie over each other: from 1 on two rows and two columns do."""
    shutter: Range = (0.0, 0.0)
    """Seconds that a picture takes, in which a car that turns smears it."""
    shake: Range = (0.0, 0.0)
    """rad, standard deviation of where the lens looks from picture to picture."""
    noise: Range = (0.0, 0.0)
    """Standard deviation of every pixel, as a fraction of white."""
    strength: Range = (1.0, 1.0)
    """Share of all this that an episode has, 0 none to 1 all. What is drawn beyond counts as the end: ``(-1.0, 3.0)``
    leaves a quarter of the episodes as they are and a half as strong as can be."""
    tint: Range = (1.0, 1.0)
    """Factor on the light's red, green and blue, drawn for each; grey weighs them afterwards."""
    colour: Range = (0.0, 0.0)
    """Added to the brightness of road, lines, field, walls and sky, drawn for each, as a fraction of white."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            is_pair = isinstance(value, list | tuple) and len(value) == 2
            require(f"Randomization {field.name}", value, is_pair, "two numbers, least and most")
            low, high = value
            for number in (low, high):
                check_number(f"Randomization {field.name}", number, *LIMITS[field.name])
            if low > high:
                raise ConfigError(
                    f"Randomization {field.name} is {value!r}; the first number is greater than the second."
                )
            object.__setattr__(self, field.name, (float(low), float(high)))

    @property
    def is_off(self) -> bool:
        """Whether nothing is changed."""
        return self == PRESETS["none"]

    @property
    def changes_car(self) -> bool:
        """Whether the car drives otherwise than its parameters say, be it slower: not only what it sees differs."""
        plain = PRESETS["none"]
        return any(getattr(self, name) != getattr(plain, name) for name in OF_CAR)

    def of_lenses(self) -> list[str]:
        """The quantities in use that only the CPU's cameras show: those of a real lens in a real hall."""
        first, last = CONDITIONS.index("crowd"), CONDITIONS.index("noise")
        return [name for name in CONDITIONS[first : last + 1] if getattr(self, name) != (0.0, 0.0)]

    def check(self, vehicle: Vehicle, camera: CameraSpec | None) -> None:
        """Refuse ranges that would make a car or a camera that cannot be.

        Raises:
            ConfigError: An end of a range leads outside the limits of a vehicle's or a camera's parameters.
        """
        try:
            for friction, mass, gain, bias in zip(
                self.friction, self.mass, self.speed_gain, self.steering_bias, strict=True
            ):
                replace(
                    vehicle,
                    front_friction=vehicle.front_friction * friction,
                    rear_friction=vehicle.rear_friction * friction,
                    mass=vehicle.mass * mass,
                    yaw_inertia=vehicle.yaw_inertia * mass,
                    drive_acceleration=vehicle.drive_acceleration / mass,
                    brake_acceleration=vehicle.brake_acceleration / mass,
                    speed_gain=vehicle.speed_gain * gain,
                    steering_bias=vehicle.steering_bias + bias,
                )
            for index in (0, 1) if camera is not None else ():
                assert camera is not None
                replace(
                    camera,
                    pitch=camera.pitch + self.camera_pitch[index],
                    above_ground=camera.above_ground + self.camera_height[index],
                    left=camera.left + self.camera_left[index],
                    forward=camera.forward + self.camera_forward[index],
                    horizontal_fov=camera.horizontal_fov + self.camera_fov[index],
                )
        except ConfigError as error:
            raise ConfigError(f"At an end of the randomization's ranges: {error}", hint=error.hint) from error

    def values(self) -> list[float]:
        """The ranges in the native core's order."""
        return [end for field in fields(self) for end in getattr(self, field.name)]

    def save(self, path: str | Path) -> None:
        """Write a file that `load_randomization` reads.

        Raises:
            ConfigError: It cannot be written.
        """
        write_json_object(path, asdict(self))


LIMITS: Final[dict[str, Range]] = {
    "friction": (0.1, 3.0),
    "mass": (0.2, 5.0),
    "speed_gain": (0.2, 1.5),
    "steering_bias": (-0.3, 0.3),
    "latency": (0.0, 2.0),
    "camera_pitch": (-0.5, 0.5),
    "camera_yaw": (-0.5, 0.5),
    "camera_height": (-0.1, 0.5),
    "camera_left": (-0.3, 0.3),
    "camera_forward": (-0.3, 0.3),
    "camera_fov": (-0.8, 1.2),
    "light": (0.0, 4.0),
    "black_level": (-0.5, 0.5),
    "gradient_across": (-0.9, 0.9),
    "gradient_down": (-0.9, 0.9),
    "blur": (0.0, 4.0),
    "pale_dashes": (0.0, 1.0),
    "pale_walls": (0.0, 1.0),
    "wall_height": (-0.9, 2.0),
    "crowd": (0.0, 1.0),
    "sheen": (0.0, 1.0),
    "folds": (0.0, 0.5),
    "vignette": (0.0, 0.5),
    "vignette_across": (-1.0, 1.0),
    "vignette_down": (-1.0, 1.0),
    "defocus": (0.0, 3.0),
    "shutter": (0.0, 0.07),
    "shake": (0.0, 0.1),
    "noise": (0.0, 0.2),
    "strength": (-10.0, 10.0),
    "tint": (0.0, 4.0),
    "colour": (-0.5, 0.5),
}
"""Allowed range of every quantity."""

OF_CAR: Final = ("friction", "mass", "speed_gain", "steering_bias", "latency")
"""Quantities of how the car drives; the others are of what it sees."""

PRESETS: Final[dict[str, Randomization]] = {
    "none": Randomization(),
    "light": Randomization(
        friction=(0.85, 1.1),
        mass=(0.95, 1.05),
        speed_gain=(0.95, 1.05),
        steering_bias=(-0.02, 0.02),
        latency=(0.0, 0.5),
        camera_pitch=(-0.02, 0.02),
        camera_yaw=(-0.02, 0.02),
        camera_height=(-0.005, 0.005),
        camera_left=(-0.005, 0.005),
        camera_forward=(-0.01, 0.01),
        camera_fov=(-0.02, 0.02),
        light=(0.8, 1.2),
        black_level=(-0.03, 0.03),
        gradient_across=(-0.1, 0.1),
        gradient_down=(-0.1, 0.1),
        blur=(0.0, 0.5),
        tint=(0.9, 1.1),
        colour=(-0.05, 0.05),
    ),
    "strong": Randomization(
        friction=(0.6, 1.3),
        mass=(0.8, 1.3),
        speed_gain=(0.85, 1.15),
        steering_bias=(-0.06, 0.06),
        latency=(0.0, 1.0),
        camera_pitch=(-0.07, 0.07),
        camera_yaw=(-0.05, 0.05),
        camera_height=(-0.02, 0.02),
        camera_left=(-0.02, 0.02),
        camera_forward=(-0.03, 0.03),
        camera_fov=(-0.08, 0.08),
        light=(0.5, 1.5),
        black_level=(-0.08, 0.08),
        gradient_across=(-0.4, 0.4),
        gradient_down=(-0.4, 0.4),
        blur=(0.0, 1.0),
        tint=(0.5, 1.5),
        colour=(-0.12, 0.12),
    ),
    "aws": Randomization(light=(0.8, 1.0), tint=(0.5, 1.0)),
    "real": Randomization(
        friction=(0.7, 1.2),
        mass=(0.9, 1.2),
        speed_gain=(0.85, 1.1),
        steering_bias=(-0.06, 0.06),
        latency=(0.0, 1.0),
        camera_pitch=(-0.06, 0.06),
        camera_yaw=(-0.04, 0.04),
        camera_height=(-0.015, 0.015),
        camera_left=(-0.015, 0.015),
        camera_forward=(-0.02, 0.02),
        camera_fov=(-0.08, 0.08),
        light=(0.6, 2.1),
        black_level=(-0.05, 0.12),
        tint=(0.8, 1.2),
        colour=(-0.1, 0.1),
        pale_dashes=(0.0, 1.0),
        pale_walls=(0.0, 0.7),
        wall_height=(-0.65, 0.0),
        crowd=(0.0, 1.0),
        sheen=(0.0, 0.45),
        folds=(0.0, 0.12),
        vignette=(0.0, 0.3),
        vignette_across=(-0.5, 0.5),
        vignette_down=(-0.5, 0.5),
        defocus=(0.0, 1.4),
        shutter=(0.0, 0.02),
        shake=(0.0, 0.012),
        noise=(0.0, 0.02),
    ),
}
"""``real`` is what pictures of a car on a floor show and the simulator's own do not. ``aws`` is what the original's
ENABLE_DOMAIN_RANDOMIZATION does to the driver's picture: each lamp takes a random colour while half of the light, the
ambient part, stays as it is."""


def load_randomization(name_or_path: str | Path) -> Randomization:
    """A preset by name, or a JSON file of ranges.

    A file holds one object, such as ``{"preset": "light", "friction": [0.7, 1.2]}``: what it does not name is as in
    its preset, and without one does not change.

    Raises:
        ConfigError: No such preset or file, an unknown quantity, or a range that is not allowed.
    """
    check_type("randomize", name_or_path, (str, Path), "use a preset's name, a file or racecraft.Randomization(...)")
    name = str(name_or_path)
    if name in PRESETS:
        return PRESETS[name]
    data = read_parameters(name, kind="Randomization", presets=PRESETS)
    preset = data.pop("preset", "none")
    check_choice(f"The preset of randomization file {name!r}", preset, PRESETS)
    for key in data:
        if key not in LIMITS:
            raise ConfigError(f"Randomization file {name!r} has an unknown quantity {key!r}.", hint=_hint(key))
    return replace(PRESETS[preset], **data)


def _hint(key: Any) -> str:
    return did_you_mean(str(key), LIMITS) or f"Known are {', '.join(LIMITS)}."


CONDITIONS: Final = tuple(field.name for field in fields(Randomization))[:-2]
"""Names of what an episode has one value of, in the order of `Simulation.conditions`."""
