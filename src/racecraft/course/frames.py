"""Pictures that a car's camera takes at chosen places, for lessons about pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.sim import CameraSpec, Simulation
from racecraft.track import Track, load_track

Images = NDArray[np.uint8]
BLOCK = 10
"""Pixels, side of what becomes one pixel of a small picture."""


def taken(track: str | Track, places: ArrayLike, offsets: ArrayLike, turns: ArrayLike) -> Images:
    """What the camera sees from places on a track.

    Args:
        track: Name of a track, or one.
        places: Shares of the lap (N,).
        offsets: m to the left of the centre line (N,).
        turns: rad to the left of the road's direction (N,).

    Returns:
        Grey images (N, 120, 160).
    """
    road = track if isinstance(track, Track) else load_track(track)
    along = np.asarray(places, np.float64) % 1.0 * road.length
    car = Simulation(road, num_envs=1, camera=CameraSpec(), num_threads=1)
    images: list[Any] = []
    rows: Sequence[tuple[float, float, float]] = np.stack(
        [along, np.asarray(offsets, np.float64), np.asarray(turns, np.float64)], axis=1
    ).tolist()
    for place, offset, turn in rows:
        heading = float(road.heading_at(place))
        x, y = road.point_at(place).tolist()
        car.set_pose(0, x - offset * np.sin(heading), y + offset * np.cos(heading), heading + turn)
        images.append(car.frames[0].copy())
    return np.stack(images)


def small(images: Images) -> NDArray[np.float64]:
    """Pictures in a tenth of their size, 0 to 1: the mean of every block of pixels (N, 12, 16)."""
    n, height, width = images.shape
    blocks = images.reshape(n, height // BLOCK, BLOCK, width // BLOCK, BLOCK)
    return np.asarray(blocks.mean(axis=(2, 4)) / 255.0)
