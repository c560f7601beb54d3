"""Random draws and their log-probabilities in the native core: the same bits on every machine.

NumPy's exp, log and normal numbers differ in the last bit between CPUs and versions, and one bit is enough to
turn another run out of the same seed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft import _native


def normals(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Standard normal numbers  (count,), by Box and Muller."""
    return _native.standard_normals(rng.random(count + count % 2))[:count]


def sample(outputs: NDArray[np.float32], noise: NDArray[np.float64], *, is_discrete: bool) -> NDArray[Any]:
    """Actions from policy outputs (N, P) and noise; see ``racecraft.learn.distributions.sample``."""
    outputs = np.ascontiguousarray(outputs)
    draw = _native.sample_categorical if is_discrete else _native.sample_gaussian
    actions: NDArray[Any] = draw(outputs, np.ascontiguousarray(noise))
    return actions


def log_prob(outputs: NDArray[np.float32], actions: NDArray[Any], *, is_discrete: bool) -> NDArray[np.float32]:
    """Log-probability, or log-density, of actions  (N,)."""
    outputs = np.ascontiguousarray(outputs)
    if is_discrete:
        return _native.categorical_log_probs(outputs, np.ascontiguousarray(actions, np.int64))
    return _native.gaussian_log_probs(outputs, np.ascontiguousarray(actions, np.float32))
