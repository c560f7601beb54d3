"""What a car may do and see: action spaces, sensors, and AWS's two settings files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from racecraft.agent.action_space import (
    PRESETS,
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
    action_space,
)
from racecraft.agent.lidar import observe_lidar
from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.agent.sensors import LidarConfig, camera_of, check_sensors, observation_shape

if TYPE_CHECKING:
    from racecraft.agent.hyperparameters import Hyperparameters
    from racecraft.agent.model_metadata import ModelMetadata

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

_WITH_PYDANTIC = {"Hyperparameters": "hyperparameters", "ModelMetadata": "model_metadata"}


def __getattr__(name: str) -> Any:
    """Import what reads files on first use: pydantic takes longer to import than all the rest."""
    if name in _WITH_PYDANTIC:
        return getattr(import_module(f"racecraft.agent.{_WITH_PYDANTIC[name]}"), name)
    raise AttributeError(f"module 'racecraft.agent' has no attribute {name!r}")
