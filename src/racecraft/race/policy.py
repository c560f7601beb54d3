"""A driver: what turns what the sensors tell into commands, and how one is loaded from a run.

A run's files may be a stranger's, and they decide nothing but how its car drives. Taken from them are the action space
and the sensors (`model_metadata.json`, within AWS's limits), the description of a network that we know, and that
network's own weights: exactly its names and shapes, float32, finite. Nothing else is read, let alone believed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace
from racecraft.agent.model_metadata import ModelMetadata
from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.agent.sensors import FRAME_HEIGHT, FRAME_WIDTH
from racecraft.checks import check_whole
from racecraft.errors import CheckpointError, NonFiniteAction
from racecraft.learn import Learner, NetworkSpec, distributions, network_names
from racecraft.learn.networks import weight_shapes
from racecraft.race.seeing import learner_of
from racecraft.run.checkpoint import StoredCheckpoint
from racecraft.run.folder import RunFolder

WEIGHTS: Final = "weights/"
"""Prefix of the network's weights among a checkpoint's arrays."""
MAX_STATE: Final = 4096
"""Columns of state that a critic may have learned from."""


class NetworkPolicy:
    """A network's best action for what its sensors tell, as in evaluation; it draws no random numbers.

    Args:
        learner: Holds the network; it may go on learning.
        action_space: Turns its actions into commands.
        sensors: What it sees through.
    """

    def __init__(self, learner: Learner, action_space: ActionSpace, *, sensors: SensorSuite = FRONT_CAMERA) -> None:
        self.learner = learner
        self.action_space = action_space
        self.sensors = sensors

    def __call__(self, frames: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Commands (N, 2), steering angle in rad and speed in m/s, for what `sensors` read  (N, ...).

        Raises:
            NonFiniteAction: The network gives NaN or infinite numbers, as weights can that are themselves finite.
        """
        spec = self.learner.spec
        outputs = self.learner.policy(self.learner.encode(frames))
        if not np.isfinite(outputs).all():
            raise NonFiniteAction(f"Its network gives {outputs[~np.isfinite(outputs)][0]}, which is no action.")
        actions = distributions.most_likely(outputs, is_discrete=spec.is_discrete, is_squashed=spec.is_squashed)
        return self.action_space.to_commands(actions if spec.is_discrete else actions.clip(-1.0, 1.0))


def load_policy(run: RunFolder, *, checkpoint: str | int = "best", num_threads: int = 0) -> tuple[int, NetworkPolicy]:
    """The policy of a run's checkpoint, and the camera steps of training behind it.

    Its critic is not loaded: it does not drive.

    Args:
        run: The run folder.
        checkpoint: ``best``, ``last`` or a number of steps.
        num_threads: 0 takes one per core.

    Raises:
        CheckpointError: There is no such checkpoint, it is damaged, does not fit its description, or holds what is not
            its network's.
        ConfigError: The run's action space or sensors, or the number of threads, are not allowed.
    """
    check_whole("num_threads", num_threads, 0, 1024)
    saved = run.checkpoints.find(checkpoint)
    return saved.step, policy_of(saved, run.read_model_metadata(), num_threads=num_threads)


def policy_of(saved: StoredCheckpoint, metadata: ModelMetadata, *, num_threads: int = 0) -> NetworkPolicy:
    """The policy that a file holds, with the action space and the sensors that it was made for.

    Raises:
        CheckpointError: It does not fit its description, or holds what is not its network's.
    """
    spec = network_of(saved, metadata)
    learner = learner_of(spec, seed=None, num_threads=num_threads)
    critic = {name: array for name, array in learner.weights().items() if name.startswith("critic.")}
    learner.load_weights(driving_weights(saved, spec) | critic)
    return NetworkPolicy(learner, metadata.action_space, sensors=metadata.suite)


def load_driver(run: str | Path, *, checkpoint: str | int = "best") -> NetworkPolicy:
    """The policy of a run folder, to drive with: an opponent, a ghost, a model in a race.

    Args:
        run: Path of the run.
        checkpoint: ``best``, ``last`` or a number of steps.

    Raises:
        RunError: There is no such run.
        CheckpointError: There is no such checkpoint, or it is damaged.
    """
    return load_policy(RunFolder.open(run), checkpoint=checkpoint, num_threads=1)[1]


def network_of(saved: StoredCheckpoint, metadata: ModelMetadata) -> NetworkSpec:
    """The network that a checkpoint describes: one that we know, of this action space and these sensors."""
    described = saved.metadata.get("network")
    if not isinstance(described, Mapping):
        raise CheckpointError(f"{saved.path} does not describe its network.")
    space, suite = metadata.action_space, metadata.suite
    expected: dict[str, Any] = {
        "num_actions": space.size,
        "is_discrete": space.kind == "discrete",
        "frame_shape": [FRAME_HEIGHT, FRAME_WIDTH],
        "lenses": suite.lenses,
        "lidar_size": suite.lidar_size,
    }
    # what older versions do not name has its default
    given = {"state_size": 0, "lenses": 1, "lidar_size": 0, "is_squashed": False, **described}
    for name, value in expected.items():
        if type(given.get(name)) is not type(value) or given[name] != value:
            raise CheckpointError(
                f"{saved.path} describes a network whose {name} is {_short(given.get(name))}; "
                f"the run's action space and sensors ask for {value}."
            )
    network, is_squashed, state_size = given.get("name"), given["is_squashed"], given["state_size"]
    if network not in network_names():
        known = ", ".join(network_names())
        raise CheckpointError(f"{saved.path} has the network {_short(network)}; known are {known}.")
    if type(state_size) is not int or not 0 <= state_size <= MAX_STATE:
        raise CheckpointError(f"{saved.path} has a state_size of {_short(state_size)}; allowed is 0 to {MAX_STATE}.")
    if type(is_squashed) is not bool:
        raise CheckpointError(f"{saved.path} has an is_squashed of {_short(is_squashed)}; allowed are true and false.")
    if unknown := sorted(set(given) - set(expected) - {"name", "is_squashed", "state_size"}):
        raise CheckpointError(f"{saved.path} says of its network what we do not know: {_short(unknown[0])}.")
    return NetworkSpec(
        name=str(network),
        num_actions=space.size,
        is_discrete=space.kind == "discrete",
        state_size=state_size,
        lenses=suite.lenses,
        lidar_size=suite.lidar_size,
        is_squashed=is_squashed,
    )


def driving_weights(saved: StoredCheckpoint, spec: NetworkSpec) -> dict[str, NDArray[Any]]:
    """The policy's weights, after their names, types and shapes were found to be exactly the network's."""
    kinds = {name.removeprefix(WEIGHTS): kind for name, kind in saved.kinds.items() if name.startswith(WEIGHTS)}
    shapes = weight_shapes(spec)
    wanted = [name for name in shapes if name.startswith("policy.")]
    has_critic = any(name.startswith("critic.") for name in kinds)  # some algorithms judge otherwise
    expected = {name: ("F32", shapes[name]) for name in (shapes if has_critic else wanted)}
    for name in [*expected, *kinds]:
        if kinds.get(name) != expected.get(name):
            raise CheckpointError(
                f"{saved.path} does not hold the weights of {spec.name}: {_short(name)} is {_kind(kinds.get(name))} "
                f"in the file, {_kind(expected.get(name))} in the network."
            )
    arrays = saved.read(f"{WEIGHTS}{name}" for name in wanted)
    for name in wanted:
        if not np.isfinite(arrays[f"{WEIGHTS}{name}"]).all():
            raise CheckpointError(f"{saved.path} has weights that are NaN or infinite: {name}.")
    return {name: arrays[f"{WEIGHTS}{name}"] for name in wanted}


def _kind(kind: tuple[str, tuple[int, ...]] | None) -> str:
    return "missing" if kind is None else f"{kind[0]} of shape {kind[1]}"


def _short(value: object) -> str:
    """Somebody else's value in a message."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:79]}…"
