"""What a car may do and see: action spaces, sensors, and AWS's two settings files."""

from __future__ import annotations

from racecraft.agent.action_space import (
    PRESETS,
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
    action_space,
)
from racecraft.agent.hyperparameters import Hyperparameters
from racecraft.agent.lidar import observe_lidar
from racecraft.agent.model_metadata import ModelMetadata
from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.agent.sensors import LidarConfig, camera_of, check_sensors, observation_shape

__all__ = [
    "FRONT_CAMERA",
    "PRESETS",
    "ActionSpace",
    "ContinuousActionSpace",
    "DiscreteActionSpace",
    "Hyperparameters",
    "LidarConfig",
    "ModelMetadata",
    "SensorSuite",
    "action_space",
    "camera_of",
    "check_sensors",
    "observation_shape",
    "observe_lidar",
]
