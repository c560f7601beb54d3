"""The models of AWS's ``model_metadata.json``: in what forms it comes, and what each says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import copysign
from typing import Any, Final, Literal, TypeVar

from pydantic import Field, field_validator, model_validator

from racecraft.agent.action_space import (
    MAX_ACTIONS,
    MAX_FILE_SPEED,
    MAX_FILE_STEERING,
    MAX_SPEED,
    MAX_STEERING,
    MIN_ACTIONS,
    MIN_SPEED,
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
)
from racecraft.agent.aws_file import AwsModel, Number, Whole, unknown_fields, validate
from racecraft.agent.metadata_words import CONFIGURED, NEURAL_NETWORKS, VERSIONS, NeuralNetwork, plain
from racecraft.agent.sensors import LIDAR_RAYS, LidarConfig, check_sensors
from racecraft.errors import ConfigError

Metadata = TypeVar("Metadata")

DROA_MIN_SPEED = 0.5  # m/s; below it "DeepRacer on AWS" refuses a continuous action space
OF_THE_CAR: Final = frozenset(("num_values", "min_angle", "max_angle", "min_distance", "max_distance"))
"""What a physical car demands in ``lidar_config``, too: of its own LIDAR, and the simulated one does not follow it."""


class _Action(AwsModel):
    steering_angle: Number = Field(
        ge=-MAX_FILE_STEERING,
        le=MAX_FILE_STEERING,
        description=f"{-MAX_STEERING:g} to {MAX_STEERING:g} degrees",
    )
    speed: Number = Field(
        ge=MIN_SPEED,
        le=MAX_FILE_SPEED,
        description=f"{MIN_SPEED:g} to {MAX_SPEED:g} m/s (files of 2019 up to {MAX_FILE_SPEED:g})",
    )
    index: Whole | None = Field(None, description="the action's place in the list")


class _Steering(AwsModel):
    low: Number = Field(ge=-MAX_STEERING, le=0, description=f"{-MAX_STEERING:g} to 0 degrees")
    high: Number = Field(ge=0, le=MAX_STEERING, description=f"0 to {MAX_STEERING:g} degrees")


class _Speed(AwsModel):
    low: Number = Field(ge=MIN_SPEED, le=MAX_SPEED, description=f"{MIN_SPEED:g} to {MAX_SPEED:g} m/s")
    high: Number = Field(ge=MIN_SPEED, le=MAX_SPEED, description=f"{MIN_SPEED:g} to {MAX_SPEED:g} m/s")


class _Limits(AwsModel):
    steering_angle: _Steering = Field(description='an object {"low", "high"} in degrees')
    speed: _Speed = Field(description='an object {"low", "high"} in m/s')


class _Lidar(AwsModel):
    num_sectors: Whole = Field(8, description=f"a divisor of {LIDAR_RAYS}")
    num_values_per_sector: Whole = Field(8, ge=1, le=LIDAR_RAYS, description=f"1 to {LIDAR_RAYS}")
    clipping_dist: Number = Field(2.0, gt=0.15, le=12, description="above 0.15, to 12 metres")
    clipping_distance: Number | None = Field(None, description="above 0.15, to 12 metres")

    @property
    def unknown(self) -> tuple[str, ...]:
        """None of a car's file, which has all seven keys that it demands."""
        names = super().unknown
        is_of_a_car = self.clipping_distance is not None and set(names) >= OF_THE_CAR
        return tuple(name for name in names if not is_of_a_car or name not in OF_THE_CAR)

    @model_validator(mode="before")
    @classmethod
    def _by_the_cars_name(cls, value: Any) -> Any:
        """The car's software calls the same distance otherwise than the trainer."""
        if isinstance(value, dict) and "clipping_distance" in value and "clipping_dist" not in value:
            return {**value, "clipping_dist": value["clipping_distance"]}
        return value

    @field_validator("num_sectors")
    @classmethod
    def _divides(cls, value: int) -> int:
        if value < 1 or LIDAR_RAYS % value:
            raise ValueError("not a divisor")
        return value


class _Common(AwsModel):
    """Everything but the action space; it takes one of two forms, and so the file is one of two models."""

    sensor: list[str] = Field(["observation"], description='a list of sensor names, such as ["FRONT_FACING_CAMERA"]')
    neural_network: NeuralNetwork = Field(NEURAL_NETWORKS[0], description=", ".join(NEURAL_NETWORKS))
    training_algorithm: Literal["clipped_ppo", "sac"] = Field("clipped_ppo", description="'clipped_ppo' or 'sac'")
    action_space_type: Literal["discrete", "continuous"] = Field("discrete", description="'discrete' or 'continuous'")
    version: str = Field("1", description="'1' to '6'")
    lidar_config: _Lidar | None = Field(None, description="an object with num_sectors, num_values_per_sector, ...")

    @field_validator("training_algorithm", "action_space_type", mode="before")
    @classmethod
    def _plain_words(cls, value: object) -> object:
        return plain(value)

    @field_validator("version", mode="before")
    @classmethod
    def _whole_version(cls, value: object) -> str:
        text = str(value).removesuffix(".0")
        if isinstance(value, bool) or text not in VERSIONS:
            raise ValueError("not a version")
        return text


class _DiscreteFile(_Common):
    action_space: list[_Action] = Field(
        min_length=MIN_ACTIONS,
        max_length=MAX_ACTIONS,
        description=f"a list of {MIN_ACTIONS} to {MAX_ACTIONS} actions",
    )


class _ContinuousFile(_Common):
    action_space: _Limits = Field(description="an object with steering_angle and speed, as the type is continuous")


def read_metadata(document: Mapping[str, Any], *, name: str, make: Callable[..., Metadata]) -> Metadata:
    """What the file's content says. Missing fields get AWS's defaults.

    Args:
        document: The content.
        name: What messages call it.
        make: Is given the fields of a `racecraft.agent.ModelMetadata`.

    Raises:
        ConfigError: Names the file, the field, its value and what is allowed.
    """
    common = validate(_Common, document, name=name)
    continuous = common.action_space_type == "continuous"
    if "action_space_type" not in document:
        continuous = isinstance(document.get("action_space"), dict)
    version = common.version if "version" in document else ("2" if "sensor" in document else "1")
    notes: list[str] = []
    space: ActionSpace
    try:
        file: _DiscreteFile | _ContinuousFile
        if continuous:
            file = validate(_ContinuousFile, document, name=name)
            space = ContinuousActionSpace.from_aws(file.action_space.model_dump())
            if space.low[1] < DROA_MIN_SPEED:
                notes.append(f"{name}: DeepRacer on AWS refuses a continuous speed below {DROA_MIN_SPEED} m/s.")
        else:
            if isinstance(document.get("action_space"), dict):
                raise ConfigError(
                    f"action_space is an object, and action_space_type {common.action_space_type!r}; allowed is a list "
                    f"of {MIN_ACTIONS} to {MAX_ACTIONS} actions, or 'continuous'."
                )
            file = validate(_DiscreteFile, document, name=name)
            notes += _action_notes(file.action_space, version, name=name)
            space = DiscreteActionSpace.from_aws([action.model_dump() for action in file.action_space])
        lidar = file.lidar_config
        return make(
            action_space=space,
            sensors=check_sensors(file.sensor),
            neural_network=file.neural_network,
            training_algorithm=file.training_algorithm,
            version=version,
            lidar=LidarConfig(lidar.num_sectors, lidar.num_values_per_sector, lidar.clipping_dist) if lidar else None,
            extra=dict(file.model_extra or {}),
            lidar_extra=_lidar_extra(lidar),
            notes=(*unknown_fields(file, name=name), *_lidar_notes(file, name=name), *notes),
        )
    except ConfigError as error:
        message = str(error)
        raise ConfigError(message if message.startswith(name) else f"{name}: {message}", hint=error.hint) from error


def _lidar_extra(lidar: _Lidar | None) -> dict[str, Any]:
    """What ``lidar_config`` holds beside the fields of `LidarConfig`."""
    if lidar is None:
        return {}
    cars = {} if lidar.clipping_distance is None else {"clipping_distance": lidar.clipping_distance}
    return {**cars, **(lidar.model_extra or {})}


def _lidar_notes(file: _Common, *, name: str) -> list[str]:
    """What is special about ``lidar_config``."""
    lidar, notes = file.lidar_config, list[str]()
    if lidar is None:
        return notes
    if CONFIGURED not in file.sensor:
        if not _lidar_extra(lidar).keys() >= OF_THE_CAR:
            notes.append(f"{name}: lidar_config has no effect without the sensor {CONFIGURED}.")
    elif lidar.clipping_distance is not None:
        distance = f"{name}: lidar_config.clipping_distance {lidar.clipping_distance:g}"
        if lidar.clipping_distance == lidar.clipping_dist:
            notes.append(f"{distance} is taken as clipping_dist, which a car calls so.")
        else:
            notes.append(f"{distance} has no effect, as clipping_dist is given too.")
    return notes


def _action_notes(actions: list[_Action], version: str, *, name: str) -> list[str]:
    """What is special about a list of actions; refuses more than 30° in files that are too young for it."""
    notes = []
    for place, action in enumerate(actions):
        if abs(action.steering_angle) > MAX_STEERING:
            where = f"action_space[{place}].steering_angle is {action.steering_angle:g}"
            if version not in ("1", "2"):
                limits = f"{-MAX_STEERING:g} to {MAX_STEERING:g} degrees"
                raise ConfigError(f"{where}; allowed is {limits} (up to {MAX_FILE_STEERING:g} only in version 1 or 2).")
            driven = copysign(MAX_STEERING, action.steering_angle)
            notes.append(f"{name}: {where}, driven as {driven:g}: the wheels turn no further.")
    if fast := sum(action.speed > MAX_SPEED for action in actions):
        notes.append(f"{name}: {fast} of {len(actions)} actions ask for more than {MAX_SPEED:g} m/s, driven as that.")
    odd = [(place, action.index) for place, action in enumerate(actions) if action.index not in (None, place)]
    if len(odd) == 1:
        (place, index), *_ = odd
        notes.append(f"{name}: action_space[{place}].index is {index}; its place in the list counts.")
    elif odd:  # a habit of who wrote the file, such as to count from 1
        notes.append(
            f"{name}: the index of {len(odd)} of {len(actions)} actions is not its place in the list, which counts."
        )
    return notes
