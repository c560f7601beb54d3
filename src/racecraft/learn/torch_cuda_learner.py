"""The learner on a GPU: tensors in and out, one gradient step as one chain of kernels that a CUDA graph can hold.

The loss, the networks and Adam are those of ``torch_learner``; the border of `Learner` in NumPy is kept for
evaluation, checkpoints and tests. Sums on a GPU run in another order, so weights agree to rounding, not to the bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from racecraft.errors import ConfigError
from racecraft.learn import networks
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats
from racecraft.learn.torch_flat import BETA1, BETA2, FlatNetwork, dtype_of
from racecraft.learn.torch_losses import Samples, samples_of

_CHUNK_SIZE = 65536  # samples of one forward pass without gradient


class CudaLearner(FlatNetwork):
    """A ``racecraft.learn.learner.Learner`` whose weights lie on a device.

    Args:
        spec: The network.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        device: ``cuda``, ``cuda:1``; ``cpu`` works as well, slowly.
        precision: ``"float32"``, ``"bfloat16"``, or ``"auto"``: bfloat16 on a GPU that has it.

    Raises:
        ConfigError: torch was built without CUDA, or finds no GPU.
    """

    def __init__(
        self, spec: NetworkSpec, *, seed: int | None = 0, device: str = "cuda", precision: str = "auto"
    ) -> None:
        if device.startswith("cuda") and not torch.cuda.is_available():
            raise ConfigError(
                "Device 'cuda' was asked for, but torch finds no GPU.",
                hint="Use device 'cpu', or install NVIDIA's driver and torch with CUDA: pip install 'racecraft[cuda]'",
            )
        if spec.lenses != 1 or spec.lidar_size:
            raise ConfigError(
                "Device 'cuda' trains with one camera; these sensors are others.", hint="Use device 'cpu' for them."
            )
        kind = torch.device(device)
        has_bfloat16 = kind.type == "cuda" and torch.cuda.is_bf16_supported()
        super().__init__(spec, seed=seed, device=kind, dtype=dtype_of(precision, has_bfloat16=has_bfloat16))
        self._gradient = torch.zeros_like(self._flat)
        for view in self._parameters.values():
            view.requires_grad_()

    # ---- tensors of the device

    def encode_frames(self, frames: Tensor) -> Tensor:
        """What ``networks.encode`` makes of frames uint8 (N, H, W): (N, *observation_shape)."""
        pixels = frames[:, networks.sky_rows(self.spec) :]
        if networks.architecture_of(self.spec).pool == 2:
            wide = pixels.to(torch.int16)
            rows = wide[:, 0::2] + wide[:, 1::2]
            pixels = ((rows[:, :, 0::2] + rows[:, :, 1::2] + 2) >> 2).to(torch.uint8)
        height, width, channels = networks.image_shape(self.spec)
        block = networks.block_size(self.spec)
        folded = pixels.reshape(-1, height, block, width, block).permute(0, 1, 3, 2, 4)
        return folded.reshape(-1, height, width, channels)

    @torch.no_grad()
    def outputs(self, observations: Tensor) -> Tensor:
        """Logits, or means and log standard deviations  (N, P)."""
        return self._policy(self._parameters, observations)

    @torch.no_grad()
    def estimates(self, observations: Tensor, states: Tensor) -> Tensor:
        """The critic's estimates  (N,)."""
        if self.spec.state_size:
            observations = observations[:0]  # it sees the state alone
        else:
            chunks = range(0, len(observations), _CHUNK_SIZE)
            parts = [observations[i : i + _CHUNK_SIZE] for i in chunks]
            empty = states[:0]
            return torch.cat([self._critic(self._parameters, part, empty) for part in parts])
        return self._critic(self._parameters, observations, states)

    def step(self, samples: Samples, objective: Objective) -> Tensor:
        """One gradient step, not taken where loss or gradient is not finite.

        Returns:
            The fields of `UpdateStats` in their order  (6,), on the device; nothing has been waited for.
        """
        size = len(samples[4])
        with torch.enable_grad():
            loss, terms = self._loss(self._parameters, samples, objective)
            parts = torch.autograd.grad(loss / size, list(self._parameters.values()))
        with torch.no_grad():
            torch.cat([part.reshape(-1) for part in parts], out=self._gradient)
            norm = torch.linalg.vector_norm(self._gradient)
            stats = torch.cat([terms / size, norm[None]])
            is_finite = torch.isfinite(stats).all()
            if objective.max_grad_norm > 0:
                self._gradient.mul_((objective.max_grad_norm / norm).clamp(max=1.0))
            self._adam(objective, is_finite)
        return stats

    # ---- the interface of every learner

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        return np.asarray(self.outputs(self._tensor(observations)).cpu().numpy())

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""
        return np.asarray(self.estimates(self._tensor(observations), self._tensor(states)).cpu().numpy())

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        rows = minibatch.rows if minibatch.rows is not None else slice(None)
        return UpdateStats.of(self.step(samples_of(minibatch, rows, device=self.device), objective).tolist())

    # ---- inside

    def _adam(self, objective: Objective, is_finite: Tensor) -> None:
        """One step of Adam on the flat vectors, or none."""
        gradient = self._gradient
        step = self._num_updates + 1
        moment1 = torch.lerp(self._moment1, gradient, 1 - BETA1)
        moment2 = (self._moment2 * BETA2).addcmul_(gradient, gradient, value=1 - BETA2)
        correction1, correction2 = 1 - BETA1**step, 1 - BETA2**step
        eps = objective.adam_eps / correction2.sqrt() if objective.is_eps_hat else objective.adam_eps
        scale = (moment2 / correction2).sqrt_().add_(eps)
        flat = self._flat - objective.learning_rate / correction1 * moment1 / scale
        for kept, new in (
            (self._flat, flat),
            (self._moment1, moment1),
            (self._moment2, moment2),
            (self._num_updates, step),
        ):
            kept.copy_(torch.where(is_finite, new, kept))

    def _tensor(self, array: NDArray[Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)
