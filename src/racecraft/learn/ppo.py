"""Proximal policy optimisation: its settings, what an iteration did, and the loop as it is told to the native core.

    environment ──frames, state──▶ act ──▶ step ──rewards──▶ pay ──▶ until the rollout is full: learn ──▶ new weights

https://arxiv.org/abs/1707.06347, with AWS DeepRacer's variants (whole episodes per iteration, e-greedy
exploration, Huber value loss) as settings. Anything with ``observe``, ``step`` and ``reset`` can be learned
from; a `Learner` holds the network. The rollout, all chance, advantages and minibatches are `native/src/ppo.hpp`'s,
which a browser's tab runs as well.
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
from racecraft.learn.average import WeightAverage
from racecraft.learn.learner import Learner, NetworkSpec, Objective, UpdateStats, Weights, holding
from racecraft.learn.ledger import Ended
from racecraft.learn.native_loop import make_loop
from racecraft.learn.networks import INITIAL_WEIGHTS

_LOOP_SETTINGS = (
    "num_envs",
    "num_steps",
    "episodes_per_iteration",
    "max_steps_per_iteration",
    "rate_steps",
    "gamma",
    "gae_lambda",
    "minibatch_size",
    "update_epochs",
    "normalize_returns",
    "epsilon_start",
    "epsilon_end",
    "epsilon_steps",
)


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
        samples = config.num_steps * config.num_envs
        is_filled = config.episodes_per_iteration > 0 or config.minibatch_size <= samples
        require("minibatch_size", config.minibatch_size, is_filled, f"at most num_steps x num_envs = {samples}")
        self.config = config
        self.learner = learner
        self.environment, self.seed = environment, seed
        self.iteration = self.total_steps = 0
        self._loop = make_loop(
            learner,
            config.objective,
            is_greedy=config.exploration == "e-greedy",
            **{name: getattr(config, name) for name in _LOOP_SETTINGS},
        )
        self._chosen, self._begins = np.asarray(self._loop.actions), self._loop.begins  # filled by every step
        self.prefers_average = False
        """Whether the averaged weights drive. The mean of beginners is none: set it once the policy drives well."""
        self._average = WeightAverage(learner, config.average_share)
        self._clocks = {"environment": 0.0, "policy": 0.0, "update": 0.0}

    def iterate(self) -> IterationStats:
        """Collect one rollout and improve the policy on it.

        Raises:
            TrainingError: Loss or gradient is not finite; the weights are those of before that gradient step.
        """
        loop = self._loop
        loop.begin(self.seed, self.iteration, self.total_steps)
        self._clocks = dict.fromkeys(self._clocks, 0.0)
        self._collect()

        started = time.perf_counter()
        losses = self._learn()
        self._average.add(iteration=self.iteration + 1)
        self._clocks["update"] += time.perf_counter() - started

        self.iteration += 1
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=loop.num_driven,
            ended=tuple(Ended(*episode) for episode in loop.ended),
            losses=losses,
            explained_variance=loop.explained_variance,
            environment_seconds=self._clocks["environment"],
            policy_seconds=self._clocks["policy"],
            update_seconds=self._clocks["update"],
        )

    def _collect(self) -> None:
        """Drive until the rollout is full."""
        loop, environment = self._loop, self.environment
        if self.config.episodes_per_iteration:
            environment.reset(np.ones(self.config.num_envs, bool))
        while not loop.is_full:
            started = time.perf_counter()
            if not loop.act(*self._see()):
                raise TrainingError(
                    "The policy's outputs are not finite.", hint="Lower learning_rate, or check the reward."
                )
            acted = time.perf_counter()
            if loop.pay(*environment.step(self._chosen)):  # some returns go on from frames that are soon gone
                loop.look(*self._see())
            self.total_steps = loop.total_steps
            if loop.any_begins:
                environment.reset(self._begins)
            self._clocks["policy"] += acted - started
            self._clocks["environment"] += time.perf_counter() - acted

    def _see(self) -> tuple[NDArray[Any], NDArray[np.float32]]:
        frames, states = self.environment.observe()
        return np.ascontiguousarray(frames), np.ascontiguousarray(states)

    def _learn(self) -> UpdateStats:
        """Advantages and gradient steps; the mean of what these saw."""
        is_fine = self._loop.learn()
        stats = [UpdateStats.of(terms) for terms in self._loop.updates]
        if not is_fine:
            raise TrainingError(
                f"The loss is {stats[-1].policy_loss + stats[-1].value_loss} with gradient norm "
                f"{stats[-1].grad_norm} in iteration {self.iteration + 1}; its step was not taken.",
                hint="Lower learning_rate, set max_grad_norm, or look for huge rewards.",
            )
        return UpdateStats.mean(stats)

    def column(self, name: str) -> NDArray[Any]:
        """A copy of a column of the last rollout, one of those in `native/src/rollout.hpp`  (T, N, ...)."""
        return np.asarray(self._loop.column(name))

    @property
    def return_scale(self) -> NDArray[np.float64]:
        """Running mean and spread of the returns, in units of reward: the critic's unit  (2,)."""
        return self._loop.return_scale

    @return_scale.setter
    def return_scale(self, scale: NDArray[np.float64]) -> None:
        self._loop.return_scale[:] = scale

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

    # ---- resume

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything needed to continue, except where the cars are: plain arrays by name.

        ``weights/`` holds what is to drive; where weights are averaged, ``learning/`` what goes on learning.
        """
        arrays: dict[str, NDArray[Any]] = {
            "ppo/counters": np.array([self.seed, self.iteration, self.total_steps], np.int64),
            "ppo/episode_returns": self._loop.totals.copy(),
            "ppo/episode_lengths": self._loop.lengths.copy(),
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
        if returns.shape != self._loop.totals.shape:
            raise CheckpointError(
                f"The training state is of {len(returns)} cars, not of {self.config.num_envs}.",
                hint=f"Resume with num_envs = {len(returns)}.",
            )
        self._average.load_state(state)
        self.seed, self.iteration, self.total_steps = (int(number) for number in counters)
        self._loop.totals[:], self._loop.lengths[:] = returns, lengths
        self.return_scale = scale
