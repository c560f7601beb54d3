"""What a policy sees through AWS's sensors: a dict of one array for each sensor, by its name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from racecraft.agent.lidar import observe_lidar
from racecraft.agent.sensors import CAMERAS, LidarConfig, check_sensors, observation_shape
from racecraft.env.observation import ArrayObservation, Observation
from racecraft.sim.simulation import Simulation


class SensorObserver:
    """Hands out the observations of a simulation's cars, sensor by sensor; the counterpart of `Observer`.

    Args:
        simulation: With the camera of `camera_of(sensors)`, and a LIDAR where one is among the sensors.
        sensors: AWS's names: one camera, at most one LIDAR.
        lidar: Sizes of ``DISCRETIZED_SECTOR_LIDAR``.
    """

    def __init__(self, simulation: Simulation, sensors: Sequence[str], *, lidar: LidarConfig | None = None) -> None:
        self._sensors = check_sensors(sensors)
        self._lidar = lidar
        self._simulation = simulation
        frames = simulation.frames
        self._frames = frames[..., None] if frames.ndim == 3 else np.moveaxis(frames, 1, -1)  # (N, H, W, lenses)
        spaces: dict[str, gymnasium.Space[Any]] = {}
        for name in self._sensors:
            if name in CAMERAS:
                spaces[name] = gymnasium.spaces.Box(0, 255, self._frames.shape[1:], np.uint8)
            else:
                spaces[name] = gymnasium.spaces.Box(0.0, 1.0, observation_shape(name, lidar=lidar), np.float32)
        self.space: gymnasium.Space[Any] = gymnasium.spaces.Dict(spaces)
        """The space of one car's observation."""

    def batch(self, *, copy: bool) -> Observation:
        """What all cars see now (N, ...); without a copy, frames that the next step overwrites."""
        return self._observe(slice(None), copy=copy)

    def one(self, car: int) -> Observation:
        """What one car sees now, a copy."""
        seen = self._observe(slice(car, car + 1), copy=True)
        assert isinstance(seen, dict)
        return {name: array[0] for name, array in seen.items()}

    def _observe(self, cars: slice, *, copy: bool) -> Observation:
        seen: dict[str, ArrayObservation] = {}
        for name in self._sensors:
            if name in CAMERAS:
                frames: NDArray[np.uint8] = self._frames[cars]
                seen[name] = np.ascontiguousarray(frames) if frames.shape[-1] > 1 else frames.copy() if copy else frames
            else:
                seen[name] = observe_lidar(name, self._simulation.lidar[cars], config=self._lidar)
        return seen
