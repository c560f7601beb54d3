"""Pictures in a mirror, and what is told of them: a road that bends left bends right there."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import MIDDLES, NUM_OUTPUTS, PLACES, REGION_COLUMNS, REGION_ROWS, REGIONS

SIDED: Final = ("offset", "heading", "curvature_near", "curvature", "curvature_far", "heading_ahead")
"""Numbers that are of the other sign there, as all columns are."""


def mirrored_observations(observations: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Observations (N, H, W, 4), squares of two by two pixels each, in a mirror."""
    return observations[:, :, ::-1][..., [1, 0, 3, 2]]


def mirrored_answers(answers: NDArray[np.float32]) -> NDArray[np.float32]:
    """What is to be told of the mirrored pictures: targets (N, NUM_TARGETS) or outputs (N, NUM_OUTPUTS)."""
    return answers[:, _ORDER[: answers.shape[1]]] * _SIGNS[: answers.shape[1]]


def mirrored_commands(commands: NDArray[np.float32]) -> NDArray[np.float32]:
    """What a car there is told, steering angle and speed  (N, 2)."""
    return commands * np.array([-1.0, 1.0], np.float32)


def _order() -> NDArray[np.intp]:
    order = np.arange(NUM_OUTPUTS)
    order[REGIONS] = order[REGIONS].reshape(len(REGION_ROWS), len(REGION_COLUMNS))[:, ::-1].ravel()
    return order


def _signs() -> NDArray[np.float32]:
    signs = np.ones(NUM_OUTPUTS, np.float32)
    signs[[PLACES[name] for name in SIDED]] = -1.0
    signs[MIDDLES] = -1.0
    return signs


_ORDER: Final = _order()
_SIGNS: Final = _signs()
