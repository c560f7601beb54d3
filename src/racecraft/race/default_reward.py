"""AWS's default reward, which evaluation logs whatever the user trains with: stay near the centre line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.sim.columns import ROW_COLUMNS

_OFFSET, _WIDTH = ROW_COLUMNS.index("offset"), ROW_COLUMNS.index("track_width")


def centerline_rewards(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """1, 0.5 or 0.1 within 10, 25 or 50 % of the track's width from the centre line, else 0.001.

    Args:
        rows: Judged rows   (N, len(ROW_COLUMNS)).

    Returns:
        Rewards   (N,).
    """
    share = np.abs(rows[:, _OFFSET]) / rows[:, _WIDTH]
    return np.select([share <= 0.1, share <= 0.25, share <= 0.5], [1.0, 0.5, 0.1], 1e-3)
