"""What is believed of pictures, in units of the road."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import (
    CURVATURES,
    ERRORS,
    HALF,
    IN_SIGHT,
    LOG_LIMITS,
    MIDDLES,
    NUM_CONTINUOUS,
    NUMBERS,
    ON_ROAD,
    PLACES,
    POSE,
    REGION_COLUMNS,
    REGION_ROWS,
    REGIONS,
    ROWS,
)


@dataclass(frozen=True)
class Belief:
    """What is believed of N pictures; every ``*_error`` is the mean distance to the truth that is expected."""

    on_road: NDArray[np.float32]
    """Probability that there is road below the lens  (N,)."""
    offset: NDArray[np.float32]
    """m, of the lens from the road's middle, left positive  (N,)."""
    offset_error: NDArray[np.float32]
    """m  (N,)."""
    heading: NDArray[np.float32]
    """rad, of the lens against the road beside it, turned left positive  (N,)."""
    heading_error: NDArray[np.float32]
    """rad  (N,)."""
    heading_ahead: NDArray[np.float32]
    """rad, of the lens against where the road beside it leads over the next 40 cm, turned left positive  (N,)."""
    heading_ahead_error: NDArray[np.float32]
    """rad  (N,)."""
    half_width: NDArray[np.float32]
    """m, half the road's width  (N,)."""
    curvature: NDArray[np.float32]
    """1/m, of the road's middle 0.5, 1 and 2 m ahead, to the left positive  (N, 3)."""
    curvature_error: NDArray[np.float32]
    """1/m  (N, 3)."""
    closeness: NDArray[np.float32]
    """1 / (1 + m to the next object ahead), 0 where there is none  (N,)."""
    closeness_error: NDArray[np.float32]
    """The same  (N,)."""
    middle: NDArray[np.float32]
    """Column of a picture of 160 x 120 where the road's middle is in each of `ROWS`  (N, R)."""
    middle_error: NDArray[np.float32]
    """Columns  (N, R)."""
    is_middle: NDArray[np.float32]
    """Probability that it is in the picture in that row  (N, R)."""
    regions: NDArray[np.float32]
    """Probability that there is road at `REGION_ROWS` and `REGION_COLUMNS`  (N, 6, 8)."""

    def __len__(self) -> int:
        return len(self.on_road)


def believe(outputs: NDArray[np.float32]) -> Belief:
    """What the outputs of the network mean  (N, NUM_OUTPUTS)."""
    units = np.array([*NUMBERS.values(), *[HALF] * len(ROWS)], np.float32)
    told = outputs[:, :NUM_CONTINUOUS] * units
    errors = np.exp(outputs[:, ERRORS].clip(*LOG_LIMITS)) * units
    offset, heading, heading_ahead = POSE
    half_width, closeness = PLACES["half_width"], PLACES["closeness"]
    return Belief(
        on_road=_probability(outputs[:, ON_ROAD]),
        offset=told[:, offset],
        offset_error=errors[:, offset],
        heading=told[:, heading],
        heading_error=errors[:, heading],
        heading_ahead=told[:, heading_ahead],
        heading_ahead_error=errors[:, heading_ahead],
        half_width=told[:, half_width],
        curvature=told[:, CURVATURES],
        curvature_error=errors[:, CURVATURES],
        closeness=told[:, closeness].clip(0.0, 1.0),
        closeness_error=errors[:, closeness],
        middle=told[:, MIDDLES] + np.float32(HALF - 0.5),
        middle_error=errors[:, MIDDLES],
        is_middle=_probability(outputs[:, IN_SIGHT]),
        regions=_probability(outputs[:, REGIONS]).reshape(-1, len(REGION_ROWS), len(REGION_COLUMNS)),
    )


def _probability(logits: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(1.0 / (1.0 + np.exp(-logits.clip(-30.0, 30.0))))
