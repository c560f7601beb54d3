"""Storage of one rollout, and the advantages computed from it.

One step of one car is: see the observation of a pose, act, receive the reward and whether the episode ended
there. It ends in two ways that must not be confused. *Terminated*: nothing comes after, the return stops.
*Truncated*: the car could have driven on and only the clock ran out, so the critic's value of the pose it
reached stands in for the rest.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Rollout:
    """Preallocated arrays of T steps by N cars, filled in order.

    Args:
        num_steps: T.
        num_envs: N.
        observation_shape: Shape of one encoded frame.
        state_size: S, columns of privileged state.
        action_size: 0 for discrete actions (int64 indices), else A (float32).
        observation_dtype: Of encoded frames; a learner without a camera has others.
    """

    def __init__(
        self,
        num_steps: int,
        *,
        num_envs: int,
        observation_shape: tuple[int, ...],
        state_size: int,
        action_size: int,
        observation_dtype: type = np.uint8,
    ) -> None:
        shape = (num_steps, num_envs)
        self.observations: NDArray[Any] = np.zeros((*shape, *observation_shape), observation_dtype)
        self.states = np.zeros((*shape, state_size), np.float32)
        self.actions: NDArray[Any] = (
            np.zeros((*shape, action_size), np.float32) if action_size else np.zeros(shape, np.int64)
        )
        self.log_probs = np.zeros(shape, np.float32)
        self.rewards = np.zeros(shape, np.float32)
        self.terminated = np.zeros(shape, bool)
        self.truncated = np.zeros(shape, bool)
        self.is_valid = np.zeros(shape, bool)  # False where a car only waited for the others
        self.values = np.zeros(shape, np.float32)
        self.next_values = np.zeros(shape, np.float32)  # value of the pose after the step, where `bootstrap` put one
        self.num_steps = 0  # rows filled so far

    def clear(self) -> None:
        """Start again at the first row."""
        self.num_steps = 0
        self.next_values[:] = 0.0

    def add(
        self,
        *,
        observations: NDArray[np.uint8],
        states: NDArray[np.float32],
        actions: NDArray[Any],
        log_probs: NDArray[np.float32],
        is_valid: NDArray[np.bool_] | bool = True,
    ) -> None:
        """Store what was seen and done in the next row; its outcome follows by ``finish``."""
        t = self.num_steps
        self.observations[t], self.states[t] = observations, states
        self.actions[t], self.log_probs[t], self.is_valid[t] = actions, log_probs, is_valid
        self.num_steps += 1

    def finish(
        self,
        *,
        rewards: NDArray[np.floating[Any]],
        terminated: NDArray[np.bool_],
        truncated: NDArray[np.bool_],
    ) -> None:
        """Store the outcome of the row added last; a car that is both is terminated."""
        t = self.num_steps - 1
        self.rewards[t], self.terminated[t], self.truncated[t] = rewards, terminated, truncated & ~terminated

    def advantages(self, *, gamma: float, gae_lambda: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Generalised advantage estimates and returns of the filled rows, each (T, N).

        ``values`` must be filled, ``next_values`` wherever a step was truncated and in each car's last row.
        """
        rows = slice(0, self.num_steps)
        return generalized_advantages(
            rewards=self.rewards[rows],
            values=self.values[rows],
            next_values=self.next_values[rows],
            terminated=self.terminated[rows],
            truncated=self.truncated[rows],
            gamma=gamma,
            gae_lambda=gae_lambda,
        )


def generalized_advantages(
    *,
    rewards: NDArray[np.float32],
    values: NDArray[np.float32],
    next_values: NDArray[np.float32],
    terminated: NDArray[np.bool_],
    truncated: NDArray[np.bool_],
    gamma: float,
    gae_lambda: float,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Generalised advantages, https://arxiv.org/abs/1506.02438, with the two ends of an episode apart.

    Args:
        rewards: Reward of each step  (T, N).
        values: Critic's value of the observation each step acted on  (T, N).
        next_values: Value of what a step led to, read only in the last row and where truncated  (T, N).
        terminated: The step ended its episode for good: nothing is bootstrapped  (T, N).
        truncated: The step cut its episode: ``next_values`` is bootstrapped, a new episode follows  (T, N).
        gamma: Discount per step.
        gae_lambda: 0 trusts the critic after one step, 1 trusts only the rewards.

    Returns:
        Advantages and returns (advantage + value), each (T, N).
    """
    num_steps = len(rewards)
    advantages = np.zeros_like(rewards)
    carried = np.zeros(rewards.shape[1:], np.float32)
    for t in reversed(range(num_steps)):
        following = next_values[t] if t == num_steps - 1 else np.where(truncated[t], next_values[t], values[t + 1])
        delta = rewards[t] + gamma * np.where(terminated[t], 0.0, following) - values[t]
        carried = delta + gamma * gae_lambda * np.where(terminated[t] | truncated[t], 0.0, carried)
        advantages[t] = carried
    return advantages, advantages + values
