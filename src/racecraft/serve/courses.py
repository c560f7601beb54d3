"""Tracks by the names that the browser may say: the library's, generated ones, and the user's own. Never a path."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from racecraft.errors import TrackNotFound
from racecraft.serve.schemas import TrackFacts, TrackGeometry
from racecraft.track import Track, course, find_corners, load_track, track_names

OUTLINE = 120  # points of a thumbnail


class Courses:
    """The tracks of a console.

    Args:
        folder: Of the user's own tracks, ``NAME.npy`` each.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def own_names(self) -> list[str]:
        """Names of the user's own tracks."""
        return sorted(path.stem for path in self._folder.glob("*.npy"))

    def path_or_name(self, name: str) -> str:
        """What `load_track` takes for a name of ours.

        Raises:
            TrackNotFound: There is no such track.
        """
        if name in track_names() or name.startswith("generated:"):
            return name
        if name in self.own_names():
            return str(self._folder / f"{name}.npy")
        raise TrackNotFound(f"Track {name[:80]!r} does not exist.")

    def load(self, name: str) -> Track:
        """A track by its name.

        Raises:
            TrackNotFound: There is no such track.
            TrackError: It cannot be driven.
        """
        return load_track(self.path_or_name(name))

    def facts(self, name: str) -> TrackFacts:
        """A track as the gallery shows it."""
        return _facts(name, self.path_or_name(name), name in self.own_names())


@lru_cache(maxsize=512)
def _facts(name: str, path_or_name: str, is_own: bool) -> TrackFacts:
    track = load_track(path_or_name)
    center = track.centerline[:: max(1, len(track.centerline) // OUTLINE)]
    return TrackFacts(
        name=name,
        title=course(name).display_name if name in track_names() else name,
        length=round(track.length, 3),
        mean_width=round(track.mean_width, 3),
        min_radius=round(track.min_radius, 3) if np.isfinite(track.min_radius) else None,
        direction=track.direction,
        is_closed=track.is_closed,
        is_own=is_own,
        corners=len(find_corners(track)),
        outline=center.round(2).tolist(),
    )


def geometry(name: str, track: Track) -> TrackGeometry:
    """Everything to draw a track."""
    points = slice(0, -1 if track.is_closed else None)  # a closed line without its repeated end
    return TrackGeometry(
        name=name,
        length=track.length,
        is_closed=track.is_closed,
        center=track.centerline[points].round(4).tolist(),
        inner=track.inner[points].round(4).tolist(),
        outer=track.outer[points].round(4).tolist(),
    )
