"""Soft actor-critic, top to bottom: drive, remember, and after every few steps improve critics, actor, temperature.

    environment ──frames, state──▶ act ──▶ ReplayBuffer ──sample──▶ update ──▶ new weights

https://arxiv.org/abs/1801.01290, with the temperature learned (https://arxiv.org/abs/1812.05905) or fixed as AWS's. Two
critics judge an action; the smaller judgement counts. As everywhere here the actor sees the camera alone, and the
critics see the simulator's state while training, or the camera as AWS's do. Continuous actions only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_flag, check_number, check_whole, require
from racecraft.errors import CheckpointError, ConfigError, TrainingError
from racecraft.learn.learner import Learner, NetworkSpec, UpdateStats, Weights, below
from racecraft.learn.ledger import Ended, EpisodeLedger
from racecraft.learn.ppo import Environment, IterationStats
from racecraft.learn.replay_buffer import ReplayBuffer, Transitions


@dataclass(frozen=True, kw_only=True)
class SACConfig:
    """Settings of SAC."""

    num_envs: int = 16
    """Cars driven at once."""
    num_steps: int = 32
    """Steps of each car in one iteration."""
    learning_rate: float = 1e-3
    """Adam's step size, of actor, critics and temperature."""
    gamma: float = 0.98
    """Discount per step of 1/15 s."""
    tau: float = 0.02
    """How far the target critics move towards the critics with every update; AWS copies them, which is 1."""
    minibatch_size: int = 128
    """Steps of one update."""
    buffer_size: int = 50_000
    """Steps that are remembered; one takes 4 kB with the default network."""
    learning_starts: int = 1_000
    """Steps driven at random before the first update."""
    updates_per_step: float = 0.125
    """Updates for every step of a car; AWS makes one."""
    policy_frequency: int = 2
    """Updates of the critics for every one of the actor."""
    alpha: float = 0.2
    """Weight of the entropy; where it is learned, the first."""
    learns_alpha: bool = True
    """Whether the temperature is learned, so that the entropy stays at minus one nat for every action dimension."""
    normalize_rewards: bool = True
    """Divide rewards by the running spread of the discounted return, so that they may have any scale."""

    def __post_init__(self) -> None:
        """Refuse what cannot work, naming the field."""
        for name in ("num_envs", "num_steps", "minibatch_size", "buffer_size", "policy_frequency", "learning_starts"):
            check_whole(name, getattr(self, name), 1, is_plain=True)
        for name in ("learning_rate", "gamma", "tau", "alpha"):
            check_number(name, getattr(self, name), 0.0, 1.0, is_plain=True)
        check_number("updates_per_step", self.updates_per_step, 0.0, 64.0, is_plain=True)
        require("updates_per_step", self.updates_per_step, self.updates_per_step > 0, "a number above 0")
        for name in ("learns_alpha", "normalize_rewards"):
            check_flag(name, getattr(self, name))
        is_enough = self.buffer_size >= 2 * self.num_envs
        require("buffer_size", self.buffer_size, is_enough, "at least two steps of every car")


class Backend(Protocol):
    """The networks and their gradients; see `racecraft.learn.torch_sac`."""

    def act(self, observations: NDArray[np.uint8], noise: NDArray[np.float64]) -> NDArray[np.float32]:
        """Actions in [-1, 1] drawn with standard normals (N, A)."""

    def update(self, batch: Transitions, noise: NDArray[np.float64], *, improves_actor: bool) -> UpdateStats:
        """One step of Adam of the critics, and of actor and temperature; changes nothing where it is not finite.

        Args:
            batch: B transitions with rewards in the critics' unit.
            noise: Standard normals  (2, B, A), for the next actions and for the actor's.
            improves_actor: Whether actor and temperature learn, too.
        """

    def driving_weights(self) -> Weights:
        """The actor, as a policy of ``NetworkSpec(is_squashed=True)`` has it: no critic."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Parameters and optimisers."""

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave; CheckpointError where it does not fit."""


class SAC:
    """The algorithm and its place in training; a `racecraft.learn.Algorithm`.

    Args:
        config: Settings.
        backend: The networks that learn.
        learner: Drives evaluations with the actor's weights.
        environment: The cars; must have ``config.num_envs`` of them, at the start of an episode.
        seed: Decides all sampling, together with the number of the iteration.

    Raises:
        ConfigError: The settings do not fit the learner or the environment.
    """

    def __init__(
        self, config: SACConfig, backend: Backend, learner: Learner, environment: Environment, *, seed: int = 0
    ) -> None:
        spec = learner.spec
        is_driven = config.num_envs == environment.num_envs
        require("num_envs", config.num_envs, is_driven, f"the environment's {environment.num_envs}")
        if spec.is_discrete or not spec.is_squashed:
            raise ConfigError("SAC needs continuous actions.", hint="Choose continuous actions (--actions continuous).")
        self.config, self.backend, self.learner, self.environment = config, backend, learner, environment
        self.seed = seed
        self.iteration = 0
        self.total_steps = 0
        self.prefers_average = False
        self._state_size = environment.observe()[1].shape[1]
        self._buffer = ReplayBuffer(
            config.buffer_size,
            num_envs=config.num_envs,
            observation_shape=learner.observation_shape,
            state_size=self._state_size,
            action_size=spec.num_actions,
        )
        self._owed = 0.0  # updates, as a fraction of one is carried over
        self._num_updates = 0
        self._returns = np.zeros(config.num_envs)  # discounted, so far, for the rewards' unit
        self._moments = np.zeros(3)  # count, mean and sum of squared deviations of those returns
        self._ledger = EpisodeLedger(config.num_envs)

    @property
    def spec(self) -> NetworkSpec:
        """The network that drives."""
        return self.learner.spec

    def iterate(self) -> IterationStats:
        """Drive ``num_steps`` steps of every car, learning in between.

        Raises:
            TrainingError: Loss or gradient is not finite; the weights are those of before that gradient step.
        """
        rng = np.random.default_rng([self.seed, self.iteration])
        clocks = {"environment": 0.0, "policy": 0.0, "update": 0.0}
        ended: list[Ended] = []
        stats: list[UpdateStats] = []
        for _ in range(self.config.num_steps):
            started = time.perf_counter()
            frames, states = self.environment.observe()
            observations, states = self.learner.encode(frames), states.copy()
            actions = self._act(observations, rng)
            acted = time.perf_counter()
            rewards, terminated, truncated = self.environment.step(actions)
            self._buffer.add(
                observations=observations,
                states=states,
                actions=actions,
                rewards=rewards,
                terminated=terminated,
                truncated=truncated,
            )
            done = terminated | truncated
            self._count(rewards, done)
            ended += self._ledger.add(rewards, done)
            if done.any():
                self.environment.reset(done)
            stepped = time.perf_counter()
            stats += self._learn(rng)
            clocks["policy"] += acted - started
            clocks["environment"] += stepped - acted
            clocks["update"] += time.perf_counter() - stepped
        self.iteration += 1
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=self.config.num_steps * self.config.num_envs,
            ended=tuple(ended),
            losses=UpdateStats.mean(stats),
            explained_variance=float("nan"),
            environment_seconds=clocks["environment"],
            policy_seconds=clocks["policy"],
            update_seconds=clocks["update"],
        )

    @contextmanager
    def driving(self) -> Iterator[None]:
        """Within, the learner holds the actor."""
        self.learner.load_weights({**self.learner.weights(), **self.backend.driving_weights()})
        yield

    # ---- one step

    def _act(self, observations: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.float32]:
        shape = (len(observations), self.spec.num_actions)
        if self.total_steps < self.config.learning_starts:
            return rng.uniform(-1.0, 1.0, shape).astype(np.float32)
        actions = self.backend.act(observations, rng.standard_normal(shape))
        if not np.isfinite(actions).all():
            raise TrainingError(
                "The policy's outputs are not finite.", hint="Lower learning_rate, or check the reward."
            )
        return actions

    def _count(self, rewards: NDArray[Any], done: NDArray[np.bool_]) -> None:
        """Follow the spread of returns."""
        self.total_steps += len(rewards)
        self._returns = self.config.gamma * self._returns + rewards
        if not np.isfinite(self._returns).all():
            raise TrainingError("A reward is not finite.", hint="Correct the reward function.")
        count, mean, squares = self._moments
        for value in self._returns.tolist():  # Welford's
            count += 1
            delta = value - mean
            mean += delta / count
            squares += delta * (value - mean)
        self._moments[:] = count, mean, squares
        self._returns[done] = 0.0

    def _learn(self, rng: np.random.Generator) -> list[UpdateStats]:
        """As many updates as this step of all cars is worth."""
        config = self.config
        if self.total_steps < config.learning_starts or not len(self._buffer):
            return []
        self._owed += config.updates_per_step * config.num_envs
        stats = []
        while self._owed >= 1.0:
            self._owed -= 1.0
            batch = self._buffer.sample(config.minibatch_size, rng)
            if not len(batch.rewards):
                break
            batch.rewards[:] /= self._unit()
            noise = rng.standard_normal((2, len(batch.rewards), self.spec.num_actions))
            self._num_updates += 1
            improves = self._num_updates % config.policy_frequency == 0
            stats.append(self.backend.update(batch, noise, improves_actor=improves))
            if not stats[-1].is_finite:
                raise TrainingError(
                    f"The loss is {stats[-1].policy_loss + stats[-1].value_loss} with gradient norm "
                    f"{stats[-1].grad_norm} in iteration {self.iteration + 1}; its step was not taken.",
                    hint="Lower learning_rate, or look for huge rewards.",
                )
        return stats

    def _unit(self) -> np.float32:
        """What counts as a reward of 1."""
        count, _, squares = self._moments
        if not self.config.normalize_rewards or count < 2:
            return np.float32(1.0)
        return np.float32(max((squares / count) ** 0.5, 1e-6))

    # ---- resume

    def state(self) -> dict[str, NDArray[Any]]:
        """Networks, optimisers and counters. What is remembered is not saved: it would take hundreds of megabytes."""
        arrays: dict[str, NDArray[Any]] = {
            f"weights/{name}": array for name, array in self.backend.driving_weights().items()
        }
        arrays["sac/counters"] = np.array([self.seed, self.iteration, self.total_steps, self._num_updates], np.int64)
        arrays["sac/moments"] = self._moments.copy()
        arrays["sac/returns"] = np.stack([self._returns, self._ledger.totals, self._ledger.lengths])
        return arrays | {f"sac/networks/{name}": array for name, array in self.backend.state().items()}

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave, with nothing remembered.

        Raises:
            CheckpointError: It belongs to another network or number of cars.
        """
        try:
            counters, moments, returns = (state[f"sac/{name}"] for name in ("counters", "moments", "returns"))
        except KeyError as error:
            raise CheckpointError(f"The training state has no entry {error}.") from None
        if returns.shape != (3, self.config.num_envs):
            raise CheckpointError(f"The training state is of {returns.shape[-1]} cars, not of {self.config.num_envs}.")
        self.backend.load_state(below("sac/networks/", state))
        self.seed, self.iteration, self.total_steps, self._num_updates = (int(number) for number in counters)
        self._moments = moments.copy()
        self._returns = returns[0].copy()
        self._ledger.totals[:], self._ledger.lengths[:] = returns[1:]
