"""The learner on torch: the reference backend, built for few CPU cores, where training spends its time.

Each minibatch is cut into two shards or more, whose
gradients are added in fixed order; with two threads two shards run at once, each on a core of its own. That
scales better than torch's own threads, which meet after every operation, and the result is the same bits for
any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from racecraft.learn import torch_networks
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats
from racecraft.learn.torch_flat import BETA1, BETA2, FlatNetwork, dtype_of
from racecraft.learn.torch_losses import samples_of
from racecraft.system import num_cores

_SHARD_SIZES = (64, 256)  # samples; a smaller shard is mostly overhead, a larger one leaves the L2 cache
_CHUNK_SIZE = 256  # samples of one forward pass without gradient


class TorchLearner(FlatNetwork):
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
        has_bfloat16 = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)()
        dtype = dtype_of(precision, has_bfloat16=has_bfloat16)
        super().__init__(spec, seed=seed, device=torch.device("cpu"), dtype=dtype)
        self._pool = ThreadPoolExecutor(num_threads or num_cores(), "learner", initializer=_prepare_thread)
        self._shards: list[tuple[Tensor, torch_networks.Parameters]] = []

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""

        def forward(rows: slice) -> Tensor:
            x = torch.from_numpy(observations[rows])
            return self._policy(self._parameters, x)

        return self._in_chunks(forward, len(observations))

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""

        def forward(rows: slice) -> Tensor:
            x, s = torch.from_numpy(observations[rows]), torch.from_numpy(states[rows])
            return self._critic(self._parameters, x, s)

        return self._in_chunks(forward, len(observations))

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        chosen = minibatch.rows if minibatch.rows is not None else np.arange(len(minibatch.advantages))
        size = len(chosen)
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
            rows = chosen[starts[shard] : starts[shard] + shard_size]
            samples = samples_of(minibatch, rows, device=self.device)
            loss, terms = self._loss(parameters, samples, objective)
            (loss / size).backward()  # type: ignore[no-untyped-call]
            return terms

        terms = torch.stack(list(self._pool.map(run, range(len(starts))))).sum(0) / size
        gradient = self._shards[0][0]
        for other, _ in self._shards[1 : len(starts)]:
            gradient.add_(other)
        norm = torch.linalg.vector_norm(gradient).item()
        stats = UpdateStats.of([*terms.tolist(), norm])
        if stats.is_finite:
            if 0 < objective.max_grad_norm < norm:
                gradient.mul_(objective.max_grad_norm / norm)
            self._pool.submit(self._adam, gradient, objective).result()
        return stats

    @torch.inference_mode()
    def _adam(self, gradient: Tensor, objective: Objective) -> None:
        """One step of Adam on the flat vectors."""
        self._num_updates += 1
        step = int(self._num_updates)
        self._moment1.lerp_(gradient, 1 - BETA1)
        self._moment2.mul_(BETA2).addcmul_(gradient, gradient, value=1 - BETA2)
        correction1, correction2 = 1 - BETA1**step, 1 - BETA2**step
        scale = (self._moment2 / correction2).sqrt_().add_(objective.eps_at(step))
        self._flat.addcdiv_(self._moment1, scale, value=-objective.learning_rate / correction1)

    def _in_chunks(self, forward: Callable[[slice], Tensor], size: int) -> NDArray[np.float32]:
        """Run a forward pass over all rows, without gradient, a chunk per thread at a time."""

        def run(start: int) -> NDArray[np.float32]:
            with torch.inference_mode():
                return np.asarray(forward(slice(start, start + _CHUNK_SIZE)).numpy())

        return np.concatenate(list(self._pool.map(run, range(0, max(size, 1), _CHUNK_SIZE))))


def _prepare_thread() -> None:
    """One core per thread, and no subnormal numbers: moments of dead units decay into them, at 100 times the cost."""
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
