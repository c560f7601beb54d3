"""Round tracks to break, for the tests of this folder."""

from __future__ import annotations

import numpy as np

from racecraft.track import Track


def ring(num_points: int = 100, *, radius: float = 3.0, width: float = 1.0, turns: float = 1.0) -> np.ndarray:
    """A round track as rows of a route, counter-clockwise."""
    angle = np.linspace(0.0, 2 * np.pi * turns, num_points)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if turns == 1.0:
        unit[-1] = unit[0]
    return np.concatenate([unit * (radius + d) for d in (0.0, -width / 2, width / 2)], axis=1)


def track_of(rows: np.ndarray, name: str = "test") -> Track:
    return Track(name=name, centerline=rows[:, :2], inner=rows[:, 2:4], outer=rows[:, 4:])
