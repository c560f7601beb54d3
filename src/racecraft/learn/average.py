"""The mean of the weights over the last part of a training: what drives evaluations and is saved.

Large steps make a policy learn fast and leave it restless: one evaluation is perfect and the next one is not. Its
mean over a while is what it would be with small steps, at no cost in speed. The while grows with the training
(https://arxiv.org/abs/1212.1824, polynomial-decay averaging), so nothing has to be known of how long it will take.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import CheckpointError
from racecraft.learn.learner import Learner, Weights, below


class WeightAverage:
    """A running mean of a learner's weights, and a checkpoint's entries of both.

    Args:
        learner: Whose weights they are.
        share: About which share of the iterations so far the mean covers, up to 1; 0: there is none.
    """

    def __init__(self, learner: Learner, share: float) -> None:
        self.learner = learner
        self.share = share
        self._mean: Weights = {}

    def add(self, *, iteration: int) -> None:
        """Count the learner's weights after this iteration, from 1."""
        if self.share == 0:
            return
        weights = self.learner.weights()
        part = 1.0 / (1.0 + self.share * (iteration - 1)) if self._mean else 1.0
        if part == 1.0:
            self._mean = weights
            return
        for name, mean in self._mean.items():
            mean += (weights[name] - mean) * np.float32(part)

    def weights(self, *, is_preferred: bool = True) -> Weights:
        """The mean where it is preferred and there is one, otherwise the learner's own; not to be changed."""
        return (self._mean if is_preferred else {}) or self.learner.weights()

    # ---- resume

    def state(self, *, is_preferred: bool) -> dict[str, NDArray[Any]]:
        """What is to drive, the optimiser and, where a mean is kept, what goes on learning and the mean."""
        own, mean = self.learner.weights(), {name: array.copy() for name, array in self._mean.items()}
        parts = {"weights": (is_preferred and mean) or own}
        if self.share > 0:
            parts |= {"learning": own, "average": mean}
        parts["optimizer"] = self.learner.optimizer_state()
        return {f"{part}/{name}": array for part, arrays in parts.items() for name, array in arrays.items()}

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave, and bring the learner there.

        Raises:
            CheckpointError: It belongs to another network.
        """
        self.learner.load_weights(below("weights/", state))
        if self.share > 0:
            mean = below("average/", state)
            kinds, expected = ({n: (a.shape, a.dtype) for n, a in p.items()} for p in (mean, self.learner.weights()))
            if kinds not in ({}, expected):
                raise CheckpointError("The averaged weights are not of the same network as the others.")
            self._mean = {name: array.copy() for name, array in mean.items()}
            self.learner.load_weights(below("learning/", state))
        self.learner.load_optimizer_state(below("optimizer/", state))
