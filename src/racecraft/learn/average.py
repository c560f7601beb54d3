"""The mean of the weights over the last part of a training: what drives evaluations and is saved.

Large steps make a policy learn fast and leave it restless: one evaluation is perfect and the next one is not. Its
mean over a while is what it would be with small steps, at no cost in speed. The while grows with the training
(https://arxiv.org/abs/1212.1824, polynomial-decay averaging), so nothing has to be known of how long it will take.
"""

from __future__ import annotations

import numpy as np

from racecraft.errors import CheckpointError
from racecraft.learn.learner import Weights


class WeightAverage:
    """A running mean of weights.

    Args:
        share: About which share of the iterations so far it covers, above 0, up to 1.
    """

    def __init__(self, share: float) -> None:
        self.share = share
        self._weights: Weights = {}

    def add(self, weights: Weights, *, iteration: int) -> None:
        """Count the weights after this iteration, from 1; takes hold of the arrays."""
        part = 1.0 / (1.0 + self.share * (iteration - 1)) if self._weights else 1.0
        if part == 1.0:
            self._weights = weights
            return
        for name, mean in self._weights.items():
            mean += (weights[name] - mean) * np.float32(part)

    def weights(self) -> Weights:
        """The mean so far; not to be changed."""
        return self._weights

    def load(self, weights: Weights, *, like: Weights) -> None:
        """Continue from what ``weights`` gave.

        Raises:
            CheckpointError: They are of another network than `like`.
        """
        shapes, expected = ({name: array.shape for name, array in part.items()} for part in (weights, like))
        if shapes not in ({}, expected):
            raise CheckpointError("The averaged weights are not of the same network as the others.")
        self._weights = {name: np.array(array, np.float32) for name, array in weights.items()}
