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
from torch.nn import functional

from racecraft.errors import CheckpointError, ConfigError
from racecraft.learn import networks, torch_networks
from racecraft.learn.flat_weights import join_weights, split_weights
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats, Weights, below
from racecraft.learn.torch_learner import log_probs_and_entropy

_BETA1, _BETA2 = 0.9, 0.999
_CHUNK_SIZE = 65536  # samples of one forward pass without gradient

Samples = tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]
"""Observations, states, actions, log-probabilities, advantages, returns: as in `Minibatch`, on the device."""


class CudaLearner:
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
        self.spec = spec
        self.device = torch.device(device)
        self.observation_shape: tuple[int, ...] = networks.observation_shape(spec)
        self._dtype = self._choose(precision)
        self._shapes = networks.weight_shapes(spec)
        size = sum(int(np.prod(shape)) for shape in self._shapes.values())
        self._flat, self._gradient, self._moment1, self._moment2 = (
            torch.zeros(size, device=self.device) for _ in range(4)
        )
        self._num_updates = torch.zeros((), device=self.device)
        self._parameters = self._views(self._flat)
        for view in self._parameters.values():
            view.requires_grad_()
        if seed is not None:
            self.load_weights(networks.initial_weights(spec, seed=seed))

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
        return torch_networks.policy(self._parameters, observations, spec=self.spec, dtype=self._dtype)

    @torch.no_grad()
    def estimates(self, observations: Tensor, states: Tensor) -> Tensor:
        """The critic's estimates  (N,)."""
        if self.spec.state_size:
            observations = observations[:0]  # it sees the state alone
        else:
            chunks = range(0, len(observations), _CHUNK_SIZE)
            parts = [observations[i : i + _CHUNK_SIZE] for i in chunks]
            empty = states[:0]
            return torch.cat([self._critic(part, empty) for part in parts])
        return self._critic(observations, states)

    def step(self, samples: Samples, objective: Objective) -> Tensor:
        """One gradient step, not taken where loss or gradient is not finite.

        Returns:
            The fields of `UpdateStats` in their order  (6,), on the device; nothing has been waited for.
        """
        size = len(samples[4])
        with torch.enable_grad():
            loss, terms = self._loss(samples, objective)
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

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pool and lay out camera images (N, H, W) as (N, *observation_shape)."""
        return networks.encode(self.spec, frames)

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        return np.asarray(self.outputs(self._tensor(observations)).cpu().numpy())

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""
        return np.asarray(self.estimates(self._tensor(observations), self._tensor(states)).cpu().numpy())

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        rows = minibatch.rows if minibatch.rows is not None else slice(None)
        arrays = (
            minibatch.observations,
            minibatch.states,
            minibatch.actions,
            minibatch.log_probs,
            minibatch.advantages,
            minibatch.returns,
        )
        observations, states, actions, log_probs, advantages, returns = (self._tensor(a[rows]) for a in arrays)
        stats = self.step((observations, states, actions, log_probs, advantages, returns), objective)
        return stats_of(stats)

    def weights(self) -> Weights:
        """Copy of the parameters."""
        return self._arrays(self._flat)

    def load_weights(self, weights: Weights) -> None:
        """Replace the parameters; CheckpointError if names or shapes differ."""
        self._load(self._flat, weights)

    def optimizer_state(self) -> Weights:
        """Copy of Adam's moments, ``moment1/<weight>`` and ``moment2/<weight>``, and ``step`` (1,)."""
        state = {"step": np.array([self._num_updates.item()], np.float32)}
        for key, flat in (("moment1", self._moment1), ("moment2", self._moment2)):
            state |= {f"{key}/{name}": array for name, array in self._arrays(flat).items()}
        return state

    def load_optimizer_state(self, state: Weights) -> None:
        """Replace what ``optimizer_state`` gives; CheckpointError if names or shapes differ."""
        for key, flat in (("moment1", self._moment1), ("moment2", self._moment2)):
            self._load(flat, below(f"{key}/", state))
        if "step" not in state:
            raise CheckpointError("The optimiser's state has no 'step'.")
        self._num_updates.fill_(float(state["step"][0]))

    # ---- inside

    def _critic(self, observations: Tensor, states: Tensor) -> Tensor:
        return torch_networks.critic(self._parameters, observations, states, spec=self.spec, dtype=self._dtype)

    def _loss(self, samples: Samples, objective: Objective) -> tuple[Tensor, Tensor]:
        """Sum over samples of the PPO loss, and of the terms of `UpdateStats` (5,)."""
        observations, states, actions, old_log_probs, advantages, returns = samples
        outputs = torch_networks.policy(self._parameters, observations, spec=self.spec, dtype=self._dtype)
        log_probs, entropy = log_probs_and_entropy(outputs, actions, is_discrete=self.spec.is_discrete)
        log_ratio = log_probs - old_log_probs
        ratio = log_ratio.exp()
        clipped = ratio.clamp(1 - objective.clip_coef, 1 + objective.clip_coef)
        policy_loss = torch.maximum(-advantages * ratio, -advantages * clipped).sum()
        values = self._critic(observations, states)
        if objective.value_loss == "huber":
            value_loss = functional.smooth_l1_loss(values, returns, reduction="sum")
        else:
            value_loss = 0.5 * (values - returns).square().sum()
        loss = policy_loss - objective.ent_coef * entropy + objective.vf_coef * value_loss
        kl = ((ratio - 1) - log_ratio).sum()
        outside = ((ratio - 1).abs() > objective.clip_coef).sum()
        return loss, torch.stack([policy_loss, value_loss, entropy, kl, outside.float()]).detach()

    def _adam(self, objective: Objective, is_finite: Tensor) -> None:
        """One step of Adam (https://arxiv.org/abs/1412.6980) on the flat vectors, or none."""
        gradient = self._gradient
        step = self._num_updates + 1
        moment1 = torch.lerp(self._moment1, gradient, 1 - _BETA1)
        moment2 = (self._moment2 * _BETA2).addcmul_(gradient, gradient, value=1 - _BETA2)
        correction1, correction2 = 1 - _BETA1**step, 1 - _BETA2**step
        scale = (moment2 / correction2).sqrt_().add_(objective.adam_eps)
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

    def _views(self, flat: Tensor) -> torch_networks.Parameters:
        """The network's tensors as views into a flat vector."""
        parts = torch.split(flat.detach(), [int(np.prod(shape)) for shape in self._shapes.values()])
        return {name: part.view(shape) for (name, shape), part in zip(self._shapes.items(), parts, strict=True)}

    def _arrays(self, flat: Tensor) -> Weights:
        return split_weights(flat.detach().cpu().numpy().copy(), self.spec)

    def _load(self, flat: Tensor, arrays: Weights) -> None:
        flat.copy_(torch.from_numpy(join_weights(arrays, self.spec)))

    def _choose(self, precision: str) -> torch.dtype:
        choices = {"float32": torch.float32, "bfloat16": torch.bfloat16}
        if precision == "auto":
            has = self.device.type == "cuda" and torch.cuda.is_bf16_supported()
            return torch.bfloat16 if has else torch.float32
        if precision not in choices:
            raise ConfigError(f"precision is {precision!r}, expected 'auto', 'float32' or 'bfloat16'.")
        return choices[precision]


def stats_of(values: Tensor) -> UpdateStats:
    """What `CudaLearner.step` gave, on the host."""
    policy_loss, value_loss, entropy, approx_kl, clip_fraction, grad_norm = values.tolist()
    return UpdateStats(
        policy_loss=policy_loss,
        value_loss=value_loss,
        entropy=entropy,
        approx_kl=approx_kl,
        clip_fraction=clip_fraction,
        grad_norm=grad_norm,
    )
