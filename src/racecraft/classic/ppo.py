"""Proximal policy optimisation, PPO (Schulman et al. 2017): use every rollout several times, but do not go too far.

    ratio = π(a | s) / π_old(a | s)
    loss  = -min( ratio · A,  clip(ratio, 1 - ε, 1 + ε) · A )  -  β H(π)

A rollout tells of the policy that played it. Once the policy has moved by ε for an action in the direction of its
advantage, the minimum is flat there: nothing more is to be gained from believing old news.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from racecraft.classic.network import Adam, Floats
from racecraft.classic.policy import ActorCritic
from racecraft.classic.rollout import collect
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True, kw_only=True)
class PPOSettings(Settings):
    """Of PPO."""

    num_envs: int = 8
    """Worlds that are played at once."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer, of policy and critic."""
    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    gae_lambda: float = 0.95
    """λ: how long the advantage waits for what really happens."""
    learning_rate: float = 1e-3
    """Of both networks at the beginning; it falls evenly to nothing."""
    length: int = 64
    """Steps of every world in a rollout."""
    epochs: int = 6
    """Times that every rollout is used."""
    batch: int = 128
    """Steps that one update looks at."""
    clip: float = 0.2
    """ε: how far the ratio may go."""
    entropy: float = 0.0
    """β, weight of the entropy, which keeps the policy trying."""
    reward_scale: float = 1.0
    """Rewards are multiplied by it: a critic learns returns of the size of one soonest."""
    max_norm: float = 0.5
    """A longer gradient is cut to this length."""


def begin(worlds: Worlds, settings: PPOSettings, rng: np.random.Generator) -> ActorCritic:
    """A policy that has no opinion, and its critic."""
    return ActorCritic(worlds.view.size, worlds.action_space, settings.hidden, rng)


def learn(worlds: Worlds, policy: ActorCritic, settings: PPOSettings, rng: np.random.Generator) -> Iterator[None]:
    """Play a rollout, use it several times; yields after each."""
    actor, critic, distribution = policy.actor, policy.critic, policy.distribution
    actor_optimizer = Adam(actor.parameters, settings.learning_rate, max_norm=settings.max_norm)
    critic_optimizer = Adam(critic.parameters, settings.learning_rate, max_norm=settings.max_norm)
    while worlds.steps < settings.steps:
        rate = settings.learning_rate * max(1.0 - worlds.steps / settings.steps, 0.0)
        actor_optimizer.learning_rate = critic_optimizer.learning_rate = rate
        rollout = collect(
            worlds,
            policy,
            rng,
            length=settings.length,
            gamma=settings.gamma,
            gae_lambda=settings.gae_lambda,
            reward_scale=settings.reward_scale,
        )
        old = distribution.log_prob(actor(rollout.observations), rollout.actions)
        for _ in range(settings.epochs):
            order = rng.permutation(len(old))
            for start in range(0, len(old), settings.batch):
                rows = order[start : start + settings.batch]
                seen, acted, n = rollout.observations[rows], rollout.actions[rows], len(rows)
                advantages = rollout.advantages[rows]
                advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)

                outputs = actor(seen)
                ratio = np.exp(distribution.log_prob(outputs, acted) - old[rows])
                by_log_prob = -clipped(ratio, advantages, settings.clip) * ratio
                gradient = by_log_prob[:, None] * distribution.log_prob_gradient(outputs, acted)
                gradient -= settings.entropy * distribution.entropy_gradient(outputs)
                actor_optimizer.step(actor.gradient(gradient / n))

                error = critic(seen) - rollout.returns[rows, None]
                critic_optimizer.step(critic.gradient(error / n))
        yield


def clipped(ratio: Floats, advantages: Floats, clip: float) -> Floats:
    """Derivative of ``min(ratio A, clip(ratio) A)`` by the ratio: A, or 0 where the policy has gone far enough (B,)."""
    has_gone = np.where(advantages > 0.0, ratio > 1.0 + clip, ratio < 1.0 - clip)
    return np.where(has_gone, 0.0, advantages)
