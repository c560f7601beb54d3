"""Pictures in a mirror, and what is told of them: a road that bends left bends right there."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import NUM_CONTINUOUS, NUM_TARGETS, NUMBERS, REGION_COLUMNS, REGION_ROWS, ROWS

SIDED: Final = ("offset", "heading", "curvature_near", "curvature", "curvature_far", "heading_ahead")
"""Numbers that are of the other sign there, as all columns are."""


def mirrored_observations(observations: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Observations (N, H, W, 4), squares of two by two pixels each, in a mirror."""
    return observations[:, :, ::-1][..., [1, 0, 3, 2]]


def mirrored_answers(answers: NDArray[np.float32]) -> NDArray[np.float32]:
    """What is to be told of the mirrored pictures: targets (N, NUM_TARGETS) or outputs (N, NUM_OUTPUTS)."""
    return answers[:, _ORDER[: answers.shape[1]]] * _SIGNS[: answers.shape[1]]


def _order() -> NDArray[np.intp]:
    order = np.arange(NUM_TARGETS + NUM_CONTINUOUS)
    first = NUM_CONTINUOUS + len(ROWS)
    regions = order[first : NUM_TARGETS - 1].reshape(len(REGION_ROWS), len(REGION_COLUMNS))
    order[first : NUM_TARGETS - 1] = regions[:, ::-1].ravel()
    return order


def _signs() -> NDArray[np.float32]:
    signs = np.ones(NUM_TARGETS + NUM_CONTINUOUS, np.float32)
    signs[[place for place, name in enumerate(NUMBERS) if name in SIDED]] = -1.0
    signs[len(NUMBERS) : NUM_CONTINUOUS] = -1.0
    return signs


_ORDER: Final = _order()
_SIGNS: Final = _signs()
