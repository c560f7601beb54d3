"""The learner on torch: the reference backend, built for few CPU cores, where training spends its time.

Parameters, gradients and Adam's moments are flat vectors, and the tensors of the network are views into them,
so a step of the optimiser is six passes over one array. Each minibatch is cut into two shards or more, whose
gradients are added in fixed order; with two threads two shards run at once, each on a core of its own. That
scales better than torch's own threads, which meet after every operation, and the result is the same bits for
any number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from racecraft.errors import CheckpointError, ConfigError
from racecraft.learn import networks, torch_networks
from racecraft.learn.distributions import LOG_STD_MAX, LOG_STD_MIN
from racecraft.learn.flat_weights import join_weights
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats, Weights, below

_BETA1, _BETA2 = 0.9, 0.999
_SHARD_SIZES = (64, 256)  # samples; a smaller shard is mostly overhead, a larger one leaves the L2 cache
_CHUNK_SIZE = 256  # samples of one forward pass without gradient
_HALF_LOG_TWO_PI = 0.9189385332046727
_ENTROPY_OF_UNIT_GAUSSIAN = 1.4189385332046727


class TorchLearner:
    """A ``racecraft.learn.learner.Learner``.

    Args:
        spec: The network.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        num_threads: Threads for forward and backward passes; 0 takes every core the process may use.
        precision: ``"float32"``, ``"bfloat16"``, or ``"auto"``: bfloat16 where the CPU has it.
            Weights, loss and optimiser are float32 in any case.
    """

    def __init__(
        self, spec: NetworkSpec, *, seed: int | None = 0, num_threads: int = 0, precision: str = "auto"
    ) -> None:
        self.spec = spec
        self.observation_shape: tuple[int, ...] = networks.observation_shape(spec)
        self._dtype = _dtype(precision)
        self._shapes = networks.weight_shapes(spec)
        size = sum(int(np.prod(shape)) for shape in self._shapes.values())
        self._flat = torch.zeros(size)
        self._moment1, self._moment2 = torch.zeros(size), torch.zeros(size)
        self._num_updates = 0
        self._num_threads = num_threads or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
        self._pool = ThreadPoolExecutor(num_threads or _num_cores(), "learner", initializer=_prepare_thread)
        self._shards: list[tuple[Tensor, torch_networks.Parameters]] = []
        self._parameters = self._views(self._flat)
        if seed is not None:
            self.load_weights(networks.initial_weights(spec, seed=seed))

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pool and lay out what the sensors tell (N, *sight_shape) as (N, *observation_shape)."""
        return networks.encode(self.spec, frames)

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""

        def forward(rows: slice) -> Tensor:
            x = torch.from_numpy(observations[rows])
            return torch_networks.policy(self._parameters, x, spec=self.spec, dtype=self._dtype)

        return self._in_chunks(forward, len(observations))

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""

        def forward(rows: slice) -> Tensor:
            x, s = torch.from_numpy(observations[rows]), torch.from_numpy(states[rows])
            return torch_networks.critic(self._parameters, x, s, spec=self.spec, dtype=self._dtype)

        return self._in_chunks(forward, len(observations))

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        samples = minibatch.rows if minibatch.rows is not None else np.arange(len(minibatch.advantages))
        size = len(samples)
        shard_size = min(max(-(-size // 2), _SHARD_SIZES[0]), _SHARD_SIZES[1])
        starts = range(0, size, shard_size)
        while len(self._shards) < len(starts):
            gradient = torch.zeros_like(self._flat)
            parameters = self._views(self._flat)
            for name, view in self._views(gradient).items():
                parameters[name].requires_grad_().grad = view
            self._shards.append((gradient, parameters))

        def run(shard: int) -> Tensor:
            gradient, parameters = self._shards[shard]
            gradient.zero_()
            rows = samples[starts[shard] : starts[shard] + shard_size]
            loss, terms = self._loss(parameters, minibatch, rows, objective)
            (loss / size).backward()  # type: ignore[no-untyped-call]
            return terms

        terms = torch.stack(list(self._pool.map(run, range(len(starts))))).sum(0) / size
        gradient = self._shards[0][0]
        for other, _ in self._shards[1 : len(starts)]:
            gradient.add_(other)
        norm = torch.linalg.vector_norm(gradient).item()
        policy_loss, value_loss, entropy, approx_kl, clip_fraction = terms.tolist()
        stats = UpdateStats(
            policy_loss=policy_loss,
            value_loss=value_loss,
            entropy=entropy,
            approx_kl=approx_kl,
            clip_fraction=clip_fraction,
            grad_norm=norm,
        )
        if stats.is_finite:
            if 0 < objective.max_grad_norm < norm:
                gradient.mul_(objective.max_grad_norm / norm)
            self._pool.submit(self._adam, gradient, objective).result()
        return stats

    def weights(self) -> Weights:
        """Copy of the parameters."""
        return {name: view.numpy().copy() for name, view in self._parameters.items()}

    def load_weights(self, weights: Weights) -> None:
        """Replace the parameters; CheckpointError if names or shapes differ."""
        self._load(self._flat, weights)

    def optimizer_state(self) -> Weights:
        """Copy of Adam's moments, ``moment1/<weight>`` and ``moment2/<weight>``, and ``step`` (1,)."""
        state = {"step": np.array([self._num_updates], np.float32)}
        for key, flat in (("moment1", self._moment1), ("moment2", self._moment2)):
            state |= {f"{key}/{name}": view.numpy().copy() for name, view in self._views(flat).items()}
        return state

    def load_optimizer_state(self, state: Weights) -> None:
        """Replace what ``optimizer_state`` gives; CheckpointError if names or shapes differ."""
        for key, flat in (("moment1", self._moment1), ("moment2", self._moment2)):
            self._load(flat, below(f"{key}/", state))
        if "step" not in state:
            raise CheckpointError("The optimiser's state has no 'step'.")
        self._num_updates = int(state["step"][0])

    def _loss(
        self, parameters: torch_networks.Parameters, minibatch: Minibatch, rows: NDArray[np.int64], objective: Objective
    ) -> tuple[Tensor, Tensor]:
        """Sum over samples of the PPO loss, and of the terms of ``UpdateStats`` (5,)."""
        observations, states, actions, old_log_probs, advantages, returns = (
            torch.from_numpy(array[rows])
            for array in (
                minibatch.observations,
                minibatch.states,
                minibatch.actions,
                minibatch.log_probs,
                minibatch.advantages,
                minibatch.returns,
            )
        )
        outputs = torch_networks.policy(parameters, observations, spec=self.spec, dtype=self._dtype)
        log_probs, entropy = log_probs_and_entropy(outputs, actions, is_discrete=self.spec.is_discrete)
        log_ratio = log_probs - old_log_probs
        ratio = log_ratio.exp()
        clipped = ratio.clamp(1 - objective.clip_coef, 1 + objective.clip_coef)
        policy_loss = torch.maximum(-advantages * ratio, -advantages * clipped).sum()

        values = torch_networks.critic(parameters, observations, states, spec=self.spec, dtype=self._dtype)
        if objective.value_loss == "huber":
            value_loss = functional.smooth_l1_loss(values, returns, reduction="sum")
        else:
            value_loss = 0.5 * (values - returns).square().sum()

        loss = policy_loss - objective.ent_coef * entropy + objective.vf_coef * value_loss
        with torch.no_grad():
            kl = ((ratio - 1) - log_ratio).sum()
            outside = ((ratio - 1).abs() > objective.clip_coef).sum()
            return loss, torch.stack([policy_loss, value_loss, entropy, kl, outside.float()])

    @torch.inference_mode()
    def _adam(self, gradient: Tensor, objective: Objective) -> None:
        """One step of Adam (https://arxiv.org/abs/1412.6980) on the flat vectors."""
        self._num_updates += 1
        self._moment1.lerp_(gradient, 1 - _BETA1)
        self._moment2.mul_(_BETA2).addcmul_(gradient, gradient, value=1 - _BETA2)
        correction1, correction2 = 1 - _BETA1**self._num_updates, 1 - _BETA2**self._num_updates
        scale = (self._moment2 / correction2).sqrt_().add_(objective.adam_eps)
        self._flat.addcdiv_(self._moment1, scale, value=-objective.learning_rate / correction1)

    def _in_chunks(self, forward: Callable[[slice], Tensor], size: int) -> NDArray[np.float32]:
        """Run a forward pass over all rows, without gradient, a chunk per thread at a time."""

        def run(start: int) -> NDArray[np.float32]:
            with torch.inference_mode():
                return np.asarray(forward(slice(start, start + _CHUNK_SIZE)).numpy())

        return np.concatenate(list(self._pool.map(run, range(0, max(size, 1), _CHUNK_SIZE))))

    def _views(self, flat: Tensor) -> torch_networks.Parameters:
        """The network's tensors as views into a flat vector."""
        sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        parts = torch.split(flat.detach(), sizes)
        return {name: part.view(shape) for (name, shape), part in zip(self._shapes.items(), parts, strict=True)}

    def _load(self, flat: Tensor, arrays: Weights) -> None:
        flat.copy_(torch.from_numpy(join_weights(arrays, self.spec)))


def log_probs_and_entropy(outputs: Tensor, actions: Tensor, *, is_discrete: bool) -> tuple[Tensor, Tensor]:
    """Log-probability of each action (B,), and the sum of the distributions' entropies ()."""
    if is_discrete:
        log_probs = functional.log_softmax(outputs, dim=1)
        return log_probs.gather(1, actions[:, None])[:, 0], -(log_probs.exp() * log_probs).sum()
    mean, log_std = outputs.chunk(2, dim=1)
    log_std = log_std.clamp(LOG_STD_MIN, LOG_STD_MAX)
    z = (actions - mean) * (-log_std).exp()
    return (-0.5 * z.square() - log_std - _HALF_LOG_TWO_PI).sum(1), (log_std + _ENTROPY_OF_UNIT_GAUSSIAN).sum()


def _num_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _prepare_thread() -> None:
    """One core per thread, and no subnormal numbers: moments of dead units decay into them, at 100 times the cost."""
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)


def _dtype(precision: str) -> torch.dtype:
    choices: dict[str, Any] = {"float32": torch.float32, "bfloat16": torch.bfloat16}
    if precision == "auto":
        native = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)
        return torch.bfloat16 if native() else torch.float32
    if precision not in choices:
        raise ConfigError(f"precision is {precision!r}, expected 'auto', 'float32' or 'bfloat16'.")
    return choices[precision]  # type: ignore[no-any-return]
