"""Actions from policy outputs, from given noise, in NumPy: categorical, or Gaussian in [-1, 1].

Pure functions of their arguments, so the seed of the noise decides a run, not the backend.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LOG_STD_MIN = -20.0
"""Lower bound of a Gaussian's log standard deviation, as in AWS's trainer."""
LOG_STD_MAX = 3.0
"""Upper bound of the same."""
_HALF_LOG_TWO_PI = 0.9189385332046727


def log_softmax(logits: NDArray[np.float32]) -> NDArray[np.float64]:
    """Log-probabilities of a categorical policy  (N, P) -> (N, P)."""
    shifted = logits.astype(np.float64) - logits.max(axis=1, keepdims=True)
    return np.asarray(shifted - np.log(np.exp(shifted).sum(axis=1, keepdims=True)))


def noise_for(num_cars: int, *, num_actions: int, is_discrete: bool, rng: np.random.Generator) -> NDArray[np.float64]:
    """The random numbers one step of acting uses: uniforms (N,), or standard normals (N, A)."""
    return rng.random(num_cars) if is_discrete else rng.standard_normal((num_cars, num_actions))


def sample(outputs: NDArray[np.float32], noise: NDArray[np.float64], *, is_discrete: bool) -> NDArray[Any]:
    """Draw actions.

    Args:
        outputs: Policy outputs  (N, P).
        noise: From ``noise_for``.
        is_discrete: Which of the two distributions the outputs describe.

    Returns:
        Indices int64 (N,), or float32 (N, A), which the caller clips to [-1, 1] before driving.
    """
    if is_discrete:
        # invert the cumulative distribution; the last column is open-ended, so rounding cannot run past it
        cumulative = np.exp(log_softmax(outputs)).cumsum(axis=1)[:, :-1]
        return np.asarray((noise[:, None] >= cumulative).sum(axis=1), dtype=np.int64)
    mean, log_std = np.split(outputs.astype(np.float64), 2, axis=1)
    return np.asarray(mean + np.exp(log_std.clip(LOG_STD_MIN, LOG_STD_MAX)) * noise, dtype=np.float32)


def most_likely(outputs: NDArray[np.float32], *, is_discrete: bool) -> NDArray[Any]:
    """What evaluation drives: the most probable action, or the mean clipped to [-1, 1]."""
    if is_discrete:
        return np.asarray(outputs.argmax(axis=1), dtype=np.int64)
    return np.asarray(outputs[:, : outputs.shape[1] // 2].clip(-1.0, 1.0), dtype=np.float32)


def log_prob(outputs: NDArray[np.float32], actions: NDArray[Any], *, is_discrete: bool) -> NDArray[np.float32]:
    """Log-probability, or log-density, of actions  (N,)."""
    if is_discrete:
        return np.take_along_axis(log_softmax(outputs), actions[:, None], axis=1)[:, 0].astype(np.float32)
    mean, log_std = np.split(outputs.astype(np.float64), 2, axis=1)
    log_std = log_std.clip(LOG_STD_MIN, LOG_STD_MAX)
    z = (actions - mean) * np.exp(-log_std)
    return np.asarray((-0.5 * z * z - log_std - _HALF_LOG_TWO_PI).sum(axis=1), dtype=np.float32)
