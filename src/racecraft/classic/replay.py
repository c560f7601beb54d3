"""A memory of steps, from which batches are drawn in random order: the newest takes the oldest one's place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.network import Floats
from racecraft.classic.worlds import Step

Batch = tuple[Floats, NDArray[Any], Floats, NDArray[np.bool_], Floats]
"""Observations (B, size), actions (B, ...), rewards (B,), terminated (B,), successors (B, size)."""


class Memory:
    """Steps of all worlds.

    Args:
        capacity: Steps.
        seen: Shape of an observation.
        acted: Shape of an action.
        kind: Type of an action's numbers.
    """

    def __init__(self, capacity: int, seen: tuple[int, ...], acted: tuple[int, ...], kind: type[Any]) -> None:
        self._observations = np.zeros((capacity, *seen), np.float32)
        self._successors = np.zeros((capacity, *seen), np.float32)
        self._actions = np.zeros((capacity, *acted), kind)
        self._rewards = np.zeros(capacity, np.float32)
        self._terminated = np.zeros(capacity, np.bool_)
        self._added = 0

    def __len__(self) -> int:
        """Steps that are remembered."""
        return min(self._added, len(self._rewards))

    def add(self, observations: Floats, actions: NDArray[Any], step: Step) -> None:
        """Remember a step of every world (N, ...)."""
        places = (self._added + np.arange(len(actions))) % len(self._rewards)
        self._observations[places] = observations
        self._actions[places] = actions
        self._rewards[places] = step.rewards
        self._terminated[places] = step.terminated
        self._successors[places] = step.successors
        self._added += len(actions)

    def sample(self, size: int, rng: np.random.Generator) -> Batch:
        """So many steps, drawn with replacement."""
        places = rng.integers(len(self), size=size)
        return (
            self._observations[places],
            self._actions[places],
            self._rewards[places],
            self._terminated[places],
            self._successors[places],
        )
