"""A few steps of every world under one policy, and how much better each action was than expected.

    δ  = r + γ V(s') - V(s)                      how much better the step was than expected
    A  = δ + γ λ δ' + (γ λ)² δ'' + ...           the same over many steps (Schulman et al. 2016)

λ = 0 believes the critic at once (little variance, much bias), λ = 1 waits for what really happens (the opposite).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.network import Floats
from racecraft.classic.policy import ActorCritic
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True)
class Rollout:
    """T steps of N worlds, flat: B = T · N rows, later steps behind earlier ones."""

    observations: Floats
    """(B, size)."""
    actions: NDArray[Any]
    """(B, ...)."""
    advantages: Floats
    """A (B,)."""
    returns: Floats
    """A + V: what the critic should have said (B,)."""


def collect(
    worlds: Worlds,
    policy: ActorCritic,
    rng: np.random.Generator,
    *,
    length: int,
    gamma: float,
    gae_lambda: float,
    reward_scale: float = 1.0,
) -> Rollout:
    """Play `length` steps in every world; rewards are multiplied by a scale that makes returns of the size of one."""
    n, size = worlds.observations.shape
    observations, successors = np.zeros((length, n, size), np.float32), np.zeros((length, n, size), np.float32)
    rewards, is_going = np.zeros((length, n), np.float32), np.zeros((length, n), np.float32)
    is_over = np.zeros((length, n), np.bool_)
    actions = []
    for t in range(length):
        observations[t] = worlds.observations
        actions.append(policy.sample(worlds.observations, rng))
        step = worlds.step(actions[-1])
        rewards[t], is_going[t], is_over[t], successors[t] = step.rewards, ~step.terminated, step.over, step.successors

    values = policy.value(observations)
    surprise = reward_scale * rewards + gamma * is_going * policy.value(successors) - values
    advantages = accumulate(surprise, is_over, gamma * gae_lambda)
    acted = np.concatenate(actions)
    return Rollout(observations.reshape(-1, size), acted, advantages.reshape(-1), (advantages + values).reshape(-1))


def accumulate(surprise: Floats, is_over: NDArray[np.bool_], fade: float) -> Floats:
    """Sum up what comes after, faded, until the episode is over (T, N)."""
    advantages = np.zeros_like(surprise)
    following = np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + fade * np.where(is_over[t], 0.0, following)
        advantages[t] = following
    return advantages
