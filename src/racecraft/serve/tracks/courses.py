"""Tracks by the names that the browser may say: the library's, generated ones, and the user's own. Never a path."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np
from pydantic import ValidationError

from racecraft.errors import RacecraftError, TrackError, TrackNotFound
from racecraft.json_file import read_text
from racecraft.run.atomic import write_file
from racecraft.serve.problems import Conflict
from racecraft.serve.tracks.schemas import TrackFacts, TrackGeometry, TrackSketch
from racecraft.track import (
    Track,
    course,
    draw_road,
    find_corners,
    load_track,
    read_track,
    save_route,
    single_names,
    sketch_of,
    track_names,
    validate,
)
from racecraft.track.load import GENERATED
from racecraft.track.selection import JOINT

OUTLINE = 120  # points of a thumbnail
MAX_TRACKS: Final = 1000
MAX_AT_ONCE: Final = 200
"""Tracks that are chosen together; drawing one from its seed takes some milliseconds."""
TRASH: Final = "trash"  # inside the folder of tracks
NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
"""Of a user's own track."""
ENDINGS: Final = (".npy", ".csv")
"""Of files that can be imported."""


class Courses:
    """The tracks of a console.

    Args:
        folder: Of the user's own tracks, ``NAME.npy`` each, with ``NAME.json`` beside it if it was drawn.
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
        if name in track_names() or (name.startswith(GENERATED) and JOINT not in name):
            return name
        if name in self.own_names():
            return str(self._folder / f"{name}.npy")
        raise TrackNotFound(f"Track {name[:80]!r} does not exist.")

    def paths(self, names: Iterable[str]) -> list[str]:
        """What `load_track` takes for each of several tracks, without repetition.

        Args:
            names: Of ours, or selections of several: ``library``, ``all``, ``generated:0..9`` with the generator's
                options.

        Raises:
            TrackNotFound: There is no such track.
            TrackError: The seeds are too many, or an option is not allowed.
        """
        single = [one for name in names for one in (single_names(name) if _is_selection(name) else (name,))]
        found = list(dict.fromkeys(self.path_or_name(name) for name in single))
        if len(found) > MAX_AT_ONCE:
            raise TrackError(f"{len(found)} tracks are more than the {MAX_AT_ONCE} that go together.")
        for name in found:
            load_track(name)
        return found

    def load(self, name: str) -> Track:
        """A track by its name.

        Raises:
            TrackNotFound: There is no such track.
            TrackError: It cannot be driven.
        """
        return load_track(self.path_or_name(name))

    def is_still(self, name: str, digest: str) -> bool:
        """Whether a track has the form of this digest; only one's own is ever drawn anew, or gone."""
        try:
            return self.path_or_name(name) == name or self.load(name).digest == digest
        except (RacecraftError, OSError):
            return False

    def facts(self, name: str) -> TrackFacts:
        """A track as the gallery shows it."""
        path_or_name = self.path_or_name(name)
        is_own = path_or_name != name
        mark = Path(path_or_name).stat().st_mtime_ns if is_own else 0  # a track can be drawn anew
        return _facts(name, path_or_name, is_own, mark)

    def own_facts(self) -> list[TrackFacts]:
        """The user's own tracks; a damaged file is left out."""
        found = []
        for name in self.own_names():
            try:
                found.append(self.facts(name))
            except (RacecraftError, OSError):
                continue
        return found

    def sketch(self, name: str) -> TrackSketch:
        """A track's control points: as they were drawn, else some along its centre line."""
        track = self.load(name)
        path = self._folder / f"{name}.json"
        if name in self.own_names() and path.is_file():
            try:
                return TrackSketch.model_validate_json(read_text(path))
            except (RacecraftError, ValidationError):
                pass  # damaged: as if it had been imported
        return TrackSketch.of(sketch_of(track))

    def save(self, name: str, sketch: TrackSketch, *, replace: bool) -> TrackFacts:
        """Keep a drawing as a track.

        Raises:
            TrackError: It cannot be driven, or the name is none.
            Conflict: The name is taken.
        """
        track = draw_road(sketch.to_sketch(), name=name)
        validate(track)
        self._write(name, track, replace=replace)
        write_file(self._folder / f"{name}.json", sketch.model_dump_json().encode())
        return self.facts(name)

    def take_in(self, content: bytes, *, file_name: str, name: str | None) -> TrackFacts:
        """Import a track file.

        Args:
            content: Of the file.
            file_name: What it was called; its ending says what it is.
            name: Of the track; by default after the file.

        Raises:
            TrackError: It is no track file, cannot be driven, or the name is none.
            Conflict: The name is taken.
        """
        stem, ending = os.path.splitext(file_name.replace("\\", "/").rsplit("/", 1)[-1])
        if ending.lower() not in ENDINGS:
            raise TrackError(
                f"{file_name[-60:]!r} is no track file; "
                "allowed are .npy (AWS route) and .csv (centre line with widths)."
            )
        name = name or re.sub(r"[^A-Za-z0-9_-]+", "_", stem).strip("_-")[:64] or "track"
        with tempfile.TemporaryDirectory(dir=self._folder.parent) as folder:
            path = Path(folder) / f"{name}{ending.lower()}"
            self._check_name(name, replace=False)
            path.write_bytes(content)
            track = read_track(path)
        self._write(name, track, replace=False)
        return self.facts(name)

    def route(self, name: str) -> bytes:
        """A track as the bytes of an AWS route."""
        with tempfile.TemporaryDirectory() as folder:
            return save_route(self.load(name), Path(folder) / "route.npy").read_bytes()

    def remove(self, name: str) -> None:
        """Put one of the user's own tracks into the trash.

        Raises:
            TrackNotFound: There is none of this name.
        """
        self._own(name)
        trash = self._folder / TRASH
        trash.mkdir(exist_ok=True)
        self._move(name, self._folder, trash)

    def restore(self, name: str) -> TrackFacts:
        """Bring a removed track back.

        Raises:
            TrackNotFound: It is not in the trash.
            Conflict: There is another of that name by now.
        """
        trash = self._folder / TRASH
        if name not in {path.stem for path in trash.glob("*.npy")}:
            raise TrackNotFound(f"There is no track {name[:80]!r} in the trash.")
        self._check_name(name, replace=False)
        self._move(name, trash, self._folder)
        return self.facts(name)

    def _own(self, name: str) -> None:
        if name not in self.own_names():
            raise TrackNotFound(f"There is no track {name[:80]!r} of your own.")

    def _check_name(self, name: str, *, replace: bool) -> None:
        if not NAME.fullmatch(name):
            raise TrackError(
                f"A track cannot be called {name[:80]!r}.", hint="Use letters, digits, - and _, at most 64 of them."
            )
        names = {own.lower() for own in self.own_names()} - ({name.lower()} if replace else set())
        if name.lower() in names | {known.lower() for known in track_names()}:
            raise Conflict(f"There is a track {name!r} already.", hint="Choose another name.")
        if len(names) >= MAX_TRACKS:
            raise Conflict(f"There are {MAX_TRACKS} tracks already.", hint="Delete some first.")

    def _write(self, name: str, track: Track, *, replace: bool) -> None:
        self._check_name(name, replace=replace)
        with tempfile.TemporaryDirectory(dir=self._folder.parent) as folder:
            content = save_route(track, Path(folder) / "route.npy").read_bytes()
        (self._folder / f"{name}.json").unlink(missing_ok=True)
        write_file(self._folder / f"{name}.npy", content)

    @staticmethod
    def _move(name: str, source: Path, target: Path) -> None:
        (target / f"{name}.json").unlink(missing_ok=True)
        if (source / f"{name}.json").is_file():
            os.replace(source / f"{name}.json", target / f"{name}.json")
        os.replace(source / f"{name}.npy", target / f"{name}.npy")


def track_title(name: str) -> str:
    """What people call a track; its name where it is none of the library's."""
    return course(name).display_name if name in track_names() else name


def _is_selection(name: str) -> bool:
    return name in ("library", "all") or (name.startswith(GENERATED) and ".." in name and JOINT not in name)


@lru_cache(maxsize=512)
def _facts(name: str, path_or_name: str, is_own: bool, mark: int) -> TrackFacts:
    track = load_track(path_or_name)
    center = track.centerline[:: max(1, len(track.centerline) // OUTLINE)]
    return TrackFacts(
        name=name,
        title=track_title(name),
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
