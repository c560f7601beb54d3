"""`lap_place`: where on the lap a car is, in numbers that a critic can take in.

The privileged state looks three metres ahead. What a line through a long bend is worth shows later than that, and who
estimates it without knowing which bend it is sees chance where there is none.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

HARMONICS: Final = 3
"""As a lap is round, its place is an angle; sines and cosines of its first multiples tell bends apart."""
LAP_COLUMNS: Final = 2 * HARMONICS


def lap_place(distance: NDArray[np.float64], length: NDArray[np.float64]) -> NDArray[np.float32]:
    """Sine and cosine of one to three times the lap's angle: smooth, and the same on both sides of the line.

    Args:
        distance: m along the centre line from the start  (N,).
        length: m of the whole lap  (N,).

    Returns:
        Within [-1, 1], all sines before the cosines  (N, LAP_COLUMNS).
    """
    angles = 2.0 * np.pi * (distance / length)[:, None] * np.arange(1, HARMONICS + 1)
    return np.concatenate([np.sin(angles), np.cos(angles)], axis=1).astype(np.float32)
