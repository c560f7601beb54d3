"""Deep Q-learning (Mnih et al. 2015): Q-learning with a network in place of the table.

    loss = huber( r + γ max Q'(s', ·) - Q(s, a) )

A network forgets what it does not see and chases its own tail, since what it learns moves what it learns from. Two
tricks hold it: steps are *replayed* from a memory in random order, and the future is asked of a *target* network Q'
that follows slowly. Setting ``memory`` to ``batch`` switches the first off, ``target_every`` to 1 the second.
Here the action of the maximum is chosen by Q and judged by Q' (van Hasselt et al. 2016): one network alone believes
whatever it overrates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from racecraft.classic.network import Adam, Network
from racecraft.classic.policy import Values
from racecraft.classic.replay import Memory
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds


@dataclass(frozen=True, kw_only=True)
class DQNSettings(Settings):
    """Of DQN."""

    num_envs: int = 4
    """Worlds that are played at once."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer."""
    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    learning_rate: float = 1e-3
    """Of Adam at the beginning; it falls evenly to nothing."""
    memory: int = 50_000
    """Steps that are remembered."""
    warm_up: int = 1000
    """Steps before anything is learned from them; a smaller memory need only be full."""
    batch: int = 64
    """Steps that one update looks at."""
    steps_per_update: int = 4
    """Steps of all worlds together for each update."""
    target_every: int = 250
    """Updates after which the target network is brought up to date."""
    epsilon: float = 1.0
    """Share of actions that are drawn by lot, at the beginning."""
    final_epsilon: float = 0.05
    """The same when exploration is done."""
    exploration: float = 0.2
    """Share of all steps over which it falls evenly."""
    hold: int = 1
    """Most steps that an action by lot is kept, so that exploration gets somewhere (Dabney et al. 2021)."""
    reward_scale: float = 1.0
    """Rewards are multiplied by this, so that values are of the size of surprises that Huber's loss still squares."""
    max_norm: float = 10.0
    """A longer gradient is cut to this length."""


def begin(worlds: Worlds, settings: DQNSettings, rng: np.random.Generator) -> Values:
    """A network with weights by lot."""
    sizes = (worlds.view.size, *settings.hidden, worlds.num_actions)
    return Values(Network(sizes, rng, activation="relu"))


def learn(worlds: Worlds, policy: Values, settings: DQNSettings, rng: np.random.Generator) -> Iterator[None]:
    """Act, remember, replay; yields after every step of all worlds."""
    network, actions_n = policy.network, worlds.num_actions
    target = Network((worlds.view.size, *settings.hidden, actions_n), rng, activation="relu")
    target.parameters[:] = network.parameters
    optimizer = Adam(network.parameters, settings.learning_rate, max_norm=settings.max_norm)
    memory = Memory(settings.memory, worlds.observations[0].shape, (), np.int64)
    rows = np.arange(settings.batch)
    updates, owed = 0, 0.0
    lots, held = np.zeros(worlds.num_envs, np.int64), np.zeros(worlds.num_envs, np.int64)

    while worlds.steps < settings.steps:
        seen = worlds.observations
        is_lot = (held == 0) & (rng.random(worlds.num_envs) < epsilon(settings, worlds.steps / settings.steps))
        lots = np.where(is_lot, rng.integers(actions_n, size=worlds.num_envs), lots)
        held = np.where(is_lot, rng.integers(1, settings.hold + 1, size=worlds.num_envs), held)
        actions = np.where(held > 0, lots, policy.act(seen))
        held = np.maximum(held - 1, 0)
        step = worlds.step(actions)
        memory.add(seen, actions, step)
        optimizer.learning_rate = settings.learning_rate * max(1.0 - worlds.steps / settings.steps, 0.0)

        is_warm = len(memory) >= min(settings.warm_up, settings.memory)
        owed += worlds.num_envs / settings.steps_per_update if is_warm else 0.0
        while owed >= 1.0:
            owed -= 1.0
            states, acted, rewards, terminated, successors = memory.sample(settings.batch, rng)
            best = np.argmax(network(successors), axis=1)
            future = np.where(terminated, 0.0, target(successors)[rows, best])
            values = network(states)
            surprise = settings.reward_scale * rewards + settings.gamma * future - values[rows, acted]

            gradient = np.zeros_like(values)
            gradient[rows, acted] = -np.clip(surprise, -1.0, 1.0) / settings.batch  # of Huber's loss
            optimizer.step(network.gradient(gradient))
            updates += 1
            if updates % settings.target_every == 0:
                target.parameters[:] = network.parameters
        yield


def epsilon(settings: DQNSettings, share: float) -> float:
    """ε when this share of the steps is done."""
    done = min(share / settings.exploration, 1.0) if settings.exploration > 0.0 else 1.0
    return settings.epsilon + done * (settings.final_epsilon - settings.epsilon)
