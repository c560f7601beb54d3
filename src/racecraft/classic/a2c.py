"""Advantage actor-critic, A2C (Mnih et al. 2016): a policy and its critic learn from each other, a few steps at a time.

    actor:   ∇ log π(a | s) · A  +  β ∇ H(π(· | s))
    critic:  ∇ (V(s) - (A + V(s)))²

REINFORCE waits for an episode's end; here the critic says after a few steps what the rest is worth. Many worlds are
played at once, so that the steps of an update do not resemble each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from racecraft.classic.network import Adam, Floats
from racecraft.classic.policy import ActorCritic
from racecraft.classic.rollout import Rollout, collect
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True, kw_only=True)
class ActorCriticSettings(Settings):
    """Of A2C and A3C."""

    num_envs: int = 16
    """Worlds that are played at once (of A3C: in each process)."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer, of policy and critic."""
    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    gae_lambda: float = 0.95
    """λ: how long the advantage waits for what really happens."""
    learning_rate: float = 1e-3
    """Of both networks."""
    length: int = 8
    """Steps of every world for one update."""
    entropy: float = 0.01
    """β, weight of the entropy, which keeps the policy trying."""
    reward_scale: float = 1.0
    """Rewards are multiplied by it: a critic learns returns of the size of one soonest."""
    max_norm: float = 0.5
    """A longer gradient is cut to this length."""


def begin(worlds: Worlds, settings: ActorCriticSettings, rng: np.random.Generator) -> ActorCritic:
    """A policy that has no opinion, and its critic."""
    return ActorCritic(worlds.view.size, worlds.action_space, settings.hidden, rng)


def learn(
    worlds: Worlds, policy: ActorCritic, settings: ActorCriticSettings, rng: np.random.Generator
) -> Iterator[None]:
    """Play a few steps, improve both; yields after each update."""
    actor_optimizer = Adam(policy.actor.parameters, settings.learning_rate, max_norm=settings.max_norm)
    critic_optimizer = Adam(policy.critic.parameters, settings.learning_rate, max_norm=settings.max_norm)
    while worlds.steps < settings.steps:
        rollout = collect(
            worlds,
            policy,
            rng,
            length=settings.length,
            gamma=settings.gamma,
            gae_lambda=settings.gae_lambda,
            reward_scale=settings.reward_scale,
        )
        of_actor, of_critic = gradients(policy, rollout, settings)
        actor_optimizer.step(of_actor)
        critic_optimizer.step(of_critic)
        yield


def gradients(policy: ActorCritic, rollout: Rollout, settings: ActorCriticSettings) -> tuple[Floats, Floats]:
    """Of the loss of a rollout by all weights of the actor, and of the critic."""
    n = len(rollout.returns)
    advantages = (rollout.advantages - rollout.advantages.mean()) / (rollout.advantages.std() + 1e-8)
    outputs = policy.actor(rollout.observations)
    gradient = -advantages[:, None] * policy.distribution.log_prob_gradient(outputs, rollout.actions)
    gradient -= settings.entropy * policy.distribution.entropy_gradient(outputs)
    of_actor = policy.actor.gradient(gradient / n)
    error = policy.critic(rollout.observations) - rollout.returns[:, None]
    return of_actor, policy.critic.gradient(error / n)
