"""The road as the solver needs it: a smooth line along it, its curvature, and how far the borders are to both sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from racecraft.errors import TrackError
from racecraft.track.polyline import Floats, arc_length
from racecraft.track.track import Track

SMOOTHING: Final = 0.25
"""m, standard deviation of the bell that smooths the centre line: its corners at waypoints are no bends."""
REACH: Final = 3.0
"""m to either side within which a border is looked for."""
_FINE: Final = 0.02  # m between the samples that are smoothed


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothRoad:
    """Samples along a smoothed centre line; the last one is the first again, a lap later."""

    s: Floats
    """m along the line  (K + 1,)."""
    places: Floats
    """m  (K + 1, 2)."""
    heading: Floats
    """rad, unwrapped  (K + 1,)."""
    curvature: Floats
    """1/m, left positive  (K + 1,)."""
    left: Floats
    """m from the line to the left border, along its normal  (K + 1,)."""
    right: Floats
    """m to the right border, positive  (K + 1,)."""

    @property
    def length(self) -> float:
        """Of the line, m."""
        return float(self.s[-1])

    def at(self, s: ArrayLike, values: Floats) -> Floats:
        """Values of the samples between them; `s` is taken round the lap."""
        s = np.asarray(s, dtype=np.float64) % self.length
        if values.ndim == 1:
            return np.asarray(np.interp(s, self.s, values))
        return np.stack([np.interp(s, self.s, column) for column in values.T], axis=-1)

    def narrowed(self, margin: float) -> SmoothRoad:
        """The road without a strip of `margin` metres along both borders."""
        return replace(self, left=self.left - margin, right=self.right - margin)


def smooth_road(track: Track, *, spacing: float) -> SmoothRoad:
    """The smoothed road of a closed track, with samples about `spacing` metres apart.

    Raises:
        TrackError: The track is open.
    """
    if not track.is_closed:
        raise TrackError(f"Track {track.name!r} is open; a minimum lap time is that of a closed track.")
    num_fine = max(64, round(track.length / _FINE))
    s = np.arange(num_fine) * track.length / num_fine
    smooth = gaussian_filter1d(track.point_at(s), SMOOTHING / (track.length / num_fine), axis=0, mode="wrap")
    ring = np.concatenate((smooth, smooth[:1]))
    arc = arc_length(ring)
    spline = CubicSpline(arc, ring, bc_type="periodic")
    at = np.linspace(0.0, arc[-1], max(20, round(arc[-1] / spacing)) + 1)
    tangent, bend = spline(at, 1), spline(at, 2)
    heading = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    curvature = (tangent[:, 0] * bend[:, 1] - tangent[:, 1] * bend[:, 0]) / np.hypot(*tangent.T) ** 3
    places, normal = spline(at), np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    return SmoothRoad(
        s=at,
        places=places,
        heading=heading,
        curvature=curvature,
        left=_distance(places, normal, track.left),
        right=_distance(places, -normal, track.right),
    )


def _distance(places: Floats, direction: Floats, border: Floats) -> Floats:
    """How far it is from each place in its direction to a border, at most `REACH`, m  (K,)."""
    step = np.diff(border, axis=0)
    keep = np.hypot(*step.T) > 1e-9
    start, step = border[:-1][keep], step[keep]
    offset_x, offset_y = start[:, 0] - places[:, 0, None], start[:, 1] - places[:, 1, None]
    across = direction[:, 0, None] * step[:, 1] - direction[:, 1, None] * step[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (offset_x * step[:, 1] - offset_y * step[:, 0]) / across
        along = (offset_x * direction[:, 1, None] - offset_y * direction[:, 0, None]) / across
    is_hit = (np.abs(across) > 1e-12) & (along >= -1e-9) & (along <= 1 + 1e-9) & (distance > -0.2)
    return np.asarray(np.minimum(np.where(is_hit, distance, np.inf).min(axis=1), REACH))
