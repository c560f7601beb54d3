"""Compiles a rewritten reward function with numba, inside the worker process.

``worker_process.py`` loads this file by its path, without the rest of Racecraft. ``numeric.py`` wrote the source.
"""

from __future__ import annotations

import types
import warnings

import numba
import numpy as np
from numba.typed import List

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Waypoints = Sequence[Sequence[tuple[float, float]]]


def compile_kernel(source: str, waypoints: Waypoints, num_columns: int) -> Callable[..., None]:
    """A function of rows (N, columns) and rewards (N,) that fills the latter.

    Raises:
        Exception: Anything at all: numba cannot compile it.
    """
    namespace: dict[str, object] = {"__name__": "reward_kernel"}
    exec(compile(source, "reward_function.py", "exec", dont_inherit=True), namespace)
    for name, value in list(namespace.items()):
        if isinstance(value, types.FunctionType):
            namespace[name] = numba.njit(boundscheck=True, error_model="python")(value)
    kernel = namespace["kernel"]
    assert callable(kernel)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        lines = List([List(line) for line in waypoints])
        kernel(np.empty((0, num_columns)), np.empty(0), lines)  # compiles, and calls nothing
    return lambda rows, rewards: kernel(rows, rewards, lines)
