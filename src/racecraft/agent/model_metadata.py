"""AWS's ``model_metadata.json``: what a car may see and do, in every form the file has had."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from racecraft.agent.action_space import ActionSpace, ContinuousActionSpace, DiscreteActionSpace, action_space
from racecraft.agent.metadata_words import NEURAL_NETWORKS, VERSIONS
from racecraft.agent.sensor_suite import SensorSuite
from racecraft.agent.sensors import LidarConfig, check_sensors
from racecraft.checks import check_choice, check_type
from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object, write_json_object


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
        kinds = (DiscreteActionSpace, ContinuousActionSpace)
        check_type("action_space", self.action_space, kinds, "use racecraft.action_space(NAME), or one of your own")
        check_type("sensors", self.sensors, (list, tuple), "use a list of AWS's sensor names")
        check_type("lidar", self.lidar, (LidarConfig, type(None)), "use a racecraft.agent.LidarConfig, or None")
        object.__setattr__(self, "sensors", check_sensors(self.sensors))
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

    @property
    def as_filed(self) -> ModelMetadata:
        """The same as its file says it, where angles are degrees with the decimals that a person would write."""
        space = self.action_space
        if isinstance(space, DiscreteActionSpace):
            filed: ActionSpace = DiscreteActionSpace.from_aws(space.to_file())
        else:
            filed = ContinuousActionSpace.from_aws(space.to_file())
        return replace(self, action_space=filed, sensors=check_sensors(self.sensors))

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
        from racecraft.agent.metadata_file import read_metadata  # pydantic: what is not read from a file needs none

        return read_metadata(document, name=name, make=cls)

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
