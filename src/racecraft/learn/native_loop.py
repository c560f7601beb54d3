"""Any learner behind the core's loop: `native/src/ppo.hpp` calls those back that are not the core's own.

_native.Ppo ──bytes, columns──▶ OutsideLearner ──frames, minibatches──▶ Learner
"""

from __future__ import annotations

import math
from dataclasses import astuple, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft import _native
from racecraft.learn.learner import Learner, Minibatch, Objective
from racecraft.learn.native_learner import NativeLearner, native_objective


def make_loop(learner: Learner, objective: Objective, **settings: Any) -> _native.Ppo:
    """The loop.

    Args:
        learner: The network; it is changed in place.
        objective: Of its updates.
        settings: The others of `_native.PpoConfig`.
    """
    spec = learner.spec
    core = learner.core if isinstance(learner, NativeLearner) else None
    return _native.Ppo(
        config=_native.PpoConfig(objective=native_objective(objective), **settings),
        learner=OutsideLearner(learner, objective) if core is None else core,
        sight_size=math.prod(learner.sight_shape),
        observation_size=math.prod(learner.observation_shape),
        state_size=spec.state_size,
        num_actions=spec.num_actions,
        is_discrete=spec.is_discrete,
    )


class OutsideLearner:
    """What the loop calls where the learner is not the core's own; the arrays of a call live as long as it.

    Args:
        learner: The network, with a camera.
        objective: Of its updates, but for the step size, which the loop gives.
    """

    def __init__(self, learner: Learner, objective: Objective) -> None:
        self._learner = learner
        self._objective = objective

    def encode(self, sight: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Bytes of what the sensors tell (N, ...) as those of observations (N, ...)."""
        frames = sight.reshape(len(sight), *self._learner.sight_shape)
        return np.ascontiguousarray(self._learner.encode(frames))

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        return np.ascontiguousarray(self._learner.policy(self._shaped(observations)), np.float32)

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""
        return np.ascontiguousarray(self._learner.values(self._shaped(observations), states), np.float32)

    def update(
        self,
        observations: NDArray[np.uint8],
        states: NDArray[np.float32],
        actions: NDArray[Any],
        log_probs: NDArray[np.float32],
        advantages: NDArray[np.float32],
        returns: NDArray[np.float32],
        rows: NDArray[np.int64],
        learning_rate: float,
    ) -> tuple[float, ...]:
        """One gradient step on some rows of a rollout; the numbers of its `UpdateStats`."""
        if learning_rate != self._objective.learning_rate:
            self._objective = replace(self._objective, learning_rate=learning_rate)
        minibatch = Minibatch(
            observations=self._shaped(observations),
            states=states,
            actions=actions,
            log_probs=log_probs,
            advantages=advantages,
            returns=returns,
            rows=rows,
        )
        return tuple(map(float, astuple(self._learner.update(minibatch, self._objective))))

    def _shaped(self, observations: NDArray[np.uint8]) -> NDArray[np.uint8]:
        return observations.reshape(len(observations), *self._learner.observation_shape)
