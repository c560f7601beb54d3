"""AWS's ``model_metadata.json``: what a car may see and do, in every form the file has had."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

from pydantic import Field, field_validator, model_validator

from racecraft.agent.action_space import (
    MAX_ACTIONS,
    MAX_FILE_STEERING,
    MAX_SPEED,
    MAX_STEERING,
    MIN_ACTIONS,
    MIN_SPEED,
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
    action_space,
)
from racecraft.agent.aws_file import AwsModel, Number, Whole, unknown_fields, validate
from racecraft.agent.sensor_suite import SensorSuite
from racecraft.agent.sensors import LIDAR_RAYS, LidarConfig, check_sensors
from racecraft.checks import check_choice
from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object, write_json_object

NeuralNetwork = Literal[
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "DEEP_CONVOLUTIONAL_NETWORK",
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP",
    "RACECRAFT_SMALL",  # ours, much faster to train
]
NEURAL_NETWORKS: tuple[NeuralNetwork, ...] = get_args(NeuralNetwork)
VERSIONS = ("1", "2", "3", "4", "5", "6")
DROA_MIN_SPEED = 0.5  # m/s; below it "DeepRacer on AWS" refuses a continuous action space
CONFIGURED: Final = "DISCRETIZED_SECTOR_LIDAR"
"""The one sensor that ``lidar_config`` is for."""
OF_THE_CAR: Final = frozenset(("num_values", "min_angle", "max_angle", "min_distance", "max_distance"))
"""What a physical car demands in ``lidar_config``, too: of its own LIDAR, and the simulated one does not follow it."""


class _Action(AwsModel):
    steering_angle: Number = Field(
        ge=-MAX_FILE_STEERING,
        le=MAX_FILE_STEERING,
        description=f"{-MAX_STEERING:g} to {MAX_STEERING:g} degrees",
    )
    speed: Number = Field(ge=MIN_SPEED, le=MAX_SPEED, description=f"{MIN_SPEED:g} to {MAX_SPEED:g} m/s")
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

    sensor: list[str] = Field(["observation"], description="a list of sensor names")
    neural_network: NeuralNetwork = Field(NEURAL_NETWORKS[0], description=", ".join(NEURAL_NETWORKS))
    training_algorithm: Literal["clipped_ppo", "sac"] = Field("clipped_ppo", description="'clipped_ppo' or 'sac'")
    action_space_type: Literal["discrete", "continuous"] = Field("discrete", description="'discrete' or 'continuous'")
    version: str = Field("1", description="'1' to '6'")
    lidar_config: _Lidar | None = Field(None, description="an object with num_sectors, num_values_per_sector, ...")

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


@dataclass(frozen=True)
class ModelMetadata:
    """What a car may see and do, and the network it does it with.

    Raises:
        ConfigError: A value is not allowed, or two do not go together.
    """

    action_space: ActionSpace = field(default_factory=lambda: action_space("default"))
    """Commands the policy may give."""
    sensors: tuple[str, ...] = ("FRONT_FACING_CAMERA",)
    """Exactly one camera, at most one LIDAR."""
    neural_network: str = NEURAL_NETWORKS[0]
    """AWS's name of the network."""
    training_algorithm: str = "clipped_ppo"
    """``clipped_ppo`` or ``sac``; SAC needs a continuous action space."""
    version: str = "5"
    """AWS's simulator version, 1 to 6; it selects the vehicle."""
    lidar: LidarConfig | None = None
    """Only for ``DISCRETIZED_SECTOR_LIDAR``; the default sizes when None."""
    extra: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """Fields of the file that mean nothing here; kept and written back."""
    lidar_extra: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """Such fields of ``lidar_config``."""
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)
    """Sentences for the user about what in the file has no effect or is read in a special way."""

    def __post_init__(self) -> None:
        check_sensors(self.sensors)
        for name, value, allowed in (
            ("neural_network", self.neural_network, NEURAL_NETWORKS),
            ("training_algorithm", self.training_algorithm, ("clipped_ppo", "sac")),
            ("version", self.version, VERSIONS),
        ):
            check_choice(name, value, allowed)
        if self.training_algorithm == "sac" and self.action_space.kind != "continuous":
            raise ConfigError("training_algorithm 'sac' needs action_space_type 'continuous', but it is 'discrete'.")

    @property
    def suite(self) -> SensorSuite:
        """The sensors with their configuration."""
        return SensorSuite(self.sensors, self.lidar)

    @classmethod
    def load(cls, path: str | Path) -> ModelMetadata:
        """From AWS's file, of any year.

        Raises:
            ConfigError: Names the file, the field, its value and what is allowed.
        """
        return cls.from_dict(read_json_object(path), name=str(path))

    @classmethod
    def from_dict(cls, document: Mapping[str, Any], *, name: str = "model_metadata") -> ModelMetadata:
        """From the file's content; ``name`` is what messages call it. Missing fields get AWS's defaults."""
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
                file = validate(_DiscreteFile, document, name=name)
                notes += _action_notes(file.action_space, version, name=name)
                space = DiscreteActionSpace.from_aws([action.model_dump() for action in file.action_space])
            lidar = file.lidar_config
            return cls(
                action_space=space,
                sensors=check_sensors(file.sensor),
                neural_network=file.neural_network,
                training_algorithm=file.training_algorithm,
                version=version,
                lidar=LidarConfig(lidar.num_sectors, lidar.num_values_per_sector, lidar.clipping_dist)
                if lidar
                else None,
                extra=dict(file.model_extra or {}),
                lidar_extra=_lidar_extra(lidar),
                notes=(*unknown_fields(file, name=name), *_lidar_notes(file, name=name), *notes),
            )
        except ConfigError as error:
            message = str(error)
            raise ConfigError(message if message.startswith(name) else f"{name}: {message}", hint=error.hint) from error

    def save(self, path: str | Path) -> None:
        """Write AWS's file."""
        write_json_object(path, self.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """The content of AWS's file, complete."""
        document: dict[str, Any] = {
            "action_space": self.action_space.to_file(),
            "sensor": list(self.sensors),
            "neural_network": self.neural_network,
            "version": self.version,
            "training_algorithm": self.training_algorithm,
            "action_space_type": self.action_space.kind,
        }
        if self.lidar is not None:
            document["lidar_config"] = {**vars(self.lidar), **self.lidar_extra}
        return {**document, **self.extra}


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
            notes.append(f"{name}: {where}, driven as {MAX_STEERING:g}: the wheels turn no further.")
        if action.index not in (None, place):
            notes.append(f"{name}: action_space[{place}].index is {action.index}; its place in the list counts.")
    return notes
