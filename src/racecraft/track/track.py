"""`Track`: the road as three polylines, and every question about it as a function of the distance along it.

The waypoints *are* the polyline: length and projection are those of straight pieces between them, not of a
curve fitted through them, so that progress agrees with AWS DeepRacer's to the last digit. Only curvature
looks wider than one piece.

         outer  o---------o---------o
                |         |         |        a waypoint is a row: centre, inner and outer side by side
    centerline  +----s--->+---------+
                |         |         |        offset: metres left of the centre line, in driving direction
         inner  o---------o---------o
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.checks import shown
from racecraft.errors import ShapeError, TrackError
from racecraft.track.polyline import (
    Floats,
    arc_length,
    as_points,
    interpolate,
    nearest,
    project,
    signed_area,
    wrap_angle,
)

SAME_POINT = 1e-9  # metres; waypoints closer than this are one
CLOSED_GAP = 1e-6  # metres; a centre line whose ends are closer than this is closed
SLANTED = 0.95  # of a row's length: a road narrower than that is not square to the row
CURVATURE_WINDOW = 0.15  # metres to each side over which the heading difference is taken


@dataclass(frozen=True, eq=False, repr=False)
class Track:
    """A closed circuit or an open stretch of road. Arrays are float64, C-contiguous and read-only.

    Consecutive duplicate waypoints are merged on construction; `waypoints` still has them. Geometry is taken as
    given: `validate` judges it.

    Raises:
        ShapeError: The lines are not three arrays of the same shape (W, 2).
        TrackError: A coordinate is not finite, or fewer than two different waypoints are left.
    """

    name: str
    """What `load_track` knows it by."""
    centerline: Floats
    """Waypoints in driving direction, metres, (W, 2); a closed track repeats the first one at the end."""
    inner: Floats
    """Border on the inside of the circuit, metres, (W, 2), row by row beside the centre line."""
    outer: Floats
    """Border on the outside of the circuit, metres, (W, 2), row by row beside the centre line."""
    repeats: tuple[int, ...] = ()
    """Rows of the centre line that the route names once more; many of AWS's routes have one such row. No road lies
    between equal points, but they are counted: AWS's waypoint indices, in logs and rewards, are those of the file."""

    def __post_init__(self) -> None:
        lines = {name: self._line(name) for name in ("centerline", "inner", "outer")}
        shape = lines["centerline"].shape
        for name, line in lines.items():
            if line.shape != shape or line.ndim != 2 or line.shape[1] != 2:
                raise ShapeError(
                    f"{name} of track {self.name!r} has shape {line.shape}, expected (W, 2) for all three lines."
                )
            if not np.isfinite(line).all():
                row = int(np.flatnonzero(~np.isfinite(line).all(axis=1))[0])
                raise TrackError(f"{name}[{row}] of track {self.name!r} is {_xy(line[row])}; it must be finite.")
        steps = np.hypot(*np.diff(lines["centerline"], axis=0).T)
        keep = np.concatenate(([True], steps > SAME_POINT))[: shape[0]]
        if keep.sum() < 2:
            raise TrackError(f"Track {self.name!r} has {keep.sum()} different waypoints; it needs at least two.")
        repeats = (np.cumsum(keep) - 1)[~keep] if len(keep) else keep
        object.__setattr__(self, "repeats", tuple(sorted((*self.repeats, *map(int, repeats)))))
        is_closed = np.hypot(*(lines["centerline"][0] - lines["centerline"][-1])) <= CLOSED_GAP
        for name, line in lines.items():
            line = line[keep] + 0.0  # adding zero turns -0.0 into 0.0, so that equal geometry has equal bytes
            if is_closed and np.hypot(*(line[0] - line[-1])) <= CLOSED_GAP:
                line[-1] = line[0]
            line.flags.writeable = False
            object.__setattr__(self, name, line)

    def _line(self, name: str) -> Floats:
        line = getattr(self, name)
        try:
            return np.array(line, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ShapeError(f"{name} of track {self.name!r} is {shown(line)}; use an array (W, 2), metres.") from error

    def __repr__(self) -> str:
        shape = "closed" if self.is_closed else "open"
        size = f"{self.length:.2f} m x {self.mean_width:.2f} m"
        return f"Track({self.name!r}, {size}, {shape}, {self.direction}, {len(self.centerline)} waypoints)"

    # --- the whole track

    @cached_property
    def is_closed(self) -> bool:
        """True when the last waypoint is the first one."""
        return bool((self.centerline[0] == self.centerline[-1]).all())

    @cached_property
    def arc_length(self) -> Floats:
        """Distance along the centre line at each waypoint, metres, (W,), from 0 to `length`."""
        arc = arc_length(self.centerline)
        arc.flags.writeable = False
        return arc

    @cached_property
    def waypoints(self) -> Floats:
        """The centre line as the route's file has it, repeated points and all: what AWS's rewards see, (W', 2)."""
        waypoints = np.insert(self.centerline, self.repeats, self.centerline[list(self.repeats)], axis=0)
        waypoints.flags.writeable = False
        return waypoints

    @cached_property
    def waypoint_indices(self) -> NDArray[np.int32]:
        """Index in `waypoints` of where each piece of the centre line starts, (W - 1,); where it ends is one more."""
        pieces = np.arange(len(self.centerline) - 1)
        indices = (pieces + np.searchsorted(self.repeats, pieces, side="right")).astype(np.int32)
        indices.flags.writeable = False
        return indices

    @property
    def length(self) -> float:
        """Length of the centre line, metres."""
        return float(self.arc_length[-1])

    @cached_property
    def widths(self) -> Floats:
        """Distance from the inner to the outer border at each waypoint, metres, (W,).

        That of the row, unless the row is slanted, as those of some routes are: then as `width_at` measures it.
        """
        widths: Floats = np.hypot(*(self.inner - self.outer).T)
        across = self._width_across(self.centerline)
        widths = np.where(across < SLANTED * widths, across, widths)
        widths.flags.writeable = False
        return widths

    @cached_property
    def mean_width(self) -> float:
        """Mean of `widths`, metres."""
        return float(self.widths.mean())

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest box around the road: x_min, y_min, x_max, y_max, metres."""
        points = np.concatenate((self.centerline, self.inner, self.outer))
        (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return x_min, y_min, x_max, y_max

    @cached_property
    def inner_is_left(self) -> bool:
        """True when the inner border lies left of the driving direction."""
        tangent = np.gradient(self.centerline, axis=0)
        across = self.inner - self.outer
        return float((tangent[:, 0] * across[:, 1] - tangent[:, 1] * across[:, 0]).sum()) >= 0.0

    @property
    def left(self) -> Floats:
        """Border left of the driving direction, metres, (W, 2)."""
        return self.inner if self.inner_is_left else self.outer

    @property
    def right(self) -> Floats:
        """Border right of the driving direction, metres, (W, 2)."""
        return self.outer if self.inner_is_left else self.inner

    @cached_property
    def direction(self) -> str:
        """``counter-clockwise`` or ``clockwise``; an open track is the first if its inner border is left."""
        is_left = signed_area(self.centerline) > 0.0 if self.is_closed else self.inner_is_left
        return "counter-clockwise" if is_left else "clockwise"

    @cached_property
    def min_radius(self) -> float:
        """Radius of the tightest bend of the centre line, metres; infinite for a straight."""
        tightest = np.abs(self.curvature_at(np.arange(0.0, self.length, 0.05))).max()
        return float(1.0 / tightest) if tightest > 1e-9 else float("inf")

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the geometry, hexadecimal: equal digests mean bit-equal roads, whatever their names."""
        rows = np.concatenate((self.centerline, self.inner, self.outer), axis=1)
        return hashlib.sha256(rows.astype("<f8").tobytes()).hexdigest()

    def reversed(self) -> Track:
        """The same road driven the other way, from the same start if closed; borders keep their names."""
        lines = {name: getattr(self, name)[::-1] for name in ("centerline", "inner", "outer")}
        last = len(self.centerline) - 1
        return replace(self, **lines, repeats=tuple(last - row for row in reversed(self.repeats)))

    def _width_across(self, points: Floats) -> Floats:
        """From the nearest place of the inner border to that of the outer one, metres. Shape (..., 2) to (...,)."""
        inner, outer = (nearest(points.reshape(-1, 2), border) for border in (self.inner, self.outer))
        across = inner - outer
        return np.asarray(np.sqrt((across * across).sum(axis=1)).reshape(points.shape[:-1]))

    # --- along the track; `s` is in metres, of any shape, taken round a closed track, clamped on an open one

    def point_at(self, s: ArrayLike) -> Floats:
        """Points of the centre line, metres. Shape (...,) to (..., 2)."""
        return interpolate(self.centerline, self.arc_length, self._on_track(s))

    def heading_at(self, s: ArrayLike) -> Floats:
        """Heading of the piece of line at `s`, radians in [-pi, pi); at a waypoint, towards the next one."""
        piece = np.searchsorted(self.arc_length, self._on_track(s), side="right") - 1
        return wrap_angle(self._headings[np.minimum(piece, len(self._headings) - 1)])

    def width_at(self, s: ArrayLike) -> Floats:
        """Width of the road, metres: as AWS measures it, between the places of both borders that are nearest to `s`.

        Where a route's rows of waypoints are not square to the road, that is up to centimetres less than `widths`.
        """
        return self._width_across(self.point_at(s))

    def curvature_at(self, s: ArrayLike) -> Floats:
        """Curvature of the centre line, 1/metre, positive to the left.

        The difference of the heading over 0.15 m to each side (over the mean distance of waypoints if that
        is more), where the heading runs straight from the middle of one piece to the middle of the next. So
        it is continuous, and its mean over a stretch is that stretch's turn.
        """
        s = self._on_track(s)
        middle, heading = self._heading_knots
        window = min(max(CURVATURE_WINDOW, self.length / len(self._headings)), self.length / 4)
        before, after = np.maximum(s - window, middle[0]), np.minimum(s + window, middle[-1])
        turn = np.interp(after, middle, heading) - np.interp(before, middle, heading)
        return np.asarray(turn / np.maximum(after - before, SAME_POINT))

    def project(self, points: ArrayLike) -> tuple[Floats, Floats]:
        """The nearest place on the centre line.

        Args:
            points: Metres, (..., 2).

        Returns:
            Distance along the centre line (...,) from 0 to `length`, and offset from it (...,), left
            positive.
        """
        queries = as_points(points)
        s, offset = project(queries.reshape(-1, 2), self.centerline, self.arc_length)
        return s.reshape(queries.shape[:-1]), offset.reshape(queries.shape[:-1])

    def _on_track(self, s: ArrayLike) -> Floats:
        s = np.asarray(s, dtype=np.float64)
        return s % self.length if self.is_closed else np.clip(s, 0.0, self.length)

    @cached_property
    def _headings(self) -> Floats:
        """Heading of each piece, radians, unwrapped, (W - 1,)."""
        step = np.diff(self.centerline, axis=0)
        return np.unwrap(np.arctan2(step[:, 1], step[:, 0]))

    @cached_property
    def _heading_knots(self) -> tuple[Floats, Floats]:
        """Arc length and heading at the middle of each piece; if closed, also a lap before and after."""
        middle, heading = (self.arc_length[1:] + self.arc_length[:-1]) / 2, self._headings
        if not self.is_closed:
            return middle, heading
        turn = heading[-1] - heading[0] + wrap_angle(heading[0] - heading[-1])
        laps = np.array([-1.0, 0.0, 1.0])[:, None]
        return (middle + laps * self.length).ravel(), (heading + laps * turn).ravel()


def _xy(point: Floats) -> str:
    return f"({point[0]:g}, {point[1]:g})"
