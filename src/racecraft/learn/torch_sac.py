"""SAC's networks in torch: an actor over the camera, two critics with targets, a temperature.

The actor is the policy's tower of `racecraft.learn.networks` whose head gives means and log standard deviations.
A critic is a perceptron over the privileged state and the action, or over what a camera tower makes of the frame.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from racecraft.errors import CheckpointError
from racecraft.learn import networks, torch_networks
from racecraft.learn.learner import NetworkSpec, UpdateStats, Weights, below
from racecraft.learn.replay_buffer import Transitions
from racecraft.learn.sac import SACConfig
from racecraft.learn.torch_losses import gaussian, gaussian_densities
from racecraft.learn.torch_optimizers import load_optimizers, optimizer_arrays
from racecraft.learn.torch_subnormals import subnormals_flushed

LOG_STD_MAX = 2.0
"""Of the Gaussian before it is squashed, as AWS's."""
BEGINNERS_LOG_STD = -0.5
_FEATURES = 64  # what a critic's camera tower tells of a frame
_UNITS = (128, 128)  # hidden layers of a critic
_LOG_TWO = 0.6931471805599453

Parameters = dict[str, Tensor]


class TorchSAC:
    """A `racecraft.learn.sac.Backend`.

    Args:
        spec: Of the network that drives: continuous, squashed.
        config: Settings.
        state_size: Columns of privileged state the critics see; 0 gives them the camera.
        seed: Decides the initial weights.
        num_threads: 0 takes every core.
    """

    def __init__(
        self, spec: NetworkSpec, config: SACConfig, *, state_size: int, seed: int, num_threads: int = 0
    ) -> None:
        if num_threads:
            torch.set_num_threads(num_threads)
        self.spec, self.config, self.state_size = spec, config, state_size
        size = spec.num_actions
        self._tower = replace(spec, num_actions=2 * size, is_discrete=True, state_size=1)
        self._camera = replace(self._tower, num_actions=_FEATURES, is_squashed=False)
        actor = networks.initial_weights(self._tower, seed=seed)
        actor["policy.head.bias"][size:] = BEGINNERS_LOG_STD
        generator = torch.Generator().manual_seed(seed)
        critics: Parameters = {}
        for critic in ("q1", "q2"):
            if not state_size:
                camera = networks.initial_weights(self._camera, seed=seed + (critic == "q2"))
                critics |= {
                    name.replace("policy.", f"{critic}."): torch.from_numpy(array)
                    for name, array in camera.items()
                    if name.startswith("policy.")
                }
            inputs = (state_size or _FEATURES) + size
            for i, units in enumerate((*_UNITS, 1), 1):
                weight = torch.empty(units, inputs)
                torch.nn.init.orthogonal_(weight, 2.0**0.5 if units > 1 else 1.0, generator=generator)
                critics[f"{critic}.mlp{i}.weight"], critics[f"{critic}.mlp{i}.bias"] = weight, torch.zeros(units)
                inputs = units
        self._actor = {
            name: torch.from_numpy(array).requires_grad_()
            for name, array in actor.items()
            if name.startswith("policy.")
        }
        self._critics = {name: array.requires_grad_() for name, array in critics.items()}
        self._targets = {name: array.detach().clone() for name, array in self._critics.items()}
        self._log_alpha = torch.tensor(float(np.log(max(config.alpha, 1e-8)))).requires_grad_()
        self._seen = 0.0, 0.0  # the actor's loss and entropy when it learned last
        rate = config.learning_rate
        self._optimizers = {
            "actor": torch.optim.Adam(self._actor.values(), rate, eps=1e-5),
            "critics": torch.optim.Adam(self._critics.values(), rate, eps=1e-5),
            "alpha": torch.optim.Adam([self._log_alpha], rate, eps=1e-5),
        }

    @torch.inference_mode()
    def act(self, observations: NDArray[np.uint8], noise: NDArray[np.float64]) -> NDArray[np.float32]:
        """Actions in [-1, 1] drawn with standard normals (N, A)."""
        actions, _ = self._draw(torch.from_numpy(observations), _tensor(noise))
        return np.asarray(actions.numpy())

    @subnormals_flushed()
    def update(self, batch: Transitions, noise: NDArray[np.float64], *, improves_actor: bool) -> UpdateStats:
        """One step of Adam of the critics, and of actor and temperature; nothing where it is not finite."""
        config = self.config
        observations, next_observations = (
            torch.from_numpy(array) for array in (batch.observations, batch.next_observations)
        )
        states, next_states = torch.from_numpy(batch.states), torch.from_numpy(batch.next_states)
        alpha = self._log_alpha.exp().detach() if config.learns_alpha else torch.tensor(config.alpha)

        with torch.no_grad():
            next_actions, next_log_probs = self._draw(next_observations, _tensor(noise[0]))
            judged = self._judge(self._targets, next_observations, next_states, next_actions)
            following = torch.minimum(*judged) - alpha * next_log_probs
            goes_on = torch.from_numpy(~batch.terminated).float()
            goal = torch.from_numpy(batch.rewards) + config.gamma * goes_on * following
        values = self._judge(self._critics, observations, states, torch.from_numpy(batch.actions))
        value_loss = sum((0.5 * (value - goal).square().mean() for value in values), torch.zeros(()))
        self._optimizers["critics"].zero_grad()
        value_loss.backward()  # type: ignore[no-untyped-call]
        norm = _norm(self._critics)
        if not np.isfinite([value_loss.item(), norm]).all():
            return _stats(0.0, value_loss.item(), 0.0, norm)
        self._optimizers["critics"].step()
        with torch.no_grad():
            for name, target in self._targets.items():
                target.lerp_(self._critics[name], config.tau)

        policy_loss, entropy = self._seen
        if improves_actor:
            actions, log_probs = self._draw(observations, _tensor(noise[1]))
            frozen = {name: array.detach() for name, array in self._critics.items()}
            loss = (alpha * log_probs - torch.minimum(*self._judge(frozen, observations, states, actions))).mean()
            self._optimizers["actor"].zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            norm, policy_loss = _norm(self._actor), loss.item()
            entropy = -log_probs.mean().item()
            if not np.isfinite([policy_loss, norm]).all():
                return _stats(policy_loss, value_loss.item(), entropy, norm)
            self._optimizers["actor"].step()
            if config.learns_alpha:
                self._optimizers["alpha"].zero_grad()
                missing = (log_probs - self.spec.num_actions).detach().mean()  # nats below the target entropy
                (-self._log_alpha * missing).backward()  # type: ignore[no-untyped-call]
                self._optimizers["alpha"].step()
            self._seen = policy_loss, entropy
        return _stats(policy_loss, value_loss.item(), entropy, norm)

    def driving_weights(self) -> Weights:
        """The actor as a squashed policy: the head's rows of means, and a spread that evaluation does not use."""
        size = self.spec.num_actions
        weights = {name: array.detach().numpy().copy() for name, array in self._actor.items()}
        for name in ("policy.head.weight", "policy.head.bias"):
            weights[name] = weights[name][:size].copy()
        weights["policy.log_std"] = np.full(size, BEGINNERS_LOG_STD, np.float32)
        return weights

    def state(self) -> dict[str, NDArray[Any]]:
        """Parameters and Adam's moments."""
        arrays: dict[str, NDArray[Any]] = {name: array.detach().numpy().copy() for name, array in self._parts().items()}
        return arrays | {f"adam/{name}": array for name, array in optimizer_arrays(self._optimizers).items()}

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave; CheckpointError where it does not fit."""
        parts = self._parts()
        for name, array in parts.items():
            if name not in state or state[name].shape != tuple(array.shape):
                raise CheckpointError(f"The training state has no {name} of shape {tuple(array.shape)}.")
        with torch.no_grad():
            for name, parameter in parts.items():
                parameter.copy_(torch.from_numpy(state[name]))
        load_optimizers(self._optimizers, below("adam/", state))

    def _parts(self) -> Parameters:
        named = {f"actor/{name}": array for name, array in self._actor.items()}
        named |= {f"critics/{name}": array for name, array in self._critics.items()}
        named |= {f"targets/{name}": array for name, array in self._targets.items()}
        return {**named, "log_alpha": self._log_alpha}

    def _draw(self, observations: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (B, A), and their log-densities (B,) after squashing."""
        outputs = torch_networks.sensor_tower(
            self._actor, observations, spec=self._tower, tower="policy", dtype=torch.float32
        )
        mean, log_std = gaussian(outputs, highest=LOG_STD_MAX)
        raw = mean + log_std.exp() * noise
        # log(1 - tanh(x)²), without the cancellation
        squashing = 2.0 * (_LOG_TWO - raw - functional.softplus(-2.0 * raw))
        return raw.tanh(), (gaussian_densities(noise, log_std) - squashing).sum(1)

    def _judge(self, critics: Parameters, observations: Tensor, states: Tensor, actions: Tensor) -> list[Tensor]:
        """Both critics' values of actions  (B,) each."""
        values = []
        for critic in ("q1", "q2"):
            seen = states[:, : self.state_size]
            if not self.state_size:
                seen = torch_networks.sensor_tower(
                    critics, observations, spec=self._camera, tower=critic, dtype=torch.float32
                ).relu()
            x = torch.cat([seen, actions], dim=1)
            for i in range(1, len(_UNITS) + 2):
                x = functional.linear(x, critics[f"{critic}.mlp{i}.weight"], critics[f"{critic}.mlp{i}.bias"])
                x = x.relu() if i <= len(_UNITS) else x
            values.append(x[:, 0])
        return values


def _tensor(noise: NDArray[np.float64]) -> Tensor:
    return torch.from_numpy(noise.astype(np.float32))


def _norm(parameters: Parameters) -> float:
    """Global norm of the gradient."""
    gradients = [array.grad for array in parameters.values() if array.grad is not None]
    return float(torch.linalg.vector_norm(torch.stack([torch.linalg.vector_norm(g) for g in gradients])).item())


def _stats(policy_loss: float, value_loss: float, entropy: float, norm: float) -> UpdateStats:
    return UpdateStats.of([policy_loss, value_loss, entropy, float("nan"), float("nan"), norm])
