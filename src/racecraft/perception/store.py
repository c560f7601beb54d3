"""Pictures that the network learns from, remembered so that those of a minibatch have nothing to do with each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import NUM_TARGETS


class Store:
    """So many pictures with their targets; in a full one each new picture takes a random one's place.

    Args:
        size: How many.
        observation_shape: Of what the network sees of each.
    """

    def __init__(self, size: int, observation_shape: tuple[int, ...]) -> None:
        self._observations = np.zeros((size, *observation_shape), np.uint8)
        self._targets = np.zeros((size, NUM_TARGETS), np.float32)
        self._known = 0
        self.seen = 0
        """Pictures that were put in so far."""

    def put(self, observations: NDArray[np.uint8], targets: NDArray[np.float32], *, rng: np.random.Generator) -> None:
        """Remember pictures (B, ...) and their targets (B, NUM_TARGETS)."""
        count, size = len(targets), len(self._targets)
        free = np.arange(self._known, min(self._known + count, size))
        rows = np.concatenate([free, rng.integers(0, max(self._known, 1), count - len(free))])
        self._observations[rows], self._targets[rows] = observations, targets
        self._known += len(free)
        self.seen += count

    def draw(self, count: int, *, rng: np.random.Generator) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Copies of random pictures (B, ...) and their targets (B, NUM_TARGETS)."""
        rows = rng.integers(0, self._known, count)
        return self._observations[rows], self._targets[rows]
