"""Who is nearest along a road, in front or behind, of what a teacher is told about others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def nearest_along(
    ahead: NDArray[np.float64],
    *,
    length: NDArray[np.float64],
    is_closed: NDArray[np.bool_],
    is_there: NDArray[np.bool_],
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The nearest of others, going round a closed road the shorter way.

    All arrays have the same number of axes, and each that fits beside the others will do.

    Args:
        ahead: How far along the road the others are ahead of each car, m  (..., O).
        length: Of the road, m  (..., 1).
        is_closed: Whether it is a lap  (..., 1).
        is_there: Who of the others counts  (..., O).

    Returns:
        Which of the others, the first where nobody counts, and how far ahead it is, m, negative behind  (..., 1) both.
    """
    nearer = (ahead + 0.5 * length) % length - 0.5 * length
    ahead = np.where(is_closed, nearer, ahead)
    nearest = np.where(is_there, np.abs(ahead), np.inf).argmin(axis=-1, keepdims=True)
    return nearest, np.take_along_axis(ahead, nearest, axis=-1)
