"""What a car may see: AWS's sensor names, the rules for combining them, and the shape of each observation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from racecraft.checks import check_choice, check_number, check_whole, require
from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.sim.camera import CameraSpec

FRAME_HEIGHT = 120  # pixels
FRAME_WIDTH = 160  # pixels
LIDAR_RAYS = 64
CLIPPING_LIMITS = (0.15, 12.0)  # m: above the first, to the second
STEREO_BASELINE = 0.06  # m between the lenses of the stereo pair; LEFT_CAMERA is its left one

CAMERAS = ("FRONT_FACING_CAMERA", "observation", "LEFT_CAMERA", "STEREO_CAMERAS")
LIDARS = ("LIDAR", "SECTOR_LIDAR", "DISCRETIZED_SECTOR_LIDAR")
SENSOR_NAMES = CAMERAS + LIDARS
"""Every sensor of the original; ``observation`` is what the front camera was called before 2019."""


@dataclass(frozen=True)
class LidarConfig:
    """How ``DISCRETIZED_SECTOR_LIDAR`` turns 64 rays into bits.

    Raises:
        ConfigError: A number is outside what AWS's files may say.
    """

    num_sectors: int = 8
    """Sectors over the whole 300°; divides 64."""
    num_values_per_sector: int = 8
    """Distance bins of a sector, one bit each; up to 64."""
    clipping_dist: float = 2.0
    """Metres beyond which a sector counts as free, above 0.15, to 12."""

    def __post_init__(self) -> None:
        for name in ("num_sectors", "num_values_per_sector"):
            check_whole(f"LidarConfig {name}", getattr(self, name), 1, LIDAR_RAYS, is_plain=True)
        is_divisor = LIDAR_RAYS % self.num_sectors == 0
        require("LidarConfig num_sectors", self.num_sectors, is_divisor, f"a divisor of {LIDAR_RAYS}")
        low, high = CLIPPING_LIMITS
        check_number("LidarConfig clipping_dist", self.clipping_dist, low, high, is_plain=True)
        allowed = f"a number above {low:g}, to {high:g}"
        require("LidarConfig clipping_dist", self.clipping_dist, self.clipping_dist > low, allowed)


def check_sensors(names: Sequence[str]) -> tuple[str, ...]:
    """The names as a tuple, when they are known and go together: exactly one camera, at most one LIDAR.

    Raises:
        ConfigError: Says which rule is broken by which name.
    """
    for name in names:
        check_choice("sensor", name, SENSOR_NAMES)
    cameras = [name for name in names if name in CAMERAS]
    lidars = [name for name in names if name in LIDARS]
    if len(cameras) != 1:
        raise ConfigError(
            f"sensor has {len(cameras)} cameras {cameras}; allowed is exactly one of {', '.join(CAMERAS)}."
        )
    if len(lidars) > 1:
        raise ConfigError(f"sensor has {len(lidars)} LIDARs {lidars}; allowed is at most one of {', '.join(LIDARS)}.")
    return tuple(names)


def camera_of(names: Sequence[str], *, camera: CameraSpec | None = None) -> CameraSpec:
    """The simulator's camera for the sensors of a car.

    Args:
        names: Sensors; one of them is a camera.
        camera: Its size and look; AWS's by default.
    """
    from racecraft.sim.camera import CameraSpec

    camera = camera or CameraSpec()
    (name,) = (name for name in check_sensors(names) if name in CAMERAS)
    if name == "STEREO_CAMERAS":
        return replace(camera, baseline=STEREO_BASELINE)
    return replace(camera, left=camera.left + 0.5 * STEREO_BASELINE) if name == "LEFT_CAMERA" else camera


def observation_shape(name: str, *, lidar: LidarConfig | None = None) -> tuple[int, ...]:
    """Shape of one observation of a sensor as AWS's networks take it: (height, width, channels) or (values,).

    Args:
        name: One of ``SENSOR_NAMES``.
        lidar: Sizes of ``DISCRETIZED_SECTOR_LIDAR``; the default configuration when not given.
    """
    lidar = lidar or LidarConfig()
    shapes: dict[str, tuple[int, ...]] = {
        "STEREO_CAMERAS": (FRAME_HEIGHT, FRAME_WIDTH, 2),
        "LIDAR": (LIDAR_RAYS,),
        "SECTOR_LIDAR": (8,),
        "DISCRETIZED_SECTOR_LIDAR": (lidar.num_sectors * lidar.num_values_per_sector,),
    }
    check_choice("sensor", name, SENSOR_NAMES)
    return shapes.get(name, (FRAME_HEIGHT, FRAME_WIDTH, 1))
