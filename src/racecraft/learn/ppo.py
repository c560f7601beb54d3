"""Proximal policy optimisation, top to bottom: collect a rollout, estimate advantages, improve the policy.

    environment ──frames, state──▶ collect ──▶ Rollout ──▶ bootstrap, advantages ──▶ update ──▶ new weights

https://arxiv.org/abs/1707.06347, with AWS DeepRacer's variants (whole episodes per iteration, e-greedy
exploration, Huber value loss) as settings. Anything with ``observe``, ``step`` and ``reset`` can be learned
from; a `Learner` holds the network.
"""

from __future__ import annotations

import dataclasses
import time
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_choice, check_number, check_whole, require
from racecraft.errors import CheckpointError, TrainingError
from racecraft.learn import distributions
from racecraft.learn.average import WeightAverage
from racecraft.learn.learner import Learner, Minibatch, NetworkSpec, Objective, UpdateStats, Weights, holding
from racecraft.learn.ledger import Ended, EpisodeLedger
from racecraft.learn.networks import INITIAL_WEIGHTS
from racecraft.learn.rollout import Rollout

_VALUE_BATCH = 4096  # observations whose values are computed at once


@dataclass(frozen=True, kw_only=True)
class PPOConfig:
    """Settings of PPO, by CleanRL's names."""

    num_envs: int = 64
    """Cars driven at once."""
    num_steps: int = 8
    """Steps of each car in one rollout, when episodes_per_iteration is 0."""
    episodes_per_iteration: int = 0
    """Train after so many whole episodes, shared between the cars, as AWS does; 0: after num_steps."""
    max_steps_per_iteration: int = 10_000
    """Camera steps after which an iteration of whole episodes cuts and bootstraps those still running."""
    learning_rate: float = 1.5e-3
    """Adam's step size; AWS's 3e-4 is safe for days of training, this is for the first laps in seconds."""
    rate_steps: int = 0
    """Camera steps after which the step size is a half of learning_rate, after twice as many a third; 0: never."""
    gamma: float = 0.98
    """Discount per step of 1/15 s; 0.98 looks about 3 s ahead."""
    gae_lambda: float = 0.95
    """0 trusts the critic after one step, 1 trusts only the rewards."""
    minibatch_size: int = 128
    """Samples of one gradient step."""
    update_epochs: int = 3
    """Passes over each rollout."""
    clip_coef: float = 0.2
    """How far the probability ratio may move from 1 within an iteration."""
    ent_coef: float = 0.01
    """Weight of the entropy bonus; more explores longer."""
    vf_coef: float = 0.5
    """Weight of the value loss."""
    value_loss: str = "mse"
    """``"mse"`` or ``"huber"``."""
    max_grad_norm: float = 0.5
    """Global gradient norm is scaled down to this; 0 leaves it alone, as AWS does."""
    is_eps_hat: bool = False
    """Adam's epsilon is added before the second moment is corrected, as TensorFlow does."""
    initial_weights: str = "orthogonal"
    """What an untrained network begins with: ``"orthogonal"``, or ``"glorot"`` as AWS's."""
    average_share: float = 0.06
    """About which share of the training so far the weights are averaged over that drive evaluations and are saved;
    0 takes the last weights, as AWS does."""
    normalize_returns: bool = True
    """Let the critic predict in units of the returns' running spread, so that rewards may have any scale; AWS's
    predicts in units of reward."""
    exploration: str = "categorical"
    """``"categorical"`` samples the policy; ``"e-greedy"`` takes the best action, or any by chance."""
    epsilon_start: float = 1.0
    """Chance of a random action in the first step of e-greedy exploration."""
    epsilon_end: float = 0.05
    """Chance of a random action after epsilon_steps."""
    epsilon_steps: int = 10_000
    """Camera steps over which that chance falls linearly."""

    def __post_init__(self) -> None:
        """Refuse what cannot work, naming the field."""
        for name, least in (
            ("num_envs", 1),
            ("num_steps", 1),
            ("max_steps_per_iteration", 1),
            ("minibatch_size", 1),
            ("update_epochs", 1),
            ("episodes_per_iteration", 0),
            ("epsilon_steps", 0),
            ("rate_steps", 0),
        ):
            check_whole(name, getattr(self, name), least, is_plain=True)
        for name in ("gamma", "gae_lambda", "clip_coef", "epsilon_start", "epsilon_end", "average_share"):
            check_number(name, getattr(self, name), 0.0, 1.0, is_plain=True)
        for name in ("learning_rate", "ent_coef", "vf_coef", "max_grad_norm"):
            check_number(name, getattr(self, name), 0.0, is_plain=True)
        require("clip_coef", self.clip_coef, 0.0 < self.clip_coef < 1.0, "a number above 0 and below 1")
        check_choice("value_loss", self.value_loss, ("mse", "huber"))
        check_choice("initial_weights", self.initial_weights, INITIAL_WEIGHTS)
        check_choice("exploration", self.exploration, ("categorical", "e-greedy"))

    @property
    def objective(self) -> Objective:
        """The part of the settings a learner's update needs."""
        names = [field.name for field in dataclasses.fields(Objective) if hasattr(self, field.name)]
        return Objective(**{name: getattr(self, name) for name in names})


class Environment(Protocol):
    """A batch of cars to learn from. An episode's last step tells how it ended; ``reset`` begins another.

    A car that is not reset after its episode has ended stands, and what steps say about it means nothing.
    """

    @property
    def num_envs(self) -> int:
        """N, the number of cars."""

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """What the sensors tell (N, ...), as the learner encodes it, and privileged state (N, S); views are fine."""

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_], NDArray[np.bool_]]:
        """Drive one step: rewards, terminated, truncated, each (N,).

        Args:
            actions: Indices int64 (N,), or float32 (N, A) within [-1, 1].
        """

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Put the cars of the mask (N,) at a new start."""


@dataclass(frozen=True, kw_only=True)
class IterationStats:
    """What one iteration did. The losses are means over its gradient steps."""

    iteration: int
    """Number of this iteration, from 1."""
    total_steps: int
    """Camera steps since the start of training, this iteration included."""
    num_steps: int
    """Camera steps of this iteration."""
    ended: tuple[Ended, ...]
    """Episodes that ended in this iteration."""
    losses: UpdateStats
    explained_variance: float
    """1 - Var(returns - values) / Var(returns): 1 for a perfect critic, 0 for a constant one."""
    environment_seconds: float
    """Wall-clock time inside the environment."""
    policy_seconds: float
    """Wall-clock time of encoding frames and choosing actions."""
    update_seconds: float
    """Wall-clock time of values, advantages and gradient steps."""

    @property
    def episodes(self) -> int:
        """Episodes that ended in this iteration."""
        return len(self.ended)

    @property
    def mean_return(self) -> float:
        """Mean undiscounted sum of rewards of those episodes; NaN where there were none."""
        return float(np.mean([episode.total for episode in self.ended])) if self.ended else float("nan")

    @property
    def mean_length(self) -> float:
        """Mean number of steps of those episodes; NaN where there were none."""
        return float(np.mean([episode.length for episode in self.ended])) if self.ended else float("nan")


class PPO:
    """The algorithm and its place in training.

    Args:
        config: Settings.
        learner: The network; it is changed in place.
        environment: The cars; must have ``config.num_envs`` of them, at the start of an episode.
        seed: Decides all sampling and shuffling, together with the number of the iteration.

    Raises:
        ConfigError: The settings do not fit the learner or the environment.
    """

    def __init__(self, config: PPOConfig, learner: Learner, environment: Environment, *, seed: int = 0) -> None:
        spec = learner.spec
        is_driven = config.num_envs == environment.num_envs
        require("num_envs", config.num_envs, is_driven, f"the environment's {environment.num_envs}")
        is_possible = spec.is_discrete or config.exploration != "e-greedy"
        require("exploration", config.exploration, is_possible, "'categorical' for continuous actions")
        if config.episodes_per_iteration:
            capacity = -(-config.max_steps_per_iteration // min(config.num_envs, config.episodes_per_iteration))
        else:
            capacity = config.num_steps
            samples = config.num_steps * config.num_envs
            is_filled = config.minibatch_size <= samples
            require("minibatch_size", config.minibatch_size, is_filled, f"at most num_steps x num_envs = {samples}")
        self.config = config
        self.learner = learner
        self.environment, self.seed = environment, seed
        self.iteration = self.total_steps = 0
        self._rollout = Rollout(
            capacity,
            num_envs=config.num_envs,
            observation_shape=learner.observation_shape,
            state_size=spec.state_size,
            action_size=0 if spec.is_discrete else spec.num_actions,
            observation_dtype=getattr(learner, "observation_dtype", np.uint8),
        )
        self._ledger = EpisodeLedger(config.num_envs)
        self.return_scale = np.array([0.0, 1.0])  # running mean and spread of the returns, in units of reward
        self.prefers_average = False
        """Whether the averaged weights drive. The mean of beginners is none: set it once the policy drives well."""
        self._average = WeightAverage(learner, config.average_share)
        self._clocks = {"environment": 0.0, "policy": 0.0, "update": 0.0}

    def iterate(self) -> IterationStats:
        """Collect one rollout and improve the policy on it.

        Raises:
            TrainingError: Loss or gradient is not finite; the weights are those of before that gradient step.
        """
        rng = np.random.default_rng([self.seed, self.iteration])
        self._clocks = dict.fromkeys(self._clocks, 0.0)
        ended = self._collect(rng)

        started = time.perf_counter()
        advantages, returns = self._estimate()
        losses = self._update(advantages, returns, rng)
        self._average.add(iteration=self.iteration + 1)
        self._clocks["update"] += time.perf_counter() - started

        rollout = self._rollout
        used = rollout.is_valid[: rollout.num_steps]
        variance = float(returns[used].var())
        self.iteration += 1
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=int(used.sum()),
            ended=tuple(ended),
            losses=losses,
            explained_variance=1 - float(advantages[used].var()) / variance if variance > 0 else float("nan"),
            environment_seconds=self._clocks["environment"],
            policy_seconds=self._clocks["policy"],
            update_seconds=self._clocks["update"],
        )

    @property
    def spec(self) -> NetworkSpec:
        """The network that drives."""
        return self.learner.spec

    @property
    def driving_weights(self) -> Weights:
        """The weights to judge and to save; not to be changed."""
        return self._average.weights(is_preferred=self.prefers_average)

    def driving(self) -> AbstractContextManager[None]:
        """Within, the learner holds the weights that are to drive; afterwards those it learns with."""
        return holding(self.learner, self.driving_weights)

    # ---- collect: drive until the rollout is full

    def _collect(self, rng: np.random.Generator) -> list[Ended]:
        """Fill the rollout; the episodes that ended."""
        rollout, environment = self._rollout, self.environment
        num_envs, episodes = self.config.num_envs, self.config.episodes_per_iteration
        ended: list[Ended] = []
        size = self.config.num_steps * num_envs
        budget = self.config.max_steps_per_iteration if episodes else size
        quota = np.full(num_envs, np.iinfo(np.int64).max)  # episodes each car may still begin
        if episodes:
            quota = np.array([episodes // num_envs + (car < episodes % num_envs) for car in range(num_envs)])
            everyone = np.ones(num_envs, bool)
            environment.reset(everyone)
            self._ledger.forget(everyone)
        rollout.clear()
        cut: list[tuple[int, NDArray[np.intp], NDArray[np.uint8], NDArray[np.float32]]] = []

        while budget > 0 and quota.any() and rollout.num_steps < len(rollout.rewards):
            started = time.perf_counter()
            frames, states = environment.observe()
            observations = self.learner.encode(frames)
            actions, log_probs = self._act(observations, rng)
            is_driving = quota > 0
            rollout.add(
                observations=observations,
                states=states[:, : rollout.states.shape[2]],
                actions=actions,
                log_probs=log_probs,
                is_valid=is_driving,
            )
            acted = time.perf_counter()
            command = actions if self.learner.spec.is_discrete else actions.clip(-1.0, 1.0)
            rewards, terminated, truncated = environment.step(command)
            rollout.finish(rewards=rewards, terminated=terminated, truncated=truncated)
            budget -= int(is_driving.sum())
            self.total_steps += int(is_driving.sum())

            # the last frame of a truncated episode is gone after the reset: keep it for its value
            done = terminated | truncated
            cars = np.flatnonzero(truncated & ~terminated & is_driving)
            if len(cars):
                cut.append((rollout.num_steps - 1, cars, *self._look(cars)))
            ended += self._ledger.add(rewards, done, is_counted=is_driving)
            if episodes:
                quota -= done & is_driving
            begins = done & (quota > 0)
            if begins.any():
                environment.reset(begins)
            self._clocks["policy"] += acted - started
            self._clocks["environment"] += time.perf_counter() - acted

        # every car still under way continues after the last row: its value stands in for what follows
        last = rollout.num_steps - 1
        cars = np.flatnonzero(rollout.is_valid[last] & ~rollout.terminated[last] & ~rollout.truncated[last])
        if len(cars):
            cut.append((last, cars, *self._look(cars)))
        for row, cars, observations, states in cut:
            rollout.next_values[row, cars] = self._values(observations, states)
        return ended

    def _act(
        self, observations: NDArray[np.uint8], rng: np.random.Generator
    ) -> tuple[NDArray[Any], NDArray[np.float32]]:
        """Explore: actions as the policy drew them, and their log-probabilities under it."""
        spec, config = self.learner.spec, self.config
        outputs = self.learner.policy(observations)
        if not np.isfinite(outputs).all():
            raise TrainingError(
                "The policy's outputs are not finite.", hint="Lower learning_rate, or check the reward."
            )
        num_cars, is_discrete = len(outputs), spec.is_discrete
        if config.exploration == "e-greedy":
            actions = distributions.most_likely(outputs, is_discrete=True)
            done = min(self.total_steps / config.epsilon_steps, 1.0) if config.epsilon_steps else 1.0
            epsilon = config.epsilon_start + (config.epsilon_end - config.epsilon_start) * done
            is_random = rng.random(num_cars) < epsilon
            actions = np.where(is_random, rng.integers(spec.num_actions, size=num_cars), actions)
        else:
            noise = distributions.noise_for(num_cars, num_actions=spec.num_actions, is_discrete=is_discrete, rng=rng)
            actions = distributions.sample(outputs, noise, is_discrete=is_discrete)
        return actions, distributions.log_prob(outputs, actions, is_discrete=is_discrete)

    def _look(self, cars: NDArray[np.intp]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Observations and states of some cars where they are now."""
        frames, states = self.environment.observe()
        return self.learner.encode(frames[cars]), np.array(states[cars, : self.learner.spec.state_size])

    # ---- estimate: values, advantages, returns

    def _estimate(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Advantages and returns of the rollout, (T, N), in units of reward."""
        rollout = self._rollout
        rows = slice(0, rollout.num_steps)
        shape = rollout.values[rows].shape
        observations = rollout.observations[rows].reshape(-1, *rollout.observations.shape[2:])
        states = rollout.states[rows].reshape(len(observations), rollout.states.shape[2])
        rollout.values[rows] = self._values(observations, states).reshape(shape)
        return rollout.advantages(gamma=self.config.gamma, gae_lambda=self.config.gae_lambda)

    def _values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's values, in units of reward  (N,)."""
        starts = range(0, len(observations), _VALUE_BATCH)
        values = [self.learner.values(observations[i : i + _VALUE_BATCH], states[i : i + _VALUE_BATCH]) for i in starts]
        mean, spread = self.return_scale
        return np.asarray(np.concatenate(values) * spread + mean, np.float32)

    # ---- update: gradient steps on shuffled minibatches

    def _update(
        self, advantages: NDArray[np.float32], returns: NDArray[np.float32], rng: np.random.Generator
    ) -> UpdateStats:
        config, rollout = self.config, self._rollout
        used = np.flatnonzero(rollout.is_valid[: rollout.num_steps])
        self._follow_returns(returns.reshape(-1)[used])
        mean, spread = self.return_scale
        b_observations = rollout.observations.reshape(-1, *rollout.observations.shape[2:])
        b_states = rollout.states.reshape(len(b_observations), rollout.states.shape[2])
        b_actions = rollout.actions.reshape(-1, *rollout.actions.shape[2:])
        b_log_probs = rollout.log_probs.reshape(-1)
        b_returns = ((returns - mean) / spread).astype(np.float32).reshape(-1)
        b_advantages = advantages.reshape(-1)
        centre, scale = distributions.moments(b_advantages[used])
        b_advantages = ((b_advantages - centre) / (scale + 1e-8)).astype(np.float32)

        everything = len(b_advantages)
        minibatch = Minibatch(
            observations=b_observations[:everything],
            states=b_states[:everything],
            actions=b_actions[:everything],
            log_probs=b_log_probs[:everything],
            advantages=b_advantages,
            returns=b_returns,
        )
        minibatch_size = min(config.minibatch_size, len(used))
        objective = config.objective
        if config.rate_steps:
            rate = config.learning_rate / (1.0 + self.total_steps / config.rate_steps)
            objective = dataclasses.replace(objective, learning_rate=rate)
        stats: list[UpdateStats] = []
        for _ in range(config.update_epochs):
            order = rng.permutation(used)
            for start in range(0, len(used) - minibatch_size + 1, minibatch_size):  # a last partial one is dropped
                rows = order[start : start + minibatch_size]
                stats.append(self.learner.update(dataclasses.replace(minibatch, rows=rows), objective))
                if not stats[-1].is_finite:
                    raise TrainingError(
                        f"The loss is {stats[-1].policy_loss + stats[-1].value_loss} with gradient norm "
                        f"{stats[-1].grad_norm} in iteration {self.iteration + 1}; its step was not taken.",
                        hint="Lower learning_rate, set max_grad_norm, or look for huge rewards.",
                    )
        return UpdateStats.mean(stats)

    def _follow_returns(self, returns: NDArray[np.float32]) -> None:
        """Move the critic's unit towards the returns seen lately; the first rollout sets it."""
        if not self.config.normalize_returns:
            return
        mean, spread = distributions.moments(returns)
        seen = np.array([mean, max(spread, 1e-6)])
        self.return_scale = seen if self.iteration == 0 else 0.9 * self.return_scale + 0.1 * seen

    # ---- resume

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything needed to continue, except where the cars are: plain arrays by name.

        ``weights/`` holds what is to drive; where weights are averaged, ``learning/`` what goes on learning.
        """
        arrays: dict[str, NDArray[Any]] = {
            "ppo/counters": np.array([self.seed, self.iteration, self.total_steps], np.int64),
            "ppo/episode_returns": self._ledger.totals.copy(),
            "ppo/episode_lengths": self._ledger.lengths.copy(),
            "ppo/return_scale": self.return_scale.copy(),
        }
        return arrays | self._average.state(is_preferred=self.prefers_average)

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave.

        Raises:
            CheckpointError: It belongs to another network or number of cars.
        """
        try:
            counters, returns, lengths, scale = (
                state[f"ppo/{name}"] for name in ("counters", "episode_returns", "episode_lengths", "return_scale")
            )
        except KeyError as error:
            raise CheckpointError(f"The training state has no entry {error}.") from None
        if returns.shape != self._ledger.totals.shape:
            raise CheckpointError(
                f"The training state is of {len(returns)} cars, not of {self.config.num_envs}.",
                hint=f"Resume with num_envs = {len(returns)}.",
            )
        self._average.load_state(state)
        self.seed, self.iteration, self.total_steps = (int(number) for number in counters)
        self._ledger.totals[:], self._ledger.lengths[:] = returns, lengths
        self.return_scale = scale.copy()
