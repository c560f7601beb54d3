"""A network in torch whose parameters and Adam's moments are flat vectors: what every learner in torch is made of.

The network's tensors are views into the flat vector, so that a step of the optimiser is a few passes over one array.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from racecraft.checks import check_choice
from racecraft.errors import CheckpointError
from racecraft.learn import networks, torch_networks
from racecraft.learn.flat_weights import join_weights, split_weights
from racecraft.learn.learner import ADAM_BETA2, NetworkSpec, Objective, Weights, below
from racecraft.learn.torch_losses import Samples, ppo_loss

BETA1, BETA2 = 0.9, ADAM_BETA2
"""Of Adam (https://arxiv.org/abs/1412.6980)."""


class FlatNetwork:
    """The part of a ``racecraft.learn.learner.Learner`` that keeps and hands out what was learned.

    Args:
        spec: The network.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        device: Where the vectors lie.
        dtype: Of the network's arithmetic; the vectors are float32 in any case.
    """

    def __init__(self, spec: NetworkSpec, *, seed: int | None, device: torch.device, dtype: torch.dtype) -> None:
        self.spec = spec
        self.device = device
        self.sight_shape: tuple[int, ...] = networks.sight_shape(spec)
        self.observation_shape: tuple[int, ...] = networks.observation_shape(spec)
        self._dtype = dtype
        self._shapes = networks.weight_shapes(spec)
        self._sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        self._flat, self._moment1, self._moment2 = (torch.zeros(sum(self._sizes), device=device) for _ in range(3))
        self._num_updates = torch.zeros((), device=device)  # steps of Adam
        self._parameters = self._views(self._flat)
        if seed is not None:
            self.load_weights(networks.initial_weights(spec, seed=seed))

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pool and lay out what the sensors tell (N, *sight_shape) as (N, *observation_shape)."""
        return networks.encode(self.spec, frames)

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

    def _policy(self, parameters: torch_networks.Parameters, observations: Tensor) -> Tensor:
        return torch_networks.policy(parameters, observations, spec=self.spec, dtype=self._dtype)

    def _critic(self, parameters: torch_networks.Parameters, observations: Tensor, states: Tensor) -> Tensor:
        return torch_networks.critic(parameters, observations, states, spec=self.spec, dtype=self._dtype)

    def _loss(
        self, parameters: torch_networks.Parameters, samples: Samples, objective: Objective
    ) -> tuple[Tensor, Tensor]:
        """What `ppo_loss` says of the samples."""
        observations, states = samples[:2]
        outputs = self._policy(parameters, observations)
        values = self._critic(parameters, observations, states)
        return ppo_loss(outputs, values, samples, objective, is_discrete=self.spec.is_discrete)

    def _views(self, flat: Tensor) -> torch_networks.Parameters:
        """The network's tensors as views into a flat vector."""
        parts = torch.split(flat.detach(), self._sizes)
        return {name: part.view(shape) for (name, shape), part in zip(self._shapes.items(), parts, strict=True)}

    def _arrays(self, flat: Tensor) -> Weights:
        return split_weights(flat.detach().cpu().numpy().copy(), self.spec)

    def _load(self, flat: Tensor, arrays: Weights) -> None:
        flat.copy_(torch.from_numpy(join_weights(arrays, self.spec)))


def dtype_of(precision: str, *, has_bfloat16: bool) -> torch.dtype:
    """What a network computes in: ``float32``, ``bfloat16``, or ``auto``, bfloat16 where the hardware has it."""
    check_choice("precision", precision, ("auto", "float32", "bfloat16"))
    is_short = has_bfloat16 if precision == "auto" else precision == "bfloat16"
    return torch.bfloat16 if is_short else torch.float32
