"""``model_metadata.json`` as a physical car reads it, and what the car does otherwise than the simulator did."""

from __future__ import annotations

import math
from typing import Any, Final

from racecraft.agent.action_space import MAX_SPEED, MAX_STEERING, ActionSpace
from racecraft.agent.lidar import FARTHEST, NEAREST, NUM_SECTORS, SECTOR_LIMIT
from racecraft.agent.model_metadata import ModelMetadata
from racecraft.agent.sensors import LIDAR_RAYS
from racecraft.car.command import as_driven, largest, listed_choices, throttle
from racecraft.errors import ConfigError
from racecraft.learn import NetworkSpec

LIDAR_ANGLE: Final = 150.0  # degrees to either side
_KIT: Final = ("LEFT_CAMERA", "STEREO_CAMERAS", "LIDAR", "SECTOR_LIDAR")
"""What the standard car has not, but the sensor kit that was sold for it."""
_UNKNOWN: Final = "DISCRETIZED_SECTOR_LIDAR"


def car_metadata(metadata: ModelMetadata, spec: NetworkSpec) -> dict[str, Any]:
    """The file's content: what the car reads, and the network and version for whoever reads it back.

    Raises:
        ConfigError: The car does not know a sensor, or no action steers.
    """
    if _UNKNOWN in metadata.sensors:
        raise ConfigError(
            f"The car's software does not know the sensor {_UNKNOWN}.",
            hint="Train with --sensors FRONT_FACING_CAMERA, LIDAR or SECTOR_LIDAR.",
        )
    space = as_driven(metadata.action_space)
    largest(space)
    document: dict[str, Any] = {
        "action_space": space.to_aws(),
        "action_space_type": space.kind,
        "sensor": list(metadata.sensors),
        "training_algorithm": "sac" if spec.is_squashed else "clipped_ppo",
        "neural_network": spec.name,
        "version": metadata.version,
    }
    if metadata.suite.lidar_name:
        document["lidar_config"] = _lidar_config(metadata.suite.lidar_name)
    return document


def _lidar_config(sensor: str) -> dict[str, float]:
    """All seven keys that the car demands, else it takes none; by what the simulated LIDAR told the policy."""
    is_whole = sensor == "LIDAR"
    distance = FARTHEST if is_whole else SECTOR_LIMIT
    return {
        "num_values": LIDAR_RAYS,
        "min_angle": -LIDAR_ANGLE,
        "max_angle": LIDAR_ANGLE,
        "min_distance": NEAREST,
        "max_distance": distance,
        "clipping_distance": distance,
        "num_sectors": LIDAR_RAYS if is_whole else NUM_SECTORS,
    }


def car_notes(metadata: ModelMetadata, spec: NetworkSpec) -> list[str]:
    """Sentences on what the car does otherwise than the simulator, the weightiest first."""
    space = as_driven(metadata.action_space)
    notes = [*_limit_notes(metadata.action_space, space), *_steering_notes(space), *_speed_notes(space)]
    if spec.is_squashed:
        notes.append("The car clips what SAC squashes, so the graph ends in the hyperbolic tangent.")
    kit = [name for name in metadata.sensors if name in _KIT]
    if kit:
        notes.append(f"The standard car has one camera in front: it takes the sensor kit to have {', '.join(kit)}.")
    if "STEREO_CAMERAS" in metadata.sensors:
        notes.append("Community software that runs TFLite is reported to mix up the two pictures of STEREO_CAMERAS.")
    if metadata.suite.lidar_name:
        notes.append(
            "lidar_config says how far the LIDAR was trained to see: without it the car would clip at 0.5 m by default."
        )
    return notes


def _limit_notes(listed: ActionSpace, driven: ActionSpace) -> list[str]:
    beyond = (listed_choices(listed) != listed_choices(driven)).any(axis=1)
    if not beyond.any():
        return []
    return [
        f"{beyond.sum()} of {len(beyond)} actions ask for more than the simulator's car does: the archive lists them "
        f"as they were driven, with {MAX_STEERING:g}° and {MAX_SPEED:g} m/s at most."
    ]


def _steering_notes(space: ActionSpace) -> list[str]:
    angles = [math.degrees(angle) for angle in listed_choices(space)[:, 0]]
    widest, left, right = math.degrees(largest(space)[0]), max(angles), -min(angles)
    notes = []
    if round(widest, 6) != MAX_STEERING:
        notes.append(
            f"The largest angle is always full lock on a car: {widest:g}° here, where it was trained with "
            f"{widest:g}° of {MAX_STEERING:g}°."
        )
    if not math.isclose(left, right, abs_tol=1e-9):
        notes.append(
            f"It steers {max(left, 0):g}° to the left and {max(right, 0):g}° to the right: on a car the wider of them "
            "is full lock, the other one stays short of it."
        )
    return notes


def _speed_notes(space: ActionSpace) -> list[str]:
    speeds = listed_choices(space)[:, 1]
    slowest, fastest = speeds.min(), speeds.max()
    if slowest == fastest:
        return ["There is one speed: on a car it is the slider alone that says how fast."]
    share = float(throttle(speeds.min(keepdims=True), space)[0])
    return [
        f"Only relative speed counts on a car: {slowest:g} m/s, {100 * slowest / fastest:.0f} % of the largest speed, "
        f"gets {100 * share:.0f} % of the throttle of {fastest:g} m/s."
    ]
