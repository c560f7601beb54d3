"""A car's sensors together: which camera and LIDAR a simulation needs for them, and what they tell a network.

simulation.frames, simulation.lidar -> *SensorSuite.read* -> bytes for `racecraft.learn`'s `encode`
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.lidar import observe_lidar
from racecraft.agent.sensors import CAMERAS, LIDARS, LidarConfig, camera_of, check_sensors, observation_shape
from racecraft.checks import check_type
from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.sim.camera import CameraSpec


class SensedCars(Protocol):
    """What is read of a `racecraft.sim.Simulation`."""

    camera: CameraSpec | None
    frames: NDArray[np.uint8]
    lidar: NDArray[np.float32]
    num_envs: int


@dataclass(frozen=True)
class SensorSuite:
    """One camera, and a LIDAR or none, by AWS's names.

    Raises:
        ConfigError: The names do not go together.
    """

    names: tuple[str, ...] = ("FRONT_FACING_CAMERA",)
    """Exactly one camera, at most one LIDAR."""
    lidar: LidarConfig | None = None
    """Sizes of ``DISCRETIZED_SECTOR_LIDAR``; the default ones when None."""

    def __post_init__(self) -> None:
        check_type("names", self.names, (list, tuple), "use a list of AWS's sensor names")
        check_type("lidar", self.lidar, (LidarConfig, type(None)), "use a racecraft.agent.LidarConfig, or None")
        object.__setattr__(self, "names", check_sensors(self.names))

    @property
    def lenses(self) -> int:
        """Images of the camera."""
        return 2 if "STEREO_CAMERAS" in self.names else 1

    @property
    def camera_name(self) -> str:
        """Name of the camera."""
        return next(name for name in self.names if name in CAMERAS)

    @property
    def lidar_name(self) -> str:
        """Name of the LIDAR sensor, or an empty string."""
        return next((name for name in self.names if name in LIDARS), "")

    @property
    def lidar_size(self) -> int:
        """Values of the LIDAR sensor; 0 without one."""
        return observation_shape(self.lidar_name, lidar=self.lidar)[0] if self.lidar_name else 0

    @property
    def lidar_is_first(self) -> bool:
        """Whether AWS's networks put what comes of the LIDAR before what comes of the camera: they go by name."""
        return bool(self.lidar_name) and self.lidar_name < self.camera_name

    def camera(self, camera: CameraSpec | None = None) -> CameraSpec:
        """The simulator's camera; `camera` gives its size and look, AWS's by default."""
        return camera_of(self.names, camera=camera)

    def simulation_settings(self, camera: CameraSpec | None = None) -> dict[str, Any]:
        """The arguments of `Simulation` that these sensors need."""
        return {"camera": self.camera(camera), "lidar": bool(self.lidar_name)}

    def read(self, simulation: SensedCars) -> NDArray[np.uint8]:
        """What the sensors of all cars tell now, as a network of these sensors takes it.

        A camera alone: the simulation's frames, a view  (N, H, W), or (N, 2, H, W) of two lenses. With a LIDAR: a new
        array of bytes, a row for each car: the images, then the LIDAR's values times 255, rounded; 4 mm are finer
        than its noise of 10.

        Raises:
            ConfigError: The simulation lacks a sensor.
        """
        frames = simulation.frames
        if simulation.camera is None or (frames.ndim == 4) != (self.lenses == 2):
            raise ConfigError(
                f"The simulation has not the camera of {', '.join(self.names)}.",
                hint="Make it with **SensorSuite(...).simulation_settings().",
            )
        if not self.lidar_name:
            return frames
        if not simulation.lidar.size:
            raise ConfigError("The simulation has no LIDAR.", hint="Make it with lidar=True.")
        values = observe_lidar(self.lidar_name, simulation.lidar, config=self.lidar)
        count = simulation.num_envs
        sight = np.empty((count, frames[0].size + values.shape[1]), np.uint8)
        sight[:, : frames[0].size] = frames.reshape(count, -1)
        sight[:, frames[0].size :] = np.rint(values * 255.0)
        return sight


FRONT_CAMERA = SensorSuite()
"""The front camera alone."""
