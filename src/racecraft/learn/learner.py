"""What PPO needs from a network that can learn: the border between the algorithm and its backend.

Only NumPy arrays and plain numbers cross it. A backend owns the weights, the forward passes, the gradient of
the loss and the optimiser; sampling, log-probabilities of what was sampled, advantages and shuffling stay
outside, so that a run depends on its seed alone, whichever backend trains it.

    frames ──encode──▶ observations ──policy──▶ policy outputs ──(racecraft.learn.distributions)──▶ actions
                            └────────values──▶ values ──(GAE)──▶ minibatches ──update──▶ new weights

Shape letters: N cars, M samples, B of them in a minibatch, A action dimensions, S privileged state, P policy outputs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

ADAM_BETA2 = 0.999
"""Decay of Adam's second moment in every backend."""

Weights = dict[str, NDArray[np.float32]]
"""Parameters by name, as listed by ``racecraft.learn.networks.weight_shapes``."""


@dataclass(frozen=True, kw_only=True)
class NetworkSpec:
    """Which network to build; with a seed it determines the initial weights."""

    name: str = "RACECRAFT_SMALL"
    """Architecture, one of ``racecraft.learn.networks.network_names()``."""
    num_actions: int
    """Discrete: how many actions there are. Continuous: the number of action dimensions."""
    is_discrete: bool = True
    """True for a categorical policy, False for a Gaussian one over [-1, 1] in each dimension."""
    state_size: int = 0
    """Columns of privileged state the critic sees; 0 gives it a camera tower of its own, as AWS does."""
    frame_shape: tuple[int, int] = (120, 160)
    """Height and width of the greyscale camera image, pixels."""
    lenses: int = 1
    """Images of one camera: 2 for a stereo pair."""
    lidar_size: int = 0
    """Values of the LIDAR sensor; 0 without one."""
    is_squashed: bool = False
    """Whether the best continuous action is the hyperbolic tangent of the mean (SAC, TD3), not the mean itself."""

    @property
    def policy_size(self) -> int:
        """P, the policy's outputs for one car: logits, or means followed by log standard deviations."""
        return self.num_actions if self.is_discrete else 2 * self.num_actions


@dataclass(frozen=True, kw_only=True)
class Objective:
    """The clipped PPO loss and the step taken on it."""

    learning_rate: float
    """Adam's step size."""
    clip_coef: float
    """How far the probability ratio may move from 1 before its gradient vanishes."""
    ent_coef: float
    """Weight of the entropy bonus."""
    vf_coef: float
    """Weight of the value loss."""
    value_loss: str
    """``"mse"`` (half the squared error) or ``"huber"`` (the same within 1, linear outside)."""
    max_grad_norm: float
    """Global gradient norm above which the gradient is scaled down; 0 leaves it alone."""
    adam_eps: float = 1e-5
    """Adam's epsilon; 1e-5 as in AWS's trainer and CleanRL."""
    is_eps_hat: bool = False
    """``adam_eps`` is the ε̂ of https://arxiv.org/abs/1412.6980, section 2, added to the root of the second moment
    before that is corrected, as TensorFlow does and so AWS: the first steps on small gradients are shorter."""

    def eps_at(self, step: int) -> float:
        """What is added to the root of the corrected second moment in the `step`-th step, counted from 1."""
        if not self.is_eps_hat:
            return self.adam_eps
        power, factor = 1.0, ADAM_BETA2  # of factors, as the bits of `**` are those of a machine's library
        while step:
            step, is_odd = divmod(step, 2)
            power *= factor if is_odd else 1.0
            factor *= factor
        return self.adam_eps / math.sqrt(1.0 - power)


@dataclass(frozen=True, kw_only=True)
class Minibatch:
    """Samples for one gradient step: all of M, or those of `rows`. Arrays are C-contiguous."""

    observations: NDArray[np.uint8]
    """What the sensors told, encoded  (M, *observation_shape)."""
    states: NDArray[np.float32]
    """Privileged state  (M, S)."""
    actions: NDArray[Any]
    """Indices int64 (M,), or float32 (M, A) before clipping to [-1, 1]."""
    log_probs: NDArray[np.float32]
    """Log-probability of each action under the policy that took it  (M,)."""
    advantages: NDArray[np.float32]
    """Already normalised, if they are to be  (M,)."""
    returns: NDArray[np.float32]
    """Value targets  (M,)."""
    rows: NDArray[np.int64] | None = None
    """Which samples make up the minibatch, in this order  (B,); saves copying them out of a rollout. None: all."""


@dataclass(frozen=True, kw_only=True)
class UpdateStats:
    """What one gradient step saw, before it was applied."""

    policy_loss: float
    value_loss: float
    entropy: float
    approx_kl: float
    """Mean of (ratio - 1) - log ratio: how far the policy moved since the rollout, in nats."""
    clip_fraction: float
    """Share of samples whose ratio lay outside the clip range."""
    grad_norm: float
    """Global L2 norm of the gradient before clipping."""

    @classmethod
    def of(cls, values: Iterable[float]) -> UpdateStats:
        """From all numbers in the order above."""
        return cls(**dict(zip((field.name for field in fields(cls)), values, strict=True)))

    @classmethod
    def mean(cls, stats: Sequence[UpdateStats]) -> UpdateStats:
        """Number by number; NaN where there are none."""
        names = [field.name for field in fields(cls)]
        return cls.of(float(np.mean([getattr(one, name) for one in stats])) if stats else math.nan for name in names)

    @property
    def is_finite(self) -> bool:
        """Whether loss and gradient are ordinary numbers, that is, whether the step was applied."""
        return bool(np.isfinite([self.policy_loss, self.value_loss, self.entropy, self.grad_norm]).all())


class Learner(Protocol):
    """A policy and a critic that improve by gradient steps."""

    @property
    def spec(self) -> NetworkSpec:
        """The network it was built with."""

    @property
    def sight_shape(self) -> tuple[int, ...]:
        """Shape of what `encode` takes for one car, as `racecraft.learn.networks.sight_shape` has it."""

    @property
    def observation_shape(self) -> tuple[int, ...]:
        """Shape of one observation."""

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Do once per frame what no gradient reaches: pool the image and lay it out for the first layer.

        Args:
            frames: What the sensors tell: camera images  (N, H, W), those of two lenses  (N, 2, H, W), or, with a
                LIDAR, their bytes and behind them the LIDAR's  (N, *sight_shape).

        Returns:
            New array  (N, *observation_shape).
        """

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimate of the return  (N,)."""

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""

    def weights(self) -> Weights:
        """Copy of the parameters."""

    def load_weights(self, weights: Weights) -> None:
        """Replace the parameters.

        Raises:
            CheckpointError: Names or shapes differ from this network's.
        """

    def optimizer_state(self) -> Weights:
        """Copy of what the optimiser remembers: moments named after the weights, and ``step``."""

    def load_optimizer_state(self, state: Weights) -> None:
        """Replace what the optimiser remembers; the same errors as ``load_weights``."""


@contextmanager
def holding(learner: Learner, weights: Weights) -> Iterator[None]:
    """Within, the learner holds these weights; afterwards its own again."""
    own = learner.weights()
    learner.load_weights(weights)
    try:
        yield
    finally:
        learner.load_weights(own)


def below(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays whose names begin so, under the rest of their names."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
