"""Finds the corners of a track from its curvature: what a co-driver would call out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from racecraft.track.track import Track

STRAIGHT_RADIUS = 7.0  # metres; wider bends count as straight
MIN_TURN = math.radians(17.0)  # smaller turns are kinks, not corners
_STEP = 0.05  # metres between samples


@dataclass(frozen=True)
class TrackCorner:
    """One corner, in driving direction."""

    start: float
    """Where the road begins to bend, metres from the start line."""
    apex: float
    """Where half of the turn is done, metres."""
    end: float
    """Where the road is straight again, metres; beyond the length if the corner spans the start line."""
    turn: float
    """Change of heading, radians, positive to the left."""
    radius: float
    """Tightest radius of the centre line, metres."""


def find_corners(track: Track) -> list[TrackCorner]:
    """The corners in driving order: stretches that bend one way by 17 degrees or more, tighter than 7 m."""
    num_samples = max(8, round(track.length / _STEP))
    step = track.length / num_samples
    curvature = track.curvature_at((np.arange(num_samples) + 0.5) * step)
    side = np.where(np.abs(curvature) > 1.0 / STRAIGHT_RADIUS, np.sign(curvature), 0.0)
    first = 0
    if track.is_closed and (changes := np.flatnonzero(side != np.roll(side, 1))).size:
        first = int(changes[0])  # begin between two stretches, so that none is cut by the start line
    side, curvature = np.roll(side, -first), np.roll(curvature, -first)
    edges = np.flatnonzero(np.diff(side)) + 1
    corners = []
    for begin, end in zip([0, *edges], [*edges, num_samples], strict=True):
        turn = float(curvature[begin:end].sum() * step)
        if side[begin] == 0.0 or abs(turn) < MIN_TURN:
            continue
        done = np.cumsum(np.abs(curvature[begin:end]))
        apex = begin + int(np.searchsorted(done, done[-1] / 2))
        start, middle = (first + begin) * step, (first + apex + 0.5) * step
        lap = track.length if start >= track.length else 0.0
        tightest = float(1.0 / np.abs(curvature[begin:end]).max())
        corner_end = start - lap + (end - begin) * step
        corners.append(TrackCorner(start - lap, (middle - lap) % track.length, corner_end, turn, tightest))
    return sorted(corners, key=lambda corner: corner.start)
