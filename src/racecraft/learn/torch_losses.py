"""The clipped PPO loss in torch, and the distributions it is made of: the same for every device."""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from racecraft.learn.distributions import LOG_STD_MAX, LOG_STD_MIN
from racecraft.learn.learner import Minibatch, Objective

_HALF_LOG_TWO_PI: Final = 0.9189385332046727
_ENTROPY_OF_UNIT_GAUSSIAN: Final = 1.4189385332046727

Samples = tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]
"""Observations, states, actions, log-probabilities, advantages, returns: as in `Minibatch`, on the device."""


def samples_of(minibatch: Minibatch, rows: NDArray[np.int64] | slice, *, device: torch.device) -> Samples:
    """Some rows of a minibatch's arrays, on a device."""
    arrays = (
        minibatch.observations,
        minibatch.states,
        minibatch.actions,
        minibatch.log_probs,
        minibatch.advantages,
        minibatch.returns,
    )
    observations, states, actions, log_probs, advantages, returns = (
        torch.from_numpy(np.ascontiguousarray(array[rows])).to(device) for array in arrays
    )
    return observations, states, actions, log_probs, advantages, returns


def gaussian(outputs: Tensor, *, highest: float = LOG_STD_MAX) -> tuple[Tensor, Tensor]:
    """Means and log standard deviations (B, A) of a policy's outputs (B, 2 A); the latter up to `highest`."""
    mean, log_std = outputs.chunk(2, dim=1)
    return mean, log_std.clamp(LOG_STD_MIN, highest)


def gaussian_densities(z: Tensor, log_std: Tensor) -> Tensor:
    """Log-density in each dimension of what lies `z` standard deviations from the mean  (B, A)."""
    return -0.5 * z.square() - log_std - _HALF_LOG_TWO_PI


def log_probs_and_entropy(outputs: Tensor, actions: Tensor, *, is_discrete: bool) -> tuple[Tensor, Tensor]:
    """Log-probability of each action (B,), and the sum of the distributions' entropies ()."""
    if is_discrete:
        log_probs = functional.log_softmax(outputs, dim=1)
        return log_probs.gather(1, actions[:, None])[:, 0], -(log_probs.exp() * log_probs).sum()
    mean, log_std = gaussian(outputs)
    z = (actions - mean) * (-log_std).exp()
    return gaussian_densities(z, log_std).sum(1), (log_std + _ENTROPY_OF_UNIT_GAUSSIAN).sum()


def ppo_loss(
    outputs: Tensor, values: Tensor, samples: Samples, objective: Objective, *, is_discrete: bool
) -> tuple[Tensor, Tensor]:
    """Sum over samples of the PPO loss, and of the terms of `UpdateStats` without the gradient's norm  (5,).

    Args:
        outputs: Of the policy for the samples' observations  (B, P).
        values: Of the critic for the same  (B,).
        samples: What was done, and how it turned out.
        objective: The loss.
        is_discrete: Which distribution the outputs describe.
    """
    _, _, actions, old_log_probs, advantages, returns = samples
    log_probs, entropy = log_probs_and_entropy(outputs, actions, is_discrete=is_discrete)
    log_ratio = log_probs - old_log_probs
    ratio = log_ratio.exp()
    clipped = ratio.clamp(1 - objective.clip_coef, 1 + objective.clip_coef)
    policy_loss = torch.maximum(-advantages * ratio, -advantages * clipped).sum()
    if objective.value_loss == "huber":
        value_loss = functional.smooth_l1_loss(values, returns, reduction="sum")
    else:
        value_loss = 0.5 * (values - returns).square().sum()
    loss = policy_loss - objective.ent_coef * entropy + objective.vf_coef * value_loss
    with torch.no_grad():
        kl = ((ratio - 1) - log_ratio).sum()
        outside = ((ratio - 1).abs() > objective.clip_coef).sum()
        return loss, torch.stack([policy_loss, value_loss, entropy, kl, outside.float()])
