"""`load_tracks`: several tracks at once, named as on a command line.

"oval"              one track, as `load_track` knows it
"library"           all of our own
"generated:0..99"   a hundred drawn from seeds, with options as in "generated:0..99,difficulty=0.8"
"all"               the library and generated:0..31
a folder            every .npy route in it, or every .csv where there is no route
"oval + hairpin"    these together
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from racecraft.checks import check_type
from racecraft.errors import TrackError
from racecraft.track.library import track_names
from racecraft.track.load import GENERATED, load_track
from racecraft.track.track import Track

MAX_TRACKS: Final = 1000
JOINT: Final = " + "
"""Between the names of several tracks in one text."""
_SEEDS: Final = re.compile(r"generated:(\d{1,18})\.\.(\d{1,18})((?:,.*)?)")


def load_tracks(names: str | Path | Iterable[str | Path]) -> tuple[Track, ...]:
    """All tracks of one or several names, in their order; see the top of this file for what a name may be.

    Raises:
        TrackNotFound: Nothing has this name.
        TrackError: A file is not a track that can be driven, a folder holds none, or they are too many.
        ConfigError: One is neither a text nor a path.
    """
    if isinstance(names, str | Path):
        names = [names]
    check_type("tracks", names, Iterable, "use a name or a file's path, or several in a list")
    names = list(names)
    for name in names:
        check_type("track", name, (str, Path), "use a name or a file's path")
    expanded = [part for name in names for part in _expand(name)]
    if not expanded:
        raise TrackError("No track is named.")
    if len(expanded) > MAX_TRACKS:
        raise TrackError(f"{len(expanded)} tracks are more than the {MAX_TRACKS} that go together.")
    return tuple(load_track(name) for name in expanded)


def join_names(names: str | Path | Sequence[str | Path]) -> str:
    """One text that `load_tracks` reads as these names."""
    return str(names) if isinstance(names, str | Path) else JOINT.join(map(str, names))


def single_names(names: str) -> list[str]:
    """What such a text names, one track each, as a page may call it: no paths."""
    expanded = _expand(names)
    return [Path(name).stem if os.sep in str(name) else str(name) for name in expanded]


def joint_digest(tracks: Sequence[Track]) -> str:
    """That of a single track, or one of all of them in their order."""
    if len(tracks) == 1:
        return tracks[0].digest
    return hashlib.sha256("".join(track.digest for track in tracks).encode()).hexdigest()


def _expand(name: str | Path) -> list[str | Path]:
    if isinstance(name, Path):
        return _files(name) if name.is_dir() else [name]
    if JOINT in name and not _is_there(name):
        return [found for part in name.split(JOINT) for found in _expand(part.strip())]
    if name == "library":
        return list(track_names())
    if name == "all":
        return [*track_names(), *(f"{GENERATED}{seed}" for seed in range(32))]
    seeds = _SEEDS.fullmatch(name)
    if seeds is not None:
        first, last = int(seeds[1]), int(seeds[2])
        if not first <= last < first + MAX_TRACKS:
            raise TrackError(f"Tracks {name!r}: the seeds must rise, {MAX_TRACKS} at most.")
        return [f"{GENERATED}{seed}{seeds[3]}" for seed in range(first, last + 1)]
    is_folder = name != "" and name not in track_names() and _is_there(name) and Path(name).is_dir()
    return _files(Path(name)) if is_folder else [name]


def _is_there(name: str) -> bool:
    try:
        return Path(name).exists()
    except (OSError, ValueError):  # too long to be one, or with a sign that none has
        return False


def _files(folder: Path) -> list[str | Path]:
    for suffix in (".npy", ".csv"):
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() == suffix)
        if files:
            return list(files)
    raise TrackError(f"Folder {str(folder)!r} holds no track: neither .npy nor .csv.")
