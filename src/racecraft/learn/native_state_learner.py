"""A learner without a camera, for teachers: two small perceptrons over the simulator's state, in the native core.

    states (N, S) ──policy──▶ policy outputs        both towers: dense layers of `networks.TEACHER_UNITS`, tanh
    states (N, S) ──values──▶ values

Everything a `racecraft.learn.learner.Learner` does, so PPO trains it as it trains the others; its observations are the
states themselves, as floats.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft import _native
from racecraft.learn import networks
from racecraft.learn.learner import Minibatch, NetworkSpec
from racecraft.learn.native_learner import NativeLearner


class NativeStateLearner(NativeLearner):
    """A `racecraft.learn.learner.Learner` whose observations are float states (N, S).

    Args:
        spec: Number and kind of actions, and ``state_size``; its camera and its network's name mean nothing here.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        num_threads: As of `NativeLearner`.

    Raises:
        ConfigError: The state has no column.
    """

    def __init__(self, spec: NetworkSpec, *, seed: int | None = 0, num_threads: int = 0) -> None:
        super().__init__(replace(spec, name=networks.TEACHER), seed=seed, num_threads=num_threads)

    def _make(self, spec: NetworkSpec, num_threads: int) -> _native.Learner:
        return _native.Learner(
            height=0,
            width=0,
            top=0,
            pool=1,
            block=1,
            convs=[],
            dense=[],
            num_actions=spec.num_actions,
            is_discrete=spec.is_discrete,
            state_size=spec.state_size,
            critic_units=list(networks.TEACHER_UNITS),
            lenses=1,
            lidar_size=0,
            lidar_units=[],
            policy_units=list(networks.TEACHER_UNITS),
            num_threads=num_threads,
        )

    def encode(self, frames: NDArray[Any]) -> NDArray[Any]:
        """The states as they are, a copy."""
        return np.array(frames, np.float32)

    def policy(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        outputs: NDArray[np.float32] = self._native.policy(*self._blind(observations))
        return outputs

    def values(self, observations: NDArray[Any], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates of the observations  (N,)."""
        return self._native.values(*self._blind(observations))

    def _sensed(self, minibatch: Minibatch, size: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        return self._blind(minibatch.observations, size)

    def _blind(self, states: NDArray[Any], size: int | None = None) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """No bytes, and the states."""
        count = len(states) if size is None else size
        return np.zeros((count, 0), np.uint8), self._column("observations", states, (count, self.spec.state_size))
