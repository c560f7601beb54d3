"""Soft actor-critic, SAC (Haarnoja et al. 2018): for actions that are numbers; earn much, and stay undecided.

    critic:  (Q(s, a) - [ r + γ (min Q'(s', a') - α log π(a' | s')) ])²
    actor:   α log π(a | s) - min Q(s, a)          with  a = tanh(mean + std · noise)
    α:       so that the entropy stays near a target

As in DQN steps are replayed and targets follow slowly. The actor does not wait for luck: the critic tells by its
derivative in which direction an action gets better. Two critics are asked and the more modest one is believed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.network import Adam, Floats, Network
from racecraft.classic.replay import Memory
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds

LOG_STD = (-5.0, 2.0)
"""Between these the standard deviation is kept, as a logarithm."""


@dataclass(frozen=True, kw_only=True)
class SACSettings(Settings):
    """Of SAC."""

    num_envs: int = 1
    """Worlds that are played at once."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of each hidden layer, of the actor and of each critic."""
    gamma: float = 0.99
    """Discount: a reward that comes a step later counts this much of one that comes now."""
    learning_rate: float = 1e-3
    """Of all networks and of α."""
    memory: int = 100_000
    """Steps that are remembered."""
    warm_up: int = 500
    """Steps by lot before anything is learned; a smaller memory need only be full."""
    batch: int = 128
    """Steps that one update looks at."""
    steps_per_update: int = 1
    """Steps of all worlds together for each update."""
    smoothing: float = 0.01
    """Share by which the target critics follow with each update."""
    reward_scale: float = 1.0
    """Rewards are multiplied by it, so that values are of the size of a network's outputs."""


class SquashedActor:
    """The actor and its critics; actions lie in -1 .. 1."""

    def __init__(self, inputs: int, actions: int, hidden: tuple[int, ...], rng: np.random.Generator) -> None:
        self.actor = Network((inputs, *hidden, 2 * actions), rng, activation="relu", gain=0.01)
        self.critics = [Network((inputs + actions, *hidden, 1), rng, activation="relu") for _ in range(2)]
        self.log_alpha = np.zeros(1, np.float32)
        self.arrays: Mapping[str, NDArray[Any]] = {
            "actor": self.actor.parameters,
            "critic_0": self.critics[0].parameters,
            "critic_1": self.critics[1].parameters,
            "log_alpha": self.log_alpha,
        }

    def act(self, observations: NDArray[Any]) -> NDArray[Any]:
        """The middle of the distribution (N, A)."""
        outputs = self.actor(observations)
        return np.tanh(outputs[:, : outputs.shape[1] // 2])

    def draw(self, observations: Floats, noise: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Actions for given normal noise, their log-probability, standard deviations, and where those are free."""
        mean, raw = np.split(self.actor(observations), 2, axis=1)
        log_std = np.clip(raw, *LOG_STD)
        std = np.exp(log_std)
        actions = np.tanh(mean + std * noise)
        logs = -0.5 * noise * noise - log_std - 0.5 * np.log(2.0 * np.pi) - np.log(1.0 - actions**2 + 1e-6)
        return actions, logs.sum(axis=1), std, (raw > LOG_STD[0]) & (raw < LOG_STD[1])


def begin(worlds: Worlds, settings: SACSettings, rng: np.random.Generator) -> SquashedActor:
    """An actor that has no opinion, and critics with weights by lot."""
    return SquashedActor(worlds.view.size, worlds.num_actions, settings.hidden, rng)


def learn(worlds: Worlds, policy: SquashedActor, settings: SACSettings, rng: np.random.Generator) -> Iterator[None]:
    """Act, remember, replay; yields after every step of all worlds."""
    n, size = worlds.num_actions, worlds.view.size
    memory = Memory(settings.memory, (size,), (n,), np.float32)
    targets = [Network((size + n, *settings.hidden, 1), rng, activation="relu") for _ in policy.critics]
    for target, critic in zip(targets, policy.critics, strict=True):
        target.parameters[:] = critic.parameters
    actor_optimizer = Adam(policy.actor.parameters, settings.learning_rate)
    critic_optimizers = [Adam(critic.parameters, settings.learning_rate) for critic in policy.critics]
    alpha_optimizer = Adam(policy.log_alpha, settings.learning_rate)
    is_fresh, owed = worlds.steps == 0, 0.0

    while worlds.steps < settings.steps:
        seen = worlds.observations
        noise = rng.standard_normal((worlds.num_envs, n), np.float32)
        is_warm = len(memory) >= min(settings.warm_up, settings.memory)
        actions = policy.draw(seen, noise)[0]
        if is_fresh and not is_warm:
            actions = rng.uniform(-1.0, 1.0, (worlds.num_envs, n)).astype(np.float32)
        memory.add(seen, actions, worlds.step(actions))

        owed += worlds.num_envs / settings.steps_per_update if is_warm else 0.0
        while owed >= 1.0:
            owed -= 1.0
            states, acted, rewards, terminated, successors = memory.sample(settings.batch, rng)
            alpha = float(np.exp(policy.log_alpha[0]))

            drawn, logs, _, _ = policy.draw(successors, rng.standard_normal(acted.shape, np.float32))
            following = np.hstack([successors, drawn])
            modest = np.minimum(*(target(following)[:, 0] for target in targets)) - alpha * logs
            goal = settings.reward_scale * rewards + settings.gamma * np.where(terminated, 0.0, modest)
            pairs = np.hstack([states, acted])
            for critic, optimizer in zip(policy.critics, critic_optimizers, strict=True):
                error = critic(pairs) - goal[:, None]
                optimizer.step(critic.gradient(error / settings.batch))

            of_actor, logs = actor_gradient(policy, states, rng.standard_normal(acted.shape, np.float32))
            actor_optimizer.step(of_actor)
            alpha_optimizer.step(np.array([-(logs.mean() - n)], np.float32))  # the target entropy is -n nats
            for target, critic in zip(targets, policy.critics, strict=True):
                target.parameters += settings.smoothing * (critic.parameters - target.parameters)
        yield


def actor_gradient(policy: SquashedActor, states: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Of mean(α log π - min Q) by the actor's weights, with the noise held; and the log-probabilities (B,)."""
    alpha, batch = float(np.exp(policy.log_alpha[0])), len(states)
    actions, logs, std, is_free = policy.draw(states, noise)
    pairs = np.hstack([states, actions])
    first, second = (critic(pairs) for critic in policy.critics)
    is_first = first <= second
    of_action = -(
        policy.critics[0].input_gradient(is_first.astype(np.float32))
        + policy.critics[1].input_gradient((~is_first).astype(np.float32))
    )[:, states.shape[1] :]
    slope = 1.0 - actions**2  # of tanh
    of_action += alpha * 2.0 * actions / (slope + 1e-6)  # of -log(1 - a²)
    by_mean = of_action * slope
    by_log_std = (by_mean * noise * std - alpha) * is_free
    return policy.actor.gradient(np.hstack([by_mean, by_log_std]) / batch), logs
