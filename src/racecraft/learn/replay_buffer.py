"""The last steps of all cars, to learn from more than once: storage of off-policy algorithms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Transitions:
    """Samples of what happened, B of them."""

    observations: NDArray[np.uint8]
    """Encoded frames before the action  (B, *observation_shape)."""
    next_observations: NDArray[np.uint8]
    """Encoded frames after it  (B, *observation_shape); of no meaning where terminated."""
    states: NDArray[np.float32]
    """Privileged state before the action  (B, S)."""
    next_states: NDArray[np.float32]
    """The same after it  (B, S)."""
    actions: NDArray[np.float32]
    """In [-1, 1]  (B, A)."""
    rewards: NDArray[np.float32]
    """(B,)"""
    terminated: NDArray[np.bool_]
    """Nothing comes after  (B,)."""


class ReplayBuffer:
    """A ring of rows, each a step of N cars; every frame is stored once.

    The frame after a step is that of the next row, so the newest row cannot be sampled yet. Where an episode was
    truncated, the next row is already another episode: those steps are left out.

    Args:
        capacity: Steps of single cars it holds, at least two rows.
        num_envs: N.
        observation_shape: Of one encoded frame.
        state_size: S.
        action_size: A.
    """

    def __init__(
        self, capacity: int, *, num_envs: int, observation_shape: tuple[int, ...], state_size: int, action_size: int
    ) -> None:
        shape = (max(capacity // num_envs, 2), num_envs)
        self._observations = np.zeros((*shape, *observation_shape), np.uint8)  # pages are taken as they are written
        self._states = np.zeros((*shape, state_size), np.float32)
        self._actions = np.zeros((*shape, action_size), np.float32)
        self._rewards = np.zeros(shape, np.float32)
        self._terminated = np.zeros(shape, bool)
        self._truncated = np.zeros(shape, bool)
        self._count = 0  # rows added so far

    def __len__(self) -> int:
        """Steps that can be sampled, those left out included."""
        return max(min(self._count, len(self._rewards)) - 1, 0) * self._rewards.shape[1]

    def add(
        self,
        *,
        observations: NDArray[np.uint8],
        states: NDArray[np.float32],
        actions: NDArray[np.float32],
        rewards: NDArray[Any],
        terminated: NDArray[np.bool_],
        truncated: NDArray[np.bool_],
    ) -> None:
        """Store one step of every car; a car that is both is terminated."""
        row = self._count % len(self._rewards)
        self._observations[row], self._states[row], self._actions[row] = observations, states, actions
        self._rewards[row], self._terminated[row] = rewards, terminated
        self._truncated[row] = truncated & ~terminated
        self._count += 1

    def sample(self, size: int, rng: np.random.Generator) -> Transitions:
        """Draw steps, each as likely as any other."""
        length, cars = self._rewards.shape
        oldest = max(self._count - length, 0)
        rows = np.empty(0, np.int64)
        columns = np.empty(0, np.int64)
        while len(rows) < size:
            more = rng.integers(oldest, self._count - 1, size) % length
            others = rng.integers(0, cars, size)
            kept = ~self._truncated[more, others]
            rows, columns = np.append(rows, more[kept]), np.append(columns, others[kept])
            if not kept.any() and self._truncated.all():
                break
        rows, columns = rows[:size], columns[:size]
        following = (rows + 1) % length
        return Transitions(
            observations=self._observations[rows, columns],
            next_observations=self._observations[following, columns],
            states=self._states[rows, columns],
            next_states=self._states[following, columns],
            actions=self._actions[rows, columns],
            rewards=self._rewards[rows, columns],
            terminated=self._terminated[rows, columns],
        )
