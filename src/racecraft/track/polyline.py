"""Polylines in the plane: arc length, interpolation and projection, vectorised. No track words here."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.errors import ShapeError

Floats = NDArray[np.float64]

_CHUNK = 1 << 19  # pairs of a query point and a segment held in memory at once


def as_points(points: ArrayLike, *, what: str = "points") -> Floats:
    """`points` as float64 with a last axis of two.

    Raises:
        ShapeError: The last axis is not (x, y).
    """
    array = np.asarray(points, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 2:
        raise ShapeError(f"{what} has shape {array.shape}, expected (..., 2): x and y in metres.")
    return array


def arc_length(points: Floats) -> Floats:
    """Distance along the polyline at each of its points, from 0. Shape (W, 2) to (W,)."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate(([0.0], np.cumsum(steps)))


def interpolate(points: Floats, arc: Floats, s: ArrayLike) -> Floats:
    """The points of the polyline at the distances `s`, clamped to its ends. Shape (...,) to (..., 2)."""
    s = np.asarray(s, dtype=np.float64)
    return np.stack([np.interp(s, arc, points[:, 0]), np.interp(s, arc, points[:, 1])], axis=-1)


def resample(points: Floats, num_points: int) -> Floats:
    """`num_points` points at equal distances along the polyline, both ends included."""
    arc = arc_length(points)
    return interpolate(points, arc, np.linspace(0.0, arc[-1], num_points))


def project(queries: Floats, points: Floats, arc: Floats) -> tuple[Floats, Floats]:
    """The nearest place on the polyline for each query.

    Args:
        queries: Places to project, metres, (Q, 2).
        points: The polyline, metres, (W, 2), no two consecutive points equal.
        arc: Its arc length, (W,).

    Returns:
        Distance along the polyline (Q,) and signed distance from it, left positive (Q,). Of several places
        that are equally near, the first counts.
    """
    start, step = points[:-1], np.diff(points, axis=0)
    squared = np.einsum("wi,wi->w", step, step)
    s, offset = np.empty(len(queries)), np.empty(len(queries))
    rows = max(1, _CHUNK // len(step))
    for first in range(0, len(queries), rows):
        chunk = slice(first, first + rows)
        delta_x = queries[chunk, 0, None] - start[:, 0]
        delta_y = queries[chunk, 1, None] - start[:, 1]
        along = np.clip((delta_x * step[:, 0] + delta_y * step[:, 1]) / squared, 0.0, 1.0)
        distance_squared = (delta_x - along * step[:, 0]) ** 2 + (delta_y - along * step[:, 1]) ** 2
        nearest = distance_squared.argmin(axis=1)
        row = np.arange(len(nearest))
        side = step[nearest, 0] * delta_y[row, nearest] - step[nearest, 1] * delta_x[row, nearest]
        s[chunk] = arc[nearest] + along[row, nearest] * np.sqrt(squared[nearest])
        offset[chunk] = np.copysign(np.sqrt(distance_squared[row, nearest]), side)
    return s, offset


def nearest(queries: Floats, points: Floats) -> Floats:
    """The nearest place on a polyline (W, 2), which may repeat points, for each query (Q, 2)."""
    points = points[np.concatenate(([True], (points[1:] != points[:-1]).any(axis=1)))]
    if len(points) < 2:
        return np.broadcast_to(points[0], queries.shape)
    arc = arc_length(points)
    return interpolate(points, arc, project(queries, points, arc)[0])


def signed_area(ring: Floats) -> float:
    """Area inside a ring, positive when it runs counter-clockwise."""
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))


def wrap_angle(angle: ArrayLike) -> Floats:
    """`angle` in [-pi, pi), radians."""
    return np.asarray((np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)
