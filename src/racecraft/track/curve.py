r"""Draws a road from a few corners: straights, arcs and eased transitions, as with ruler and compass.

corner = (x, y, radius)        the road heads for (x, y) and takes the corner on an arc of that radius

       x-------.               1. straights between the corners, an arc of the given radius in each
      /  arc    \              2. a sliding mean of `ease` metres, twice (a cubic B-spline of the samples),
     /           x                so curvature rises and falls without a jump, as a driver steers
----x                          3. waypoints at equal distances, borders at half the width to each side
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from racecraft.errors import TrackError
from racecraft.track.polyline import Floats, arc_length, interpolate, resample
from racecraft.track.track import Track

Corner = tuple[float, float, float]

SPACING = 0.15  # metres between waypoints
_FINE = 0.02  # metres between the samples that are smoothed


def trace_corners(corners: Sequence[Corner], *, is_closed: bool = True, ease: float = 0.4) -> Floats:
    """The smooth line through a table of corners, finely sampled.

    Args:
        corners: (x, y, radius) in metres, in driving direction. A closed line starts in the middle of the
            straight from the last corner to the first; an open one runs from the first to the last, whose
            radii do not matter.
        is_closed: Whether the last corner leads back to the first.
        ease: Length of the sliding mean, metres.

    Returns:
        Points about 0.02 m apart, (S, 2); a closed line ends on its first point, bit for bit.

    Raises:
        TrackError: Two neighbouring corners leave no room for their arcs.
    """
    points = np.array([(x, y) for x, y, _ in corners], dtype=np.float64)
    radii = [radius for _, _, radius in corners]
    if is_closed:
        points, radii = np.concatenate((points[-1:], points, points[:1])), [0.0, *radii, 0.0]
    arcs, room = [], np.hypot(*np.diff(points, axis=0).T)
    for index in range(1, len(points) - 1):
        arc, tangent = _corner_arc(points[index - 1], points[index], points[index + 1], radii[index])
        room[index - 1 : index + 1] -= tangent
        arcs.append(arc)
    if is_closed:  # the first straight and the last are the same one
        room = np.append(room[1:-1], room[0] + room[-1] - np.hypot(*(points[1] - points[0])))
    if room.min() < -1e-9:
        raise TrackError(
            f"Corner {int(room.argmin()) + 1} overlaps the next by {-room.min():.2f} m; use smaller radii."
        )
    start = (arcs[-1][-1:] + arcs[0][:1]) / 2 if is_closed else points[:1]
    rough = np.concatenate([start, *arcs, start if is_closed else points[-1:]])
    rough = rough[np.concatenate(([True], np.hypot(*np.diff(rough, axis=0).T) > 1e-9))]
    fine = resample(rough, max(8, round(arc_length(rough)[-1] / _FINE)) + 1)
    return _slide(_slide(fine, is_closed, ease), is_closed, ease)


def road_along(line: Floats, width: float | Floats, *, name: str, is_clockwise: bool | None = None) -> Track:
    """The road of a given width along a finely sampled line, with waypoints about 0.15 m apart.

    Coordinates are rounded to a micrometre, so that a track has the same digest on every machine.

    Args:
        line: What `trace_corners` gives, metres, (S, 2).
        width: Metres, one for all or one for each sample (S,).
        name: The track's name.
        is_clockwise: Which way a closed line runs; an open one has its inner border on the left.
    """
    is_closed = bool((line[0] == line[-1]).all())
    arc = arc_length(line)
    s = np.linspace(0.0, arc[-1], max(4, round(arc[-1] / SPACING)) + 1)
    centre = interpolate(line, arc, s)
    # the tangent is that of the fine samples a step to each side
    before, after = (s - _FINE) % arc[-1], (s + _FINE) % arc[-1]
    if not is_closed:
        before, after = np.maximum(s - _FINE, 0.0), np.minimum(s + _FINE, arc[-1])
    tangent = interpolate(line, arc, after) - interpolate(line, arc, before)
    turns = ~tangent.any(axis=1)  # the line goes back on itself: the road ends there as it came
    tangent[turns] = centre[turns] - interpolate(line, arc, before[turns])
    tangent /= np.hypot(*tangent.T)[:, None]
    half = np.interp(s, arc, np.broadcast_to(width, len(line)))[:, None] / 2
    left = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) * half
    if is_closed:
        centre[-1], left[-1] = centre[0], left[0]
    inner_side = -1.0 if is_clockwise else 1.0
    inner, outer = centre + inner_side * left, centre - inner_side * left
    return Track(name=name, centerline=centre.round(6), inner=inner.round(6), outer=outer.round(6))


def _corner_arc(before: Floats, corner: Floats, after: Floats, radius: float) -> tuple[Floats, float]:
    """Samples of the arc that rounds a corner (A, 2), and how much of both straights it uses up."""
    into, out = corner - before, after - corner
    into, out = into / math.hypot(*into), out / math.hypot(*out)
    turn = math.atan2(into[0] * out[1] - into[1] * out[0], into[0] * out[0] + into[1] * out[1])
    tangent = radius * math.tan(abs(turn) / 2)
    side = math.copysign(1.0, turn)
    start = corner - into * tangent
    middle = start + side * radius * np.array([-into[1], into[0]])
    steps = max(2, math.ceil(radius * abs(turn) / _FINE))
    angle = math.atan2(start[1] - middle[1], start[0] - middle[0]) + np.linspace(0.0, turn, steps + 1)
    return middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), tangent


def _slide(line: Floats, is_closed: bool, ease: float) -> Floats:
    """Mean over `ease` metres round each sample; an open line goes on straight beyond its ends."""
    half = max(1, round(ease / 2 / _FINE))
    if is_closed:
        body = line[:-1]
        if 2 * half >= len(body):
            raise TrackError(f"An ease of {ease:g} m is longer than the line.")
        padded = np.concatenate((body[-half:], body, body[:half]))
    else:
        ahead = np.arange(1, half + 1)[:, None]
        padded = np.concatenate(
            (line[0] - ahead[::-1] * (line[1] - line[0]), line, line[-1] + ahead * (line[-1] - line[-2]))
        )
    total = np.cumsum(np.concatenate((np.zeros((1, 2)), padded)), axis=0)
    window = 2 * half + 1
    smooth: Floats = (total[window:] - total[:-window]) / window
    return np.concatenate((smooth, smooth[:1])) if is_closed else smooth
