"""Actions from policy outputs, from given noise: categorical, or Gaussian in [-1, 1].

Pure functions of their arguments, computed in the native core, so the seed of the noise decides a run: neither the
backend nor the machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.learn import native_distributions

LOG_STD_MIN = -20.0
"""Lower bound of a Gaussian's log standard deviation, as in AWS's trainer."""
LOG_STD_MAX = 3.0
"""Upper bound of the same."""


def noise_for(num_cars: int, *, num_actions: int, is_discrete: bool, rng: np.random.Generator) -> NDArray[np.float64]:
    """The random numbers one step of acting uses: uniforms (N,), or standard normals (N, A)."""
    if is_discrete:
        return rng.random(num_cars)
    return native_distributions.normals(rng, num_cars * num_actions).reshape(num_cars, num_actions)


def sample(outputs: NDArray[np.float32], noise: NDArray[np.float64], *, is_discrete: bool) -> NDArray[Any]:
    """Draw actions.

    Args:
        outputs: Policy outputs  (N, P).
        noise: From ``noise_for``.
        is_discrete: Which of the two distributions the outputs describe.

    Returns:
        Indices int64 (N,), or float32 (N, A), which the caller clips to [-1, 1] before driving.
    """
    return native_distributions.sample(outputs, noise, is_discrete=is_discrete)


def most_likely(outputs: NDArray[np.float32], *, is_discrete: bool, is_squashed: bool = False) -> NDArray[Any]:
    """What evaluation drives: the most probable action, or the mean clipped or squashed to [-1, 1]."""
    if is_discrete:
        return np.asarray(outputs.argmax(axis=1), dtype=np.int64)
    mean = outputs[:, : outputs.shape[1] // 2]
    return np.asarray(np.tanh(mean) if is_squashed else mean.clip(-1.0, 1.0), dtype=np.float32)


def log_prob(outputs: NDArray[np.float32], actions: NDArray[Any], *, is_discrete: bool) -> NDArray[np.float32]:
    """Log-probability, or log-density, of actions  (N,)."""
    return native_distributions.log_prob(outputs, actions, is_discrete=is_discrete)
