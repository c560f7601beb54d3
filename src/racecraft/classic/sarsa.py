"""SARSA (Rummery and Niranjan 1994): as Q-learning, but with the action that really comes next.

    Q(s, a)  <-  Q(s, a) + α [ r + γ Q(s', a') - Q(s, a) ]

State, action, reward, state, action: hence the name. It is on-policy: mistakes made on purpose count. Beside a cliff
it therefore keeps a distance, where Q-learning walks along the edge and falls now and then.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from racecraft.classic.policy import Table
from racecraft.classic.q_table import TableSettings, begin, epsilon, epsilon_greedy, follow, learning_rate
from racecraft.classic.worlds import Worlds

__all__ = ["TableSettings", "begin", "learn"]


def learn(worlds: Worlds, policy: Table, settings: TableSettings, rng: np.random.Generator) -> Iterator[None]:
    """Fill the table, a step of every world at a time; yields after each."""
    values, gamma = policy.values, settings.gamma
    actions = epsilon_greedy(values[worlds.observations], epsilon(settings, 0.0), rng)
    while worlds.steps < settings.steps:
        share = worlds.steps / settings.steps
        states = worlds.observations
        step = worlds.step(actions)

        next_actions = epsilon_greedy(values[step.successors], epsilon(settings, share), rng)
        future = np.where(step.terminated, 0.0, values[step.successors, next_actions])
        surprise = step.rewards + gamma * future - values[states, actions]
        follow(values, states, actions, learning_rate(settings, share) * surprise)

        actions = next_actions
        if step.over.any():  # a new episode, a new choice
            fresh = epsilon_greedy(values[worlds.observations], epsilon(settings, share), rng)
            actions = np.where(step.over, fresh, next_actions)
        yield
