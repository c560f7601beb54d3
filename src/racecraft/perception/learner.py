"""A learner that sees nothing but what perception tells: `--network PERCEPTION`.

frames ──perceiver──▶ outputs ──bytes──▶ observations ──dense layers──▶ policy outputs        (the critic as ever)

The perceiver learned before and learns nothing here. It looks at each picture by itself, so a picture always gives the
same action, and a policy can be judged, raced and resumed like any other.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError
from racecraft.learn import networks
from racecraft.learn.learner import NetworkSpec
from racecraft.learn.native_learner import NativeLearner
from racecraft.perception.answers import ERRORS, IN_SIGHT, MIDDLES, NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS
from racecraft.perception.memory import bend
from racecraft.perception.network import Perceiver

SURE: Final = 3.0
"""A yes or no is told by its logit over this, which is 95 or 5 %."""
USUAL_LOG_ERROR: Final = -2.0
"""In units of the network: logarithm of how far off, that is told as neither far nor near."""
NOTHING, REACH = 128.0, 127.0
"""The byte of 0, and how far from it the bytes of any number lie at most."""


def _units() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    units, usual = np.ones(NUM_OUTPUTS, np.float32), np.zeros(NUM_OUTPUTS, np.float32)
    units[NUM_CONTINUOUS:NUM_TARGETS] = SURE
    usual[ERRORS] = USUAL_LOG_ERROR
    return units, usual


TOLD_UNITS, TOLD_AS_NOTHING = _units()
"""What 1 of a told number is of an output, and the output that is told as 0  (NUM_OUTPUTS,)."""


class BeliefLearner(NativeLearner):
    """A `racecraft.learn.learner.Learner` whose observations are perception's outputs, a byte each.

    Behind them lie a LIDAR's bytes, where there is one.

    Args:
        spec: A network named `racecraft.learn.networks.PERCEPTION`, of one lens.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        num_threads: 0 takes every core the process may use. Results are the same for any number.
        perceiver: Who looks; by default with the weights that the package brings along.

    Raises:
        ConfigError: The camera has two lenses.
        CheckpointError: The weights of perception cannot be read.
    """

    def __init__(
        self, spec: NetworkSpec, *, seed: int | None = 0, num_threads: int = 0, perceiver: Perceiver | None = None
    ) -> None:
        if spec.lenses != 1:
            raise ConfigError(f"The network {networks.PERCEPTION} looks through one lens; STEREO_CAMERAS has two.")
        super().__init__(spec, seed=seed, num_threads=num_threads)
        self._sensors = replace(spec, name=networks.PERCEIVER)
        self.sight_shape = networks.sight_shape(self._sensors)
        self.perceiver = perceiver or Perceiver(num_threads=num_threads)

    @property
    def core(self) -> None:
        """None: the core's loop asks for what perception tells."""

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """What perception tells of frames, and the LIDAR's bytes  (N, *observation_shape)."""
        networks.check_sight(self._sensors, frames)
        count, (height, width) = len(frames), self.spec.frame_shape
        flat = frames.reshape(count, -1)
        pictures = np.ascontiguousarray(flat[:, : height * width]).reshape(count, height, width)
        told = np.zeros((count, networks.TOLD_SIDE**2), np.uint8)
        told[:, :NUM_OUTPUTS] = bytes_of(self.perceiver.outputs(pictures))
        return np.concatenate([told, flat[:, height * width :]], axis=1).reshape(count, *self.observation_shape)


def bytes_of(outputs: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Outputs of perception (N, NUM_OUTPUTS) as bytes: 128 is nothing, finest there, and no number lies beyond.

    A step of the offset is 2 mm in the middle of the road, of a heading 0.1 degrees. Columns of the road's middle are
    told where it is in sight.
    """
    return np.rint(NOTHING + REACH * bend(_told(outputs))).astype(np.uint8)


def byte_slopes(outputs: NDArray[np.float32]) -> NDArray[np.float32]:
    """How a byte changes with its output, were it not rounded  (N, NUM_OUTPUTS)."""
    numbers, step = _told(outputs), np.ones(outputs.shape) / TOLD_UNITS
    step[:, MIDDLES] *= outputs[:, IN_SIGHT] > 0.0
    return np.asarray(REACH * step * (1.0 + numbers * numbers) ** -1.5, np.float32)


def _told(outputs: NDArray[np.float32]) -> NDArray[np.float64]:
    """Outputs before they are bent: columns out of sight, and errors as large as usual, are 0."""
    numbers = outputs.astype(np.float64)
    numbers[:, MIDDLES] *= numbers[:, IN_SIGHT] > 0.0
    return (numbers - TOLD_AS_NOTHING) / TOLD_UNITS
