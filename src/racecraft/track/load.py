"""`load_track`: a track by its name, its file or its seed."""

from __future__ import annotations

import os
from pathlib import Path

from racecraft.checks import check_type
from racecraft.errors import TrackNotFound, did_you_mean
from racecraft.moved import place_of
from racecraft.track.generator import parse_generated
from racecraft.track.library import library_track, track_names
from racecraft.track.readers import read_track
from racecraft.track.track import Track

GENERATED = "generated:"


def load_track(name_or_path: str | Path) -> Track:
    """A track of the library, of a file, or drawn from a seed.

    Args:
        name_or_path: A name of `track_names()`, such as ``"oval"``; a path to an .npy route or a centre-line
            .csv; or ``"generated:7"`` for `generate_track(7)`, with options as in
            ``"generated:7,length=40,difficulty=0.9"``.

    Raises:
        TrackNotFound: Nothing has this name.
        TrackError: The file is not a track that can be driven, or an option is out of range.
        ConfigError: It is neither a text nor a path.

    Example:
        >>> round(load_track("oval").length, 2)
        16.79
    """
    check_type("track", name_or_path, (str, Path), "use a name or a file's path")
    if not isinstance(name_or_path, str):
        return read_track(place_of(name_or_path))
    name = name_or_path
    if name in track_names():
        return library_track(name)
    if name.startswith(GENERATED):
        return parse_generated(name)
    path = Path(name)
    if path.suffix.lower() in {".npy", ".csv"} or len(path.parts) > 1:
        return read_track(place_of(path))
    if os.path.isdir(name):  # False of names too long for one, too
        raise TrackNotFound(f"{name[:80]!r} is a folder; here one track is wanted.", hint="Name a file in it.")
    hint = f"{did_you_mean(name, track_names())} List all with 'racecraft tracks'.".strip()
    raise TrackNotFound(f"Track {name[:80]!r} does not exist.", hint=hint)
