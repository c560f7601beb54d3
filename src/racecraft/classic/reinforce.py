"""REINFORCE with a baseline (Williams 1992): make what went well likelier.

    gradient = E[ ∇ log π(a | s) · (G - b(s)) ]

G is what an episode brought from here on. Without b the estimate is right on average and of no use: everything that
happens in a good episode is praised. The baseline b(s), an estimate of G, leaves only what went better than expected;
that changes no expectation, since it does not depend on the action, and most of the variance is gone.
Nothing here approximates a value function in order to act: the policy is what is learned.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from racecraft.classic.network import Adam, Floats
from racecraft.classic.policy import ActorCritic
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True, kw_only=True)
class ReinforceSettings(Settings):
    """Of REINFORCE."""

    num_envs: int = 8
    """Worlds that are played at once."""
    hidden: tuple[int, ...] = (32,)
    """Units of each hidden layer, of the policy and of the baseline."""
    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    learning_rate: float = 1e-2
    """Of the policy's Adam."""
    critic_learning_rate: float = 1e-2
    """Of the baseline's Adam."""
    episodes: int = 8
    """Finished episodes that one update looks at."""
    has_baseline: bool = True
    """Without one, the mean return of the batch is all that is subtracted."""
    entropy: float = 0.0
    """Weight of the entropy, which keeps the policy trying."""


def begin(worlds: Worlds, settings: ReinforceSettings, rng: np.random.Generator) -> ActorCritic:
    """A policy that has no opinion, and its baseline."""
    return ActorCritic(worlds.view.size, worlds.action_space, settings.hidden, rng)


def learn(worlds: Worlds, policy: ActorCritic, settings: ReinforceSettings, rng: np.random.Generator) -> Iterator[None]:
    """Play whole episodes, then improve; yields after every step of all worlds."""
    actor_optimizer = Adam(policy.actor.parameters, settings.learning_rate)
    critic_optimizer = Adam(policy.critic.parameters, settings.critic_learning_rate)
    playing = [Episode() for _ in range(worlds.num_envs)]
    finished: list[Episode] = []

    while worlds.steps < settings.steps:
        seen = worlds.observations
        actions = policy.sample(seen, rng)
        step = worlds.step(actions)
        for world, episode in enumerate(playing):
            episode.observations.append(seen[world])
            episode.actions.append(actions[world])
            episode.rewards.append(float(step.rewards[world]))
        for world in np.flatnonzero(step.over).tolist():
            # a time limit is not the end of the world: what would have come is estimated
            last = 0.0 if step.terminated[world] or not settings.has_baseline else policy.value(step.successors[world])
            playing[world].tail = float(last)
            finished.append(playing[world])
            playing[world] = Episode()
        if len(finished) < settings.episodes:
            yield
            continue

        observations = np.array([seen for episode in finished for seen in episode.observations])
        acted = np.array([action for episode in finished for action in episode.actions])
        returns = np.concatenate([episode.returns(settings.gamma) for episode in finished])
        finished.clear()

        baseline = policy.value(observations) if settings.has_baseline else returns.mean()
        praise = returns - baseline
        praise /= praise.std() + 1e-8
        outputs, n = policy.actor(observations), len(returns)
        gradient = -praise[:, None] * policy.distribution.log_prob_gradient(outputs, acted)
        gradient -= settings.entropy * policy.distribution.entropy_gradient(outputs)
        actor_optimizer.step(policy.actor.gradient(gradient / n))
        if settings.has_baseline:
            for _ in range(BASELINE_UPDATES):
                error = policy.critic(observations)[:, 0] - returns
                critic_optimizer.step(policy.critic.gradient(error[:, None] / n))
        yield


BASELINE_UPDATES = 5
"""A baseline that lags behind helps little, and to fit it is cheap."""


class Episode:
    """What happened in one world since it began."""

    def __init__(self) -> None:
        self.observations: list[Floats] = []
        self.actions: list[object] = []
        self.rewards: list[float] = []
        self.tail = 0.0
        """What would have come after a time limit."""

    def returns(self, gamma: float) -> Floats:
        """G at every step: its reward, and what came after it, discounted (T,)."""
        returns = np.zeros(len(self.rewards), np.float32)
        following = self.tail
        for t in reversed(range(len(self.rewards))):
            following = returns[t] = self.rewards[t] + gamma * following
        return returns
