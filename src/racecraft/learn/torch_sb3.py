"""Stable-Baselines3 on our cars: its algorithms, our networks, our checkpoints.

A policy here is a tower of `racecraft.learn.networks` with one linear layer behind it, so what any of these
algorithms learned is published under our own names and driven by the native learner: torch is needed for training only.
(What DQN publishes as logits are the values of the actions; the best one is the same.)
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor, nn

from racecraft.checks import require
from racecraft.errors import CheckpointError, ConfigError, TrainingError
from racecraft.learn import networks, torch_networks
from racecraft.learn.learner import Learner, NetworkSpec, UpdateStats, Weights, below
from racecraft.learn.ledger import Ended, EpisodeLedger
from racecraft.learn.ppo import Environment, IterationStats
from racecraft.learn.sb3 import CONTINUOUS_ONLY, DISCRETE_ONLY, SB3Config
from racecraft.learn.torch_optimizers import load_optimizers, optimizer_arrays
from racecraft.learn.torch_subnormals import subnormals_flushed

_CLASSES: dict[str, Any] = {"ppo": PPO, "a2c": A2C, "dqn": DQN, "sac": SAC, "td3": TD3}
_LOSSES = {
    "policy_loss": ("train/policy_gradient_loss", "train/policy_loss", "train/actor_loss"),
    "value_loss": ("train/value_loss", "train/critic_loss", "train/loss"),
    "entropy": ("train/entropy_loss",),
    "approx_kl": ("train/approx_kl",),
    "clip_fraction": ("train/clip_fraction",),
}


class SB3:
    """An algorithm of Stable-Baselines3 and its place in training; a `racecraft.learn.Algorithm`.

    Args:
        name: One of `racecraft.learn.sb3.SB3_ALGORITHMS`.
        config: Settings.
        learner: Drives evaluations with the policy's weights.
        environment: The cars; must have ``config.num_envs`` of them, at the start of an episode.
        seed: Decides weights and sampling; it sets torch's and NumPy's global generators, as the library does.
        num_threads: Of torch; 0 leaves it alone.

    Raises:
        ConfigError: The algorithm does not go with the actions or the environment.
    """

    def __init__(
        self,
        name: str,
        config: SB3Config,
        learner: Learner,
        environment: Environment,
        *,
        seed: int = 0,
        num_threads: int = 0,
    ) -> None:
        spec = learner.spec
        wanted = "discrete" if name in DISCRETE_ONLY else "continuous" if name in CONTINUOUS_ONLY else ""
        if wanted and spec.is_discrete != (wanted == "discrete"):
            raise ConfigError(f"sb3:{name} needs {wanted} actions.")
        is_driven = config.num_envs == environment.num_envs
        require("num_envs", config.num_envs, is_driven, f"the environment's {environment.num_envs}")
        if num_threads:
            torch.set_num_threads(num_threads)
        self.name, self.config, self.learner = name, config, learner
        self.iteration = 0
        self.prefers_average = False
        self._cars = _Cars(environment, learner)
        self._model = _CLASSES[name]("MlpPolicy", self._cars, seed=seed, device="cpu", **_arguments(name, config, spec))
        self._model.set_logger(Logger(folder=None, output_formats=[]))
        self._model.train = subnormals_flushed()(self._model.train)  # the gradient steps, not the cars between them
        if name == "dqn":
            model = self._model  # every call of learn() is one iteration, so its own schedule would begin anew
            model.exploration_schedule = lambda _: max(0.05, 1.0 - 0.95 * model.num_timesteps / 10_000)

    @property
    def spec(self) -> NetworkSpec:
        """The network that drives."""
        return self.learner.spec

    @property
    def total_steps(self) -> int:
        """Camera steps since the start of training."""
        return int(self._model.num_timesteps)

    def iterate(self) -> IterationStats:
        """Drive ``num_steps`` steps of every car, learning as the library does.

        Raises:
            TrainingError: The weights are no longer finite.
        """
        cars, before, started = self._cars, self.total_steps, time.perf_counter()
        cars.begin_iteration()
        steps = self.config.num_steps * self.config.num_envs
        self._model.learn(total_timesteps=steps, reset_num_timesteps=False, log_interval=None)
        weights = self.weights()
        if not all(np.isfinite(array).all() for array in weights.values()):
            raise TrainingError(
                "The policy's weights are not finite.", hint="Lower learning_rate, or check the reward."
            )
        self.iteration += 1
        spent = time.perf_counter() - started
        seen = self._model.logger.name_to_value
        losses = {
            name: next((float(seen[key]) for key in keys if key in seen), float("nan"))
            for name, keys in _LOSSES.items()
        }
        losses["entropy"] *= -1.0
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=self.total_steps - before,
            ended=tuple(cars.ended),
            losses=UpdateStats(**losses, grad_norm=float("nan")),
            explained_variance=float(seen.get("train/explained_variance", float("nan"))),
            environment_seconds=cars.seconds,
            policy_seconds=0.0,
            update_seconds=spent - cars.seconds,
        )

    @contextmanager
    def driving(self) -> Iterator[None]:
        """Within, the learner holds the policy."""
        self.learner.load_weights({**self.learner.weights(), **self.weights()})
        yield

    def weights(self) -> Weights:
        """The policy under our names; no critic."""
        policy = self._model.policy
        if self.name in ("ppo", "a2c"):
            tower, head = policy.features_extractor, policy.action_net
        elif self.name == "dqn":
            tower, head = policy.q_net.features_extractor, policy.q_net.q_net[-1]
        else:
            tower = policy.actor.features_extractor
            head = policy.actor.mu if self.name == "sac" else policy.actor.mu[0]
        weights = {f"policy.{name}": array for name, array in tower.named_parameters()}
        weights |= {"policy.head.weight": head.weight, "policy.head.bias": head.bias}
        if not self.spec.is_discrete:
            spread = getattr(policy, "log_std", None)
            weights["policy.log_std"] = torch.zeros(self.spec.num_actions) if spread is None else spread
        return {name: array.detach().cpu().numpy().copy() for name, array in weights.items()}

    # ---- resume

    def state(self) -> dict[str, NDArray[Any]]:
        """Weights, optimisers, counters; neither what is remembered nor the library's random generators."""
        arrays: dict[str, NDArray[Any]] = {f"weights/{name}": array for name, array in self.weights().items()}
        for name, tensor in self._model.policy.state_dict().items():
            arrays[f"sb3/policy/{name}"] = tensor.detach().cpu().numpy().copy()
        arrays |= {f"sb3/optimizer/{name}": array for name, array in optimizer_arrays(self._optimizers()).items()}
        if (log_alpha := getattr(self._model, "log_ent_coef", None)) is not None:
            arrays["sb3/log_alpha"] = log_alpha.detach().cpu().numpy().copy()
        counters = [self.iteration, self._model.num_timesteps, self._model._n_updates]
        return {**arrays, "sb3/counters": np.array(counters, np.int64)}

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave.

        Raises:
            CheckpointError: It belongs to another network or algorithm.
        """
        model = self._model
        try:
            given = below("sb3/policy/", state)
            model.policy.load_state_dict({name: torch.from_numpy(array) for name, array in given.items()})
            load_optimizers(self._optimizers(), below("sb3/optimizer/", state))
            if getattr(model, "log_ent_coef", None) is not None:
                with torch.no_grad():
                    model.log_ent_coef.copy_(torch.from_numpy(state["sb3/log_alpha"]))
            counters = state["sb3/counters"]
        except (KeyError, ValueError, RuntimeError) as error:
            raise CheckpointError(f"The training state is not of sb3:{self.name}: {error}.") from error
        self.iteration, model.num_timesteps, model._n_updates = (int(number) for number in counters)

    def _optimizers(self) -> dict[str, torch.optim.Optimizer]:
        policy, model = self._model.policy, self._model
        if self.name in ("sac", "td3"):
            found = {"actor": policy.actor.optimizer, "critic": policy.critic.optimizer}
            alpha = getattr(model, "ent_coef_optimizer", None)
            return found if alpha is None else {**found, "alpha": alpha}
        return {"policy": policy.optimizer}


class SensorTower(BaseFeaturesExtractor):
    """The sensors' tower of one of our networks without its head, over flat observations of bytes."""

    def __init__(self, observation_space: spaces.Box, spec: NetworkSpec) -> None:
        shapes = networks.weight_shapes(spec)
        super().__init__(observation_space, shapes["policy.head.weight"][1])
        self.spec = spec
        for name, shape in shapes.items():
            tower, *layer = name.split(".")
            if tower == "policy" and layer[-1] == "weight" and layer[0] != "head":
                # the stride is given where the layer is used: these modules hold and begin the weights
                made = nn.Conv2d(shape[1], shape[0], shape[2]) if len(shape) == 4 else nn.Linear(shape[1], shape[0])
                self.add_module(layer[0], made)

    def forward(self, observations: Tensor) -> Tensor:
        """What the head sees  (B, units), for frames (B, bytes)."""
        frames = observations.view(len(observations), *networks.observation_shape(self.spec))
        parameters: torch_networks.Parameters = {f"policy.{name}": array for name, array in self.named_parameters()}
        return torch_networks.sensor_features(parameters, frames, spec=self.spec, tower="policy", dtype=torch.float32)


class _Cars(VecEnv):
    """Our batch of cars in the library's words; observations are encoded frames, flat."""

    def __init__(self, environment: Environment, learner: Learner) -> None:
        size = int(np.prod(learner.observation_shape))
        spec = learner.spec
        actions: spaces.Space[Any] = (
            spaces.Discrete(spec.num_actions)
            if spec.is_discrete
            else spaces.Box(-1.0, 1.0, (spec.num_actions,), np.float32)
        )
        super().__init__(environment.num_envs, spaces.Box(0, 255, (size,), np.uint8), actions)
        self.environment, self.learner = environment, learner
        self.seconds = 0.0
        self.ended: list[Ended] = []
        self._actions: NDArray[Any] = np.zeros(0)
        self._ledger = EpisodeLedger(environment.num_envs)

    def begin_iteration(self) -> None:
        """Count anew."""
        self.seconds, self.ended = 0.0, []

    def reset(self) -> NDArray[np.uint8]:
        """Where the cars are; they are at the start of an episode, or go on after a resume."""
        return self._look()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Remember what to do."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.uint8], NDArray[Any], NDArray[np.bool_], list[dict[str, Any]]]:
        """Drive one step; a car whose episode ended begins the next one at once."""
        started = time.perf_counter()
        actions = self._actions if self._actions.ndim == 1 else self._actions.astype(np.float32).clip(-1.0, 1.0)
        rewards, terminated, truncated = self.environment.step(actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self.ended += self._ledger.add(rewards, done)
        if done.any():
            last = self._look()
            for car in np.flatnonzero(done).tolist():
                is_cut = bool(truncated[car] and not terminated[car])
                infos[car] = {"terminal_observation": last[car], "TimeLimit.truncated": is_cut}
            self.environment.reset(done)
        observations = self._look()
        self.seconds += time.perf_counter() - started
        return observations, rewards.astype(np.float32), done, infos

    def _look(self) -> NDArray[np.uint8]:
        return self.learner.encode(self.environment.observe()[0]).reshape(self.num_envs, -1)

    def close(self) -> None:
        """Nothing: the cars belong to the training."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The library asks for a render mode only."""
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """There is nothing to set."""

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """There is nothing to call."""
        return [None] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No car is wrapped."""
        return [False] * self.num_envs


def _arguments(name: str, config: SB3Config, spec: NetworkSpec) -> dict[str, Any]:
    """What the library's constructor is given."""
    heads: Any = {"pi": [], "vf": [64]} if name in ("ppo", "a2c") else {"pi": [], "qf": [64, 64]}
    arguments: dict[str, Any] = {
        "gamma": config.gamma,
        "policy_kwargs": {
            "net_arch": [] if name == "dqn" else heads,
            "features_extractor_class": SensorTower,
            "features_extractor_kwargs": {"spec": spec},
            "normalize_images": False,
        },
    }
    if config.learning_rate:
        arguments["learning_rate"] = config.learning_rate
    if config.batch_size and name != "a2c":
        arguments["batch_size"] = config.batch_size
    if name in ("ppo", "a2c"):
        arguments["n_steps"] = config.num_steps if name == "ppo" else min(config.num_steps, 8)
        return arguments
    updates = max(1, round(config.updates_per_step * config.num_envs))
    return arguments | {
        "buffer_size": config.buffer_size,
        "learning_starts": config.learning_starts,
        "train_freq": 1,
        "gradient_steps": updates,
    }
