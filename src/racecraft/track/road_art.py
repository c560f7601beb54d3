"""Paints a road on a canvas: shadow, kerbs, surface, lines, start line. `picture` frames and captions it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from racecraft.track.canvas import Canvas, Color
from racecraft.track.corners import TrackCorner
from racecraft.track.polyline import Floats, arc_length
from racecraft.track.track import Track

PAPER: Color = (245, 242, 235)
GRID: Color = (222, 217, 205)
INFIELD: Color = (231, 235, 221)
SHADOW: Color = (112, 104, 90)
ROAD: Color = (45, 49, 58)
EDGE: Color = (247, 246, 242)
CENTRE: Color = (232, 176, 62)
KERB: tuple[Color, Color] = ((206, 62, 52), (247, 246, 242))
INK: Color = (34, 38, 46)
SOFT_INK: Color = (120, 120, 116)

EDGE_LINE = (0.035, 0.07)  # metres from the border where the white line begins and ends
DASH, DASH_PERIOD, DASH_WIDTH = 0.18, 0.36, 0.028  # metres
KERB_WIDTH, KERB_STRIPE = 0.09, 0.16  # metres
MIN_KERB_TURN = math.radians(30.0)
_SMOOTH = 5  # pieces that each piece between two waypoints is drawn with


class Ribbon:
    """The road as three smooth curves over the distance along it, for looks: the polyline stays the truth.

    Sides are -1 for the left border and +1 for the right one.
    """

    def __init__(self, track: Track) -> None:
        smooth = _smooth(np.concatenate((track.left, track.centerline, track.right), axis=1), is_closed=track.is_closed)
        self.length = track.length
        self.is_closed = track.is_closed
        self.left, self.centre, self.right = smooth[:, :2], smooth[:, 2:4], smooth[:, 4:]
        waypoint = np.linspace(0.0, len(track.centerline) - 1.0, len(smooth))
        self._arc = np.interp(waypoint, np.arange(len(track.centerline)), track.arc_length)
        self._centre = self._along(self._arc, self.centre)
        self._borders = {side: self._border(track, side) for side in (-1.0, 1.0)}

    def place(self, s: ArrayLike) -> Floats:
        """Places on the centre line, metres. Shape (...,) to (..., 2)."""
        return self._at(s, self._centre)

    def leftwards(self, s: float) -> Floats:
        """Unit vector square to the centre line, to its left, (2,)."""
        ahead = self.place(s + 0.02) - self.place(s - 0.02)
        return np.asarray(np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead))

    def beside(self, s: ArrayLike, side: float, out: float) -> Floats:
        """Places `out` metres outside a border; negative is on the road. Shape (...,) to (..., 2)."""
        at = self._at(s, self._borders[side])
        return np.asarray(at[..., :2] + out * at[..., 2:])

    def strip(self, s: Floats, side: float, out: tuple[float, float]) -> Floats:
        """Outlines of strips between two distances outside a border, metres: (..., 2 P, 2) for `s` (..., P)."""
        near, far = (self.beside(s, side, distance) for distance in out)
        return np.concatenate((near, far[..., ::-1, :]), axis=-2)

    def edge_line(self, side: float, out: tuple[float, float]) -> Floats:
        """Quadrilaterals of a strip along a whole border, metres, (P - 1, 4, 2)."""
        border, normal = self._side(side)
        near, far = (border + distance * normal for distance in out)
        return np.stack((near[:-1], near[1:], far[1:], far[:-1]), axis=1)

    def outline(self) -> Floats:
        """The surface as one polygon, metres, (P, 2); of a closed road, the ring is cut open at the start."""
        return np.concatenate((self.left, self.right[::-1]))

    def _side(self, side: float) -> tuple[Floats, Floats]:
        """Places (P, 2) and outward normals (P, 2) of a border."""
        border = self.right if side > 0 else self.left
        return border, side * _right_of(border, is_closed=self.is_closed)

    def _border(self, track: Track, side: float) -> tuple[Floats, Floats]:
        """A border's places and outward normals over the distance along the road.

        Rows of foreign routes need not be square to the road, so each place's distance along it is that of
        its projection.
        """
        border, normal = self._side(side)
        shift = track.project(border)[0] - self._arc
        if self.is_closed:
            shift = (shift + self.length / 2) % self.length - self.length / 2
        # strictly rising, also where a tight border folds back
        arc = np.maximum.accumulate(self._arc + shift) + 1e-9 * np.arange(len(shift))
        return self._along(arc, np.concatenate((border, normal), axis=1))

    def _along(self, arc: Floats, values: Floats) -> tuple[Floats, Floats]:
        """Distances along the road, metres (Q,), and each of the values (P, K) there, (K, Q), for `_at`."""
        if self.is_closed:  # a lap before and after, so that nothing happens at the start line
            arc = np.maximum.accumulate((np.array([[-1.0], [0.0], [1.0]]) * self.length + arc[:-1]).ravel())
            values = np.concatenate((values[:-1],) * 3)
        return arc, np.ascontiguousarray(values.T)

    def _at(self, s: ArrayLike, along: tuple[Floats, Floats]) -> Floats:
        """The values (..., K) at distances along the road (...)."""
        s = np.asarray(s, dtype=np.float64)
        arc, values = along
        s = s % self.length if self.is_closed else s
        return np.stack([np.interp(s, arc, column) for column in values], axis=-1)


def paint_infield(canvas: Canvas, ribbon: Ribbon) -> None:
    """A tint inside a closed track."""
    if ribbon.is_closed:
        canvas.polygon(min(ribbon.left, ribbon.right, key=lambda border: float(np.ptp(border, axis=0).sum())), INFIELD)


def paint_road(canvas: Canvas, track: Track, ribbon: Ribbon, corners: list[TrackCorner], *, shadow_px: float) -> None:
    """The road with everything painted on it, over a soft shadow."""
    outline = ribbon.outline()
    canvas.shade([outline], SHADOW, blur_px=shadow_px, strength=0.55, shift_px=0.6 * shadow_px)
    for corner in corners:
        if abs(corner.turn) >= MIN_KERB_TURN:
            _paint_kerb(canvas, ribbon, corner)
    canvas.polygon(outline, ROAD)
    for side in (-1.0, 1.0):
        canvas.polygons(ribbon.edge_line(side, (-EDGE_LINE[0], -EDGE_LINE[1])), EDGE)
    arrows_end = _paint_start(canvas, track, ribbon)
    num_dashes = max(1, round(track.length / DASH_PERIOD))
    starts = np.arange(num_dashes) * track.length / num_dashes
    starts = starts[(starts > arrows_end) & (starts + DASH < track.length - 0.1)]
    for dash in ribbon.place(np.linspace(starts, starts + DASH, 4, axis=-1)):
        canvas.line(dash, CENTRE, width_px=DASH_WIDTH * canvas.scale, is_round=False)


def paint_arrow(canvas: Canvas, track: Track, ribbon: Ribbon, *, length_px: float) -> None:
    """An arrow beyond the start line that points the way, of a size in finished pixels."""
    length = length_px / canvas.scale
    tip, rim = 0.3 + 1.6 * length, 0.14 * length
    place, leftwards = ribbon.place(tip - 0.5 * length), ribbon.leftwards(tip - 0.5 * length)
    ahead = np.array([leftwards[1], -leftwards[0]])
    for grown, color in ((2.4 * rim, INK), (0.0, CENTRE)):
        half = 0.42 * length + grown
        nose, tail = place + (0.5 * length + 1.4 * grown) * ahead, place - (0.5 * length + 0.7 * grown) * ahead
        notch = place - (0.25 * length + 0.7 * grown) * ahead
        canvas.polygon(np.array([nose, tail + half * leftwards, notch, tail - half * leftwards]), color)


def _paint_kerb(canvas: Canvas, ribbon: Ribbon, corner: TrackCorner) -> None:
    """Red and white stripes along the inside of a corner."""
    start, end = corner.start - 0.1, corner.end + 0.1
    if not ribbon.is_closed:
        start, end = max(start, 0.0), min(end, ribbon.length)
    side = -1.0 if corner.turn > 0 else 1.0
    fine = np.linspace(start, end, max(8, round((end - start) / 0.03)))
    along = arc_length(ribbon.beside(fine, side, 0.0))  # stripes of one length on the border itself
    num_stripes = 2 * max(1, round(along[-1] / KERB_STRIPE / 2)) + 1
    marks = np.interp(np.linspace(0.0, along[-1], num_stripes + 1), along, fine)
    stripes = ribbon.strip(np.linspace(marks[:-1], marks[1:], 4, axis=-1), side, (-EDGE_LINE[0] / 2, KERB_WIDTH))
    for first, color in enumerate(KERB):
        canvas.polygons(stripes[first::2], color)


def _paint_start(canvas: Canvas, track: Track, ribbon: Ribbon) -> float:
    """A chequered line at the start, and chevrons that point the way. Returns where these end, metres."""
    heading = float(track.heading_at(0.0))
    ahead, leftwards = (
        np.array([math.cos(heading), math.sin(heading)]),
        np.array([-math.sin(heading), math.cos(heading)]),
    )
    origin = track.point_at(0.0)
    left = float((track.left[0] - origin) @ leftwards) - EDGE_LINE[1]
    right = float((track.right[0] - origin) @ leftwards) + EDGE_LINE[1]
    rows, num_squares = 3, max(6, 2 * round((left - right) / 0.16))
    size = (left - right) / num_squares
    first = -rows * size / 2 if track.is_closed else 0.0
    for row in range(rows):
        for column in range(num_squares):
            near, far = (right + size * (column + end) for end in (0, 1))
            begin, end = (first + size * (row + step) for step in (0, 1))
            outline = [
                origin + a * ahead + b * leftwards for a, b in ((begin, near), (end, near), (end, far), (begin, far))
            ]
            canvas.polygon(np.array(outline), EDGE if (row + column) % 2 else INK)
    depth, half, tip = 0.2, 0.19 * (left - right), 0.0
    for index in range(3):
        tip = first + rows * size + 0.3 + depth + 0.26 * index
        for side in (-1.0, 1.0):
            foot = ribbon.place(tip - depth) - side * half * ribbon.leftwards(tip - depth)
            canvas.line(np.array([foot, ribbon.place(tip)]), EDGE, width_px=0.055 * canvas.scale)
    return tip + 0.12


def _right_of(line: Floats, *, is_closed: bool) -> Floats:
    """Unit vectors square to a line, to its right, (P, 2)."""
    tangent = np.gradient(line, axis=0)
    if is_closed:
        tangent[0] = tangent[-1] = line[1] - line[-2]
    normal: Floats = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    normal /= np.maximum(np.hypot(*normal.T), 1e-12)[:, None]
    return normal


def _smooth(points: Floats, *, is_closed: bool) -> Floats:
    """A curve through the points (W, D), `_SMOOTH` samples a piece, slopes weighted for uneven spacing."""
    before = points[-2:-1] if is_closed else 2 * points[:1] - points[1:2]
    after = points[1:2] if is_closed else 2 * points[-1:] - points[-2:-1]
    padded = np.concatenate((before, points, after))
    step = np.maximum(np.diff(arc_length(padded[:, 2:4])), 1e-12)[:, None]
    rise = np.diff(padded, axis=0) / step
    slope = (rise[:-1] * step[1:] + rise[1:] * step[:-1]) / (step[:-1] + step[1:])
    t = np.linspace(0.0, 1.0, _SMOOTH, endpoint=False)[:, None, None]
    pieces = (
        (2 * t**3 - 3 * t**2 + 1) * points[:-1]
        + (t**3 - 2 * t**2 + t) * step[1:-1] * slope[:-1]
        + (3 * t**2 - 2 * t**3) * points[1:]
        + (t**3 - t**2) * step[1:-1] * slope[1:]
    )
    curve = pieces.transpose(1, 0, 2).reshape(-1, points.shape[1])
    return np.concatenate((curve, points[-1:]))
