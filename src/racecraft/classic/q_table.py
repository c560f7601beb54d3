"""Q-learning (Watkins 1989): a table of what every action is worth in every state.

    Q(s, a)  <-  Q(s, a) + α [ r + γ max Q(s', ·) - Q(s, a) ]

The bracket is the surprise: what the step turned out to be worth, less what the table said. The maximum asks for the
*best* next action, whatever is done next: Q-learning is off-policy. It learns what a perfect driver would earn while it
still makes mistakes on purpose.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.policy import Table
from racecraft.classic.settings import Settings
from racecraft.classic.views import Cut
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True, kw_only=True)
class TableSettings(Settings):
    """Of Q-learning and SARSA."""

    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    learning_rate: float = 0.1
    """α at the beginning: share of a surprise that the table takes over."""
    final_learning_rate: float = 0.1
    """α at the end; between them it falls evenly."""
    epsilon: float = 1.0
    """Share of actions that are drawn by lot, at the beginning: exploration."""
    final_epsilon: float = 0.05
    """The same when exploration is done."""
    exploration: float = 0.5
    """Share of all steps over which it falls evenly."""
    initial: float = 0.0
    """What the table says at first; optimism makes it try everything."""
    bins: int = 10
    """Intervals of each number of an observation that is not a choice already."""
    cuts: tuple[Cut, ...] = ()
    """Where numbers are cut instead."""


def begin(worlds: Worlds, settings: TableSettings, rng: np.random.Generator) -> Table:
    """A table that knows nothing."""
    return Table(worlds.view.size, worlds.num_actions, initial=settings.initial)


def learn(worlds: Worlds, policy: Table, settings: TableSettings, rng: np.random.Generator) -> Iterator[None]:
    """Fill the table, a step of every world at a time; yields after each."""
    values, gamma = policy.values, settings.gamma
    while worlds.steps < settings.steps:
        share = worlds.steps / settings.steps
        states = worlds.observations
        actions = epsilon_greedy(values[states], epsilon(settings, share), rng)
        step = worlds.step(actions)

        future = np.where(step.terminated, 0.0, values[step.successors].max(axis=1))
        surprise = step.rewards + gamma * future - values[states, actions]
        follow(values, states, actions, learning_rate(settings, share) * surprise)
        yield


def follow(
    values: NDArray[np.float64], states: NDArray[np.int64], actions: NDArray[np.int64], steps: NDArray[np.float64]
) -> None:
    """Move the table in place, a step for each of N worlds; worlds that did the same in one cell move it by their mean.

    ``values[states, actions] += steps`` would keep the last of them only, and their sum would go too far.
    """
    if len(states) == 1:  # what follows would take a third of the time that learning in one world takes
        values[states, actions] += steps
        return
    cells, cell_of, visitors = np.unique(states * values.shape[1] + actions, return_inverse=True, return_counts=True)
    values.reshape(-1)[cells] += np.bincount(cell_of, steps) / visitors


def epsilon_greedy(values: NDArray[np.float64], epsilon: float, rng: np.random.Generator) -> NDArray[np.int64]:
    """The best action of each row (N, actions), or with probability ε any."""
    n, actions = values.shape
    is_lot = rng.random(n) < epsilon
    return np.where(is_lot, rng.integers(actions, size=n), values.argmax(axis=1))


def epsilon(settings: TableSettings, share: float) -> float:
    """ε when this share of the steps is done."""
    done = min(share / settings.exploration, 1.0) if settings.exploration > 0.0 else 1.0
    return settings.epsilon + done * (settings.final_epsilon - settings.epsilon)


def learning_rate(settings: TableSettings, share: float) -> float:
    """α when this share of the steps is done."""
    return settings.learning_rate + share * (settings.final_learning_rate - settings.learning_rate)
