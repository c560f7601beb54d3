"""A road drawn by hand: a few control points, each with the road's width there, and a smooth line through them all.

The line is a cubic spline through the points with parameters that grow by the square root of the distance
(centripetal), so that it neither overshoots nor loops between points that are unevenly spaced; its curvature is
continuous. Parametrisation: Lee, "Choosing nodes in parametric curve interpolation", 1989.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from racecraft.errors import TrackError
from racecraft.track.curve import road_along
from racecraft.track.generator import MAX_LENGTH
from racecraft.track.polyline import Floats, arc_length, interpolate, signed_area
from racecraft.track.track import Track
from racecraft.track.validate import MIN_WIDTH

MIN_POINTS, MAX_POINTS = 3, 200
NEAREST = 0.05  # metres between neighbouring points, at least
FARTHEST = 500.0  # metres from the origin
WIDEST = 10.0  # metres
_FINE = 0.02  # metres between the samples of the line
_POINTS_OF_A_TRACK = 80  # at most, of a sketch made from a track


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """Control points of a road in driving direction.

    Raises:
        TrackError: Too few or too many points, two on one place, one that is no place, or a width out of range.
    """

    points: tuple[tuple[float, float], ...]
    """x, y in metres."""
    widths: tuple[float, ...]
    """Of the road at each point, metres."""
    is_closed: bool = True

    def __post_init__(self) -> None:
        count = len(self.points)
        if not MIN_POINTS <= count <= MAX_POINTS:
            raise TrackError(f"A drawing has {MIN_POINTS} to {MAX_POINTS} points; this one has {count}.")
        if len(self.widths) != count:
            raise TrackError(f"The drawing has {count} points and {len(self.widths)} widths; each point has one.")
        for number, (point, width) in enumerate(zip(self.points, self.widths, strict=True), start=1):
            if not all(math.isfinite(value) and abs(value) <= FARTHEST for value in point):
                raise TrackError(f"Point {number} is {point}; points lie within {FARTHEST:g} m of the origin.")
            if not MIN_WIDTH <= width <= WIDEST:
                raise TrackError(
                    f"The road is {width:g} m wide at point {number}; allowed is {MIN_WIDTH:g} to {WIDEST:g} m."
                )
        steps = np.hypot(*np.diff(self._ring(), axis=0).T)
        if steps.min() < NEAREST:
            number = int(steps.argmin()) + 1
            x, y = self.points[number - 1]
            raise TrackError(
                f"Points {number} and {number % count + 1} lie on one place, near ({x:.2f}, {y:.2f}).",
                hint=f"Keep {NEAREST:g} m between them, or take one away.",
            )
        if steps.sum() > MAX_LENGTH:
            raise TrackError(f"The drawing is {steps.sum():.0f} m long; allowed is at most {MAX_LENGTH:g} m.")

    def _ring(self) -> Floats:
        """The points, with the first once more at the end if closed."""
        points = np.array(self.points, dtype=np.float64)
        return np.concatenate((points, points[:1])) if self.is_closed else points


def draw_road(sketch: Sketch, *, name: str) -> Track:
    """The road of a sketch, not yet validated: it may cross itself.

    Args:
        sketch: Its points.
        name: Of the track.
    """
    points = sketch._ring()
    widths = np.array(sketch.widths + sketch.widths[:1] if sketch.is_closed else sketch.widths)
    nodes = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T) ** 0.5)))
    steps = np.diff(nodes)
    bends = _bends(points, steps, is_closed=sketch.is_closed)
    count = max(16, math.ceil(float(arc_length(points)[-1]) / _FINE))
    at = np.linspace(0.0, nodes[-1], 2 * count + 1)
    piece = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(steps) - 1)
    step, after = steps[piece, None], (at - nodes[piece])[:, None]
    before = step - after
    line = (bends[piece] * before**3 + bends[piece + 1] * after**3) / (6 * step)
    line += (points[piece] / step - bends[piece] * step / 6) * before
    line += (points[piece + 1] / step - bends[piece + 1] * step / 6) * after
    if sketch.is_closed:
        line[-1] = line[0]
    arc = arc_length(line)
    even = np.linspace(0.0, arc[-1], max(16, round(arc[-1] / _FINE)) + 1)
    fine = interpolate(line, arc, even)
    if sketch.is_closed:
        fine[-1] = fine[0]
    wide = np.interp(np.interp(even, arc, at), nodes, widths)
    is_clockwise = bool(signed_area(fine) < 0.0) if sketch.is_closed else None
    return road_along(fine, wide, name=name, is_clockwise=is_clockwise)


def sketch_of(track: Track) -> Sketch:
    """A sketch that draws nearly the same road: points along its centre line, about a metre apart."""
    count = max(8, min(_POINTS_OF_A_TRACK, round(track.length)))
    s = np.linspace(0.0, track.length, count, endpoint=not track.is_closed)
    points, widths = track.point_at(s).round(3).tolist(), track.width_at(s).round(3).tolist()
    return Sketch(points=tuple((x, y) for x, y in points), widths=tuple(widths), is_closed=track.is_closed)


def _bends(points: Floats, steps: Floats, *, is_closed: bool) -> Floats:
    """Second derivatives at the points (P, 2) that make the first ones continuous; 0 at open ends."""
    slopes = np.diff(points, axis=0) / steps[:, None]
    if not is_closed:
        inner = len(points) - 2
        matrix = np.diag(2 * (steps[:-1] + steps[1:]))
        matrix += np.diag(steps[1:-1], 1) + np.diag(steps[1:-1], -1)
        found = np.zeros_like(points)
        found[1:-1] = np.linalg.solve(matrix, 6 * np.diff(slopes, axis=0)) if inner else 0.0
        return found
    count = len(steps)
    before = np.roll(steps, 1)
    matrix = np.diag(2 * (before + steps))
    row = np.arange(count)
    matrix[row, row - 1] += before
    matrix[row, (row + 1) % count] += steps
    bends = np.linalg.solve(matrix, 6 * (slopes - np.roll(slopes, 1, axis=0)))
    return np.concatenate((bends, bends[:1]))
