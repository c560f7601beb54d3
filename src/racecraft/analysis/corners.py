"""Where a lap loses time: the track cut in the middle of its straights, and what each piece with its corner took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from racecraft.analysis.laps import TracedLap, start_place
from racecraft.track import Track, find_corners


@dataclass(frozen=True, kw_only=True)
class Sector:
    """A stretch of the track around a corner, in driving direction; m along the centre line from the start line."""

    number: int
    """From 1, in the order in which a lap drives them."""
    start: float
    end: float
    """May lie beyond the length where the stretch spans the start line."""
    apex: float
    turn: float
    """Change of heading in the corner, rad, left positive; 0 on a track without corners."""


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A lap through a sector."""

    seconds: float
    entry_speed: float
    """m/s"""
    slowest: float
    """m/s"""
    exit_speed: float
    """m/s"""


def sectors_of(track: Track) -> list[Sector]:
    """Every corner of a track with half of the straights around it; together they are the whole lap."""
    corners = find_corners(track)
    if not corners:
        return [Sector(number=1, start=0.0, end=track.length, apex=0.5 * track.length, turn=0.0)]
    cuts = [0.5 * (before.end + after.start) for before, after in pairwise(corners)]
    if track.is_closed:
        over = 0.5 * (corners[-1].end + corners[0].start + track.length)
        first, last = over - track.length, over
    else:
        first, last = 0.0, track.length
    edges = [first, *cuts, last]
    return [
        Sector(number=index + 1, start=edges[index], end=edges[index + 1], apex=corner.apex, turn=corner.turn)
        for index, corner in enumerate(corners)
    ]


def passages(track: Track, lap: TracedLap, sectors: Sequence[Sector]) -> list[Passage | None]:
    """What a lap took for every sector; None where it did not get through.

    A lap that starts within a sector drives it in two parts, at its beginning and at its end; they are added.
    """
    begin = start_place(track, lap)
    reached = float(lap.share[-1])
    found: list[Passage | None] = []
    for sector in sectors:
        parts = _parts(begin, sector, track)
        if any(high > reached + 1e-3 for _, high in parts):
            found.append(None)
            continue
        seconds = sum(float(np.diff(lap.time_at(np.array(part)))[0]) for part in parts)
        # the standing start and a finish in one sector are no one passage: its speeds are those of the longer part
        low, high = max(parts, key=lambda part: part[1] - part[0])
        inside = np.linspace(low, high, 40)
        speeds = np.interp(inside, lap.share, lap.speed)
        found.append(
            Passage(
                seconds=seconds,
                entry_speed=float(speeds[0]),
                slowest=float(speeds.min()),
                exit_speed=float(speeds[-1]),
            )
        )
    return found


def _parts(begin: float, sector: Sector, track: Track) -> list[tuple[float, float]]:
    """A sector as shares of a lap that begins at a place, in one part or two."""
    length = track.length
    if not track.is_closed:
        return [(max(0.0, (sector.start - begin) / length), min(1.0, (sector.end - begin) / length))]
    low = ((sector.start - begin) % length) / length
    high = low + (sector.end - sector.start) / length
    return [(low, high)] if high <= 1.0 else [(low, 1.0), (0.0, high - 1.0)]
