"""A driver: what turns what the sensors tell into commands, and how one is loaded from a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace
from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.errors import CheckpointError
from racecraft.learn import Learner, NetworkSpec, distributions, make_learner
from racecraft.learn.learner import below
from racecraft.run.folder import RunFolder

WEIGHTS = "weights/"
"""Prefix of the network's weights among a checkpoint's arrays."""


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
        """Commands (N, 2), steering angle in rad and speed in m/s, for what `sensors` read  (N, ...)."""
        spec = self.learner.spec
        outputs = self.learner.policy(self.learner.encode(frames))
        actions = distributions.most_likely(outputs, is_discrete=spec.is_discrete, is_squashed=spec.is_squashed)
        return self.action_space.to_commands(actions if spec.is_discrete else actions.clip(-1.0, 1.0))


def load_policy(run: RunFolder, *, checkpoint: str | int = "best", num_threads: int = 0) -> tuple[int, NetworkPolicy]:
    """The policy of a run's checkpoint, and the camera steps of training behind it.

    Args:
        run: The run folder.
        checkpoint: ``best``, ``last`` or a number of steps.
        num_threads: 0 takes one per core.

    Raises:
        CheckpointError: There is no such checkpoint, it is damaged, or does not fit its description.
        ConfigError: The run's action space is not valid.
    """
    saved = run.checkpoints.load(checkpoint)
    try:
        spec = NetworkSpec(
            **{**saved.metadata["network"], "frame_shape": tuple(saved.metadata["network"]["frame_shape"])}
        )
    except (KeyError, TypeError) as error:
        raise CheckpointError(f"{saved.path} does not describe its network: {error}.") from error
    learner = make_learner(spec, seed=None, num_threads=num_threads)
    given = below(WEIGHTS, saved.arrays)
    if not any(name.startswith("critic.") for name in given):  # of an algorithm that judges otherwise
        given |= {name: array for name, array in learner.weights().items() if name.startswith("critic.")}
    learner.load_weights(given)
    metadata = run.read_model_metadata()
    return saved.step, NetworkPolicy(learner, metadata.action_space, sensors=metadata.suite)


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
