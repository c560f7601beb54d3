"""Polylines in the plane: arc length, interpolation and projection, vectorised. No track words here."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.errors import ShapeError

Floats = NDArray[np.float64]

Pieces = NDArray[np.intp]

_MANY = 1 << 24  # pairs of a query point and a segment from which on a tree of the segments is quicker than all pairs
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

    def look(x: Floats, y: Floats, piece: Pieces) -> tuple[Floats, Floats, Floats]:
        """How far along each piece, squared distance, and the side, of places that broadcast with pieces."""
        delta_x, delta_y = x - start[piece, 0], y - start[piece, 1]
        along = np.clip((delta_x * step[piece, 0] + delta_y * step[piece, 1]) / squared[piece], 0.0, 1.0)
        across = step[piece, 0] * delta_y - step[piece, 1] * delta_x
        return along, (delta_x - along * step[piece, 0]) ** 2 + (delta_y - along * step[piece, 1]) ** 2, across

    x, y = queries.T
    nearest = np.zeros(len(queries), np.intp)
    if len(queries) * len(step) > _MANY:
        query, piece = _near_pieces(queries, points)
        order = np.lexsort((piece, look(x[query], y[query], piece)[1], query))
        nearest[query[order][::-1]] = piece[order][::-1]  # the first of each query is written last
    else:
        every = np.arange(len(step))
        rows = max(1, _CHUNK // len(step))
        for first in range(0, len(queries), rows):
            chunk = slice(first, first + rows)
            nearest[chunk] = look(x[chunk, None], y[chunk, None], every)[1].argmin(axis=1)
    along, distance_squared, across = look(x, y, nearest)
    return arc[nearest] + along * np.sqrt(squared[nearest]), np.copysign(np.sqrt(distance_squared), across)


def _near_pieces(queries: Floats, points: Floats) -> tuple[Pieces, Pieces]:
    """Pairs of a query and a piece of the polyline that can be its nearest, by a tree of the pieces."""
    import shapely

    tree = shapely.STRtree(np.asarray(shapely.linestrings(np.stack((points[:-1], points[1:]), axis=1))))
    sane = np.flatnonzero(np.isfinite(queries).all(axis=1))
    places = shapely.points(queries[sane])
    (query, _), distance = tree.query_nearest(places, return_distance=True, all_matches=False)
    reach = np.zeros(len(sane))
    reach[query] = distance * (1 + 1e-9) + 1e-9  # metres; GEOS rounds otherwise than we do
    query, piece = tree.query(places, predicate="dwithin", distance=reach)
    return sane[query], piece


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
