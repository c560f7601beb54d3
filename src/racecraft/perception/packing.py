"""How weights are kept in a file: a large matrix in 255 steps a row, all others in float16."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

STEP: Final = ".step"
"""Behind the name of a large matrix: what one of its whole numbers is worth, in each row."""
LARGE: Final = 100_000
"""Weights in a matrix that is kept so; coarser outputs would put the road one or two millimetres aside."""


def packed(weights: Mapping[str, NDArray[np.float32]]) -> dict[str, NDArray[np.generic]]:
    """What a file keeps of weights  (rows, columns) or (rows,)."""
    kept: dict[str, NDArray[np.generic]] = {}
    for name, array in weights.items():
        if array.size >= LARGE:
            step = (np.abs(array).max(axis=1, keepdims=True) / 127.0).astype(np.float32)
            kept[name] = np.rint(array / np.where(step > 0.0, step, 1.0)).astype(np.int8)
            kept[name + STEP] = step
        else:
            kept[name] = array.astype(np.float16)
    return kept


def unpacked(stored: Mapping[str, NDArray[np.generic]]) -> dict[str, NDArray[np.float32]]:
    """Weights by name, of what a file keeps.

    Raises:
        ValueError: Whole numbers have no step for each of their rows, a step is of nothing, or weights are not finite.
    """
    weights = {name: np.asarray(array, np.float32) for name, array in stored.items() if not name.endswith(STEP)}
    whole = {name for name in weights if stored[name].dtype == np.int8}
    if whole != {name.removesuffix(STEP) for name in stored if name.endswith(STEP)}:
        raise ValueError("its whole numbers and their steps do not go together")
    for name in whole:
        step = np.asarray(stored[name + STEP], np.float32)
        if step.shape != (*weights[name].shape[:1], 1):
            raise ValueError(f"{name} has not one step for each of its rows")
        with np.errstate(over="ignore", invalid="ignore"):  # told below
            weights[name] *= step
    if not all(np.isfinite(array).all() for array in weights.values()):
        raise ValueError("its weights are not all finite")
    return weights
