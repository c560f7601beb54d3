"""Privileged distillation: a teacher learns on the simulator's state, a student with a camera learns from the teacher.

    teacher:  state ──PPO──▶ policy            (no camera is rendered, the user's reward as always)
    student:  drives with its own camera policy ──▶ the teacher says what it would do there ──▶ ReplayMemory ──▶ update
    refining: the student, with the teacher's critic beside it ──PPO──▶ policy      (camera, the user's reward again)

The student visits its own states and is told the teacher's answer in each of them (DAgger,
https://arxiv.org/abs/1011.0686), so it learns to come back from its own mistakes. Its loss is the cross-entropy to the
teacher's distribution of actions, sampled anew for every minibatch. ("Learning by cheating", https://arxiv.org/abs/1912.12294.)
What a camera sees of the state does not allow to drive as near the edge as a teacher does: refining finds out how near.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_number, check_whole, require
from racecraft.errors import CheckpointError, TrainingError
from racecraft.learn import distributions
from racecraft.learn.average import WeightAverage
from racecraft.learn.learner import Learner, Minibatch, NetworkSpec, Objective, UpdateStats, Weights, below, holding
from racecraft.learn.ledger import Ended, EpisodeLedger
from racecraft.learn.native_state_learner import NativeStateLearner
from racecraft.learn.ppo import PPO, Environment, IterationStats, PPOConfig

TEACHER_PPO = PPOConfig(num_envs=128, num_steps=32, minibatch_size=512, update_epochs=4, learning_rate=1.5e-3)
"""How a teacher learns: rollouts are cheap, so they may be large."""

REFINING_PPO = PPOConfig(num_envs=64, num_steps=32, minibatch_size=512, ent_coef=0.0)
"""How a student goes on with the reward: in small steps, from large rollouts."""

REFINING_STD = 0.12
"""Standard deviation of the student's continuous actions as it begins to."""

DRIVING_STD = 0.1
"""Most standard deviation with which a student of continuous actions drives; it says itself how much it errs."""

AVERAGE_FROM = 20_000
"""Camera steps from which on the student's averaged weights are judged, even if no evaluation has been perfect yet."""

ANSWER_STD = 0.05
"""Standard deviation of a teacher's continuous answers, whatever it explored with: what it knows is the mean."""


@dataclass(frozen=True, kw_only=True)
class DistillConfig:
    """Settings of distillation."""

    num_envs: int = 64
    """Cars of the student."""
    num_steps: int = 8
    """Steps of each of them in one iteration."""
    teacher_steps: int = 250_000
    """Steps of the teacher before the student begins; they render no camera and do not count as camera steps."""
    teacher_rate: float = TEACHER_PPO.learning_rate
    """Adam's step size of the teacher."""
    teacher_rate_steps: int = 700_000
    """Of its steps, after as many its step size is a half of what it was, after twice as many a third; 0: never."""
    gamma: float = PPOConfig.gamma
    """Discount per step of the teacher, and of PPO as which the student goes on with the critic it leaves."""
    student_steps: int = 150_000
    """Camera steps after which the student goes on with PPO and the reward itself; 0: never."""
    learning_rate: float = 1.5e-3
    """Adam's step size of the student."""
    rate_steps: int = 40_000
    """Camera steps after which it is a half of learning_rate, after twice as many a third; 0: never."""
    refining_rate: float = 5e-4
    """Adam's step size of PPO, as which the student goes on."""
    refining_rate_steps: int = 600_000
    """Camera steps after which it is a half of that, after twice as many a third; 0: never."""
    minibatch_size: int = 128
    """Samples of one gradient step."""
    updates_per_iteration: int = 12
    """Gradient steps of the student after every iteration."""
    buffer_size: int = 32_000
    """Steps of the student that are remembered, of 4 kB each with the default network."""

    def __post_init__(self) -> None:
        """Refuse what cannot work, naming the field."""
        for name in (
            "num_envs",
            "num_steps",
            "teacher_steps",
            "minibatch_size",
            "updates_per_iteration",
            "buffer_size",
        ):
            check_whole(name, getattr(self, name), 1, is_plain=True)
        for name in ("teacher_rate_steps", "student_steps", "rate_steps", "refining_rate_steps"):
            check_whole(name, getattr(self, name), 0, is_plain=True)
        for name in ("learning_rate", "teacher_rate", "refining_rate", "gamma"):
            check_number(name, getattr(self, name), 0.0, 1.0, is_plain=True)
        samples = self.num_envs * self.num_steps
        is_enough = self.buffer_size >= samples
        require("buffer_size", self.buffer_size, is_enough, f"at least num_envs x num_steps = {samples}")


def sure_answers(outputs: NDArray[np.float32]) -> NDArray[np.float32]:
    """What a teacher of continuous actions does when it does not explore, as a policy's outputs  (N, P).

    Means beyond the range of actions, of which a teacher has many as it likes full throttle, are cut to it: the cars do
    the same, and the student need not imitate how far beyond they are.
    """
    num_actions = outputs.shape[1] // 2
    log_stds = np.full((len(outputs), num_actions), np.log(ANSWER_STD), np.float32)
    return np.concatenate([outputs[:, :num_actions].clip(-1.0, 1.0), log_stds], axis=1)


class StateWorld:
    """An environment whose frames are its states, for a teacher."""

    def __init__(self, environment: Environment) -> None:
        self.environment = environment
        self.num_envs = environment.num_envs

    def observe(self) -> tuple[NDArray[Any], NDArray[np.float32]]:
        """The states, twice."""
        states = self.environment.observe()[1]
        return states, states

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_], NDArray[np.bool_]]:
        """As of the environment."""
        return self.environment.step(actions)

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """As of the environment."""
        self.environment.reset(mask)


class Distill:
    """The algorithm and its place in training; a `racecraft.learn.Algorithm`.

    Args:
        config: Settings.
        learner: The student's network.
        environment: The student's cars, with a camera.
        open_teacher: Makes the teacher's cars, which need none; it is given the teacher, as others may race against it.
        seed: Decides all sampling, together with the number of the iteration.
        num_threads: Of the teacher's learner; 0 takes every core. Results are the same for any number.
    """

    def __init__(
        self,
        config: DistillConfig,
        learner: Learner,
        environment: Environment,
        open_teacher: Callable[[Learner], Environment],
        *,
        seed: int = 0,
        num_threads: int = 0,
    ) -> None:
        is_driven = config.num_envs == environment.num_envs
        require("num_envs", config.num_envs, is_driven, f"the environment's {environment.num_envs}")
        self.config, self.learner, self.environment, self.seed = config, learner, environment, seed
        self.state_size = environment.observe()[1].shape[1]
        teacher_spec = replace(learner.spec, state_size=self.state_size)
        teacher = NativeStateLearner(teacher_spec, seed=seed, num_threads=num_threads)
        cars = open_teacher(teacher)
        ppo = replace(
            TEACHER_PPO,
            num_envs=cars.num_envs,
            learning_rate=config.teacher_rate,
            rate_steps=config.teacher_rate_steps,
            gamma=config.gamma,
        )
        if not learner.spec.is_discrete:
            ppo = replace(ppo, ent_coef=0.0)
        self.teacher = PPO(ppo, teacher, StateWorld(cars), seed=seed)
        self.refining: PPO | None = None
        """What the student goes on with, from the end of its lessons on."""
        self.total_steps = 0
        self.iteration = 0
        self.prefers_average = False
        self._average = WeightAverage(learner, 0.06)
        capacity = config.buffer_size // config.num_envs * config.num_envs
        self._observations = np.zeros((capacity, *learner.observation_shape), np.uint8)
        self._answers = np.zeros((capacity, learner.spec.policy_size), np.float32)  # the teacher's outputs
        self._count = 0
        self._ledger = EpisodeLedger(config.num_envs)

    @property
    def spec(self) -> NetworkSpec:
        """The student's network."""
        return self.learner.spec

    @property
    def is_teaching(self) -> bool:
        """Whether the teacher has learned what it is to learn."""
        return self.teacher.total_steps >= self.config.teacher_steps

    @property
    def is_refining(self) -> bool:
        """Whether the student has had its lessons; never where its critic sees the camera, which no teacher taught."""
        is_over = 0 < self.config.student_steps <= self.total_steps
        return is_over and self.spec.state_size == self.state_size

    def iterate(self) -> IterationStats:
        """One iteration of the teacher, of its student once it has learned, and then of PPO.

        Raises:
            TrainingError: Loss or gradient is not finite.
        """
        self.iteration += 1
        if not self.is_teaching:
            stats = self.teacher.iterate()
            return replace(stats, iteration=self.iteration, total_steps=0, num_steps=0)
        if self.is_refining:
            self.refining = self.refining or self._begin_refining()
            stats = self.refining.iterate()
            self.total_steps = self.refining.total_steps
            return stats
        rng = np.random.default_rng([self.seed, self.iteration])
        clocks = {"environment": 0.0, "policy": 0.0}
        ended: list[Ended] = []
        for _ in range(self.config.num_steps):
            ended += self._drive(rng, clocks)
        started = time.perf_counter()
        losses = self._learn(rng)
        self._average.add(iteration=self.iteration)
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=self.config.num_steps * self.config.num_envs,
            ended=tuple(ended),
            losses=losses,
            explained_variance=float("nan"),
            environment_seconds=clocks["environment"],
            policy_seconds=clocks["policy"],
            update_seconds=time.perf_counter() - started,
        )

    def _drive(self, rng: np.random.Generator, clocks: dict[str, float]) -> list[Ended]:
        """One step of the student's cars, and the teacher's answers there; the episodes that ended."""
        spec, started = self.spec, time.perf_counter()
        frames, states = self.environment.observe()
        observations = self.learner.encode(frames)
        outputs = self.learner.policy(observations)
        if not np.isfinite(outputs).all():
            raise TrainingError("The policy's outputs are not finite.", hint="Lower learning_rate.")
        noise = distributions.noise_for(
            len(outputs), num_actions=spec.num_actions, is_discrete=spec.is_discrete, rng=rng
        )
        if not spec.is_discrete:
            outputs[:, spec.num_actions :] = outputs[:, spec.num_actions :].clip(max=np.float32(np.log(DRIVING_STD)))
        actions = distributions.sample(outputs, noise, is_discrete=spec.is_discrete)
        rows = (self._count + np.arange(len(outputs))) % len(self._answers)
        self._observations[rows] = observations
        told = self.teacher.learner.policy(np.asarray(states, np.float32))
        self._answers[rows] = told if spec.is_discrete else sure_answers(told)
        self._count += len(outputs)
        acted = time.perf_counter()
        rewards, terminated, truncated = self.environment.step(actions if spec.is_discrete else actions.clip(-1.0, 1.0))
        done = terminated | truncated
        ended = self._ledger.add(rewards, done)
        if ended:
            self.environment.reset(done)
        self.total_steps += len(outputs)
        clocks["policy"] += acted - started
        clocks["environment"] += time.perf_counter() - acted
        return ended

    def _learn(self, rng: np.random.Generator) -> UpdateStats:
        """Gradient steps on the cross-entropy to the teacher's distribution.

        With an advantage of 1 and the present log-probabilities as the old ones, the gradient of PPO's loss is that of
        minus the log-probability of the action; with actions drawn from the teacher that is the cross-entropy's.
        """
        spec, config = self.spec, self.config
        decay = 1.0 + self.total_steps / config.rate_steps if config.rate_steps else 1.0
        objective = Objective(
            learning_rate=config.learning_rate / decay,
            clip_coef=0.2,
            ent_coef=0.0,
            vf_coef=0.0,
            value_loss="mse",
            max_grad_norm=0.5,
        )
        known = min(self._count, len(self._answers))
        cross_entropies, norms = [], []
        for _ in range(config.updates_per_iteration):
            rows = rng.integers(0, known, config.minibatch_size)
            observations, answers = self._observations[rows], self._answers[rows]
            noise = distributions.noise_for(
                len(rows), num_actions=spec.num_actions, is_discrete=spec.is_discrete, rng=rng
            )
            actions = distributions.sample(answers, noise, is_discrete=spec.is_discrete)
            outputs = self.learner.policy(observations)
            log_probs = distributions.log_prob(outputs, actions, is_discrete=spec.is_discrete)
            stats = self.learner.update(
                Minibatch(
                    observations=observations,
                    states=np.zeros((len(rows), spec.state_size), np.float32),
                    actions=actions,
                    log_probs=log_probs,
                    advantages=np.ones(len(rows), np.float32),
                    returns=np.zeros(len(rows), np.float32),
                ),
                objective,
            )
            if not (stats.is_finite and np.isfinite(log_probs).all()):
                raise TrainingError(
                    f"The student's loss is not finite in iteration {self.iteration}; its step was not taken.",
                    hint="Lower learning_rate.",
                )
            cross_entropies.append(-float(log_probs.mean()))
            norms.append(stats.grad_norm)
        return UpdateStats(
            policy_loss=float(np.mean(cross_entropies)),
            value_loss=0.0,
            entropy=stats.entropy,
            approx_kl=float("nan"),
            clip_fraction=float("nan"),
            grad_norm=float(np.mean(norms)),
        )

    # ---- refine: PPO from where the lessons end

    def _begin_refining(self) -> PPO:
        """PPO with the student's averaged weights, its teacher's critic, and some chance in what it does."""
        weights = {name: array.copy() for name, array in self._average.weights().items()}
        weights |= {name: array for name, array in self.teacher.learner.weights().items() if name.startswith("critic.")}
        if not self.spec.is_discrete:
            weights["policy.log_std"] = np.full_like(weights["policy.log_std"], np.log(REFINING_STD))
        self.learner.load_weights(weights)
        ppo = self._make_refining()
        ppo.iteration, ppo.total_steps = self.iteration - 1, self.total_steps
        ppo.return_scale = self.teacher.return_scale.copy()
        return ppo

    def _make_refining(self) -> PPO:
        samples = self.config.num_envs * REFINING_PPO.num_steps
        config = replace(
            REFINING_PPO,
            num_envs=self.config.num_envs,
            learning_rate=self.config.refining_rate,
            rate_steps=self.config.refining_rate_steps,
            gamma=self.config.gamma,
            minibatch_size=min(REFINING_PPO.minibatch_size, samples),
        )
        ppo = PPO(config, self.learner, self.environment, seed=self.seed)
        ppo.prefers_average = True
        return ppo

    @property
    def driving_weights(self) -> Weights:
        """The weights to judge and to save."""
        if self.refining is not None:
            return self.refining.driving_weights
        return self._average.weights(is_preferred=self._drives_by_average)

    @property
    def _drives_by_average(self) -> bool:
        return self.prefers_average or self.total_steps >= AVERAGE_FROM

    def driving(self) -> AbstractContextManager[None]:
        """Within, the learner holds the weights that are to drive; afterwards those it learns with."""
        return holding(self.learner, self.driving_weights)

    # ---- resume

    def state(self) -> dict[str, NDArray[Any]]:
        """Student, teacher, optimisers and counters; not the frames that are remembered."""
        counters = np.array([self.seed, self.iteration, self.total_steps], np.int64)
        totals = np.stack([self._ledger.totals, self._ledger.lengths])
        lessons = {"distill/counters": counters, "distill/episodes": totals}
        lessons |= {f"teacher/{name}": array for name, array in self.teacher.state().items()}
        if self.refining is not None:
            return {**self.refining.state(), **lessons}
        return {**self._average.state(is_preferred=self._drives_by_average), **lessons}

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave, with no frames remembered; CheckpointError where it does not fit."""
        try:
            counters, episodes = state["distill/counters"], state["distill/episodes"]
        except KeyError as error:
            raise CheckpointError(f"The training state has no entry {error}.") from None
        if episodes.shape != (2, self.config.num_envs):
            raise CheckpointError(f"The training state is of {episodes.shape[-1]} cars, not of {self.config.num_envs}.")
        self.teacher.load_state(below("teacher/", state))
        self.seed, self.iteration, self.total_steps = (int(number) for number in counters)
        self._ledger.totals[:], self._ledger.lengths[:] = episodes
        self.refining = None
        if "ppo/counters" in state:
            self.refining = self._make_refining()
            self.refining.load_state(state)
            return
        self._average.load_state(state)
