"""What a caller gives to hold against each other: logs, a track, a car, each by a name, by a file, or made already."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from racecraft.checks import check_type, shown
from racecraft.errors import ConfigError
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import load_track
from racecraft.track.track import Track


def log_files(logs: str | Path | Iterable[str | Path]) -> list[Path]:
    """The files of one log or several.

    Raises:
        ConfigError: There is none, or something else among them.
    """
    several = [logs] if isinstance(logs, str | PathLike) else list(logs) if isinstance(logs, Iterable) else []
    files = [Path(file) for file in several if isinstance(file, str | PathLike)]
    if not files or len(files) < len(several):
        raise ConfigError(f"logs is {shown(logs)}; use a file's path, or a list of several.")
    return files


def track_of(track: str | Path | Track) -> Track:
    """A track by its name or file, or as it is.

    Raises:
        TrackNotFound: Nothing has this name.
        TrackError: The file is not a track that can be driven.
        ConfigError: It is none of these.
    """
    return track if isinstance(track, Track) else load_track(track)


def vehicle_of(vehicle: str | Path | Vehicle) -> Vehicle:
    """A car by its preset or file, or as it is.

    Raises:
        ConfigError: No such preset or file, a parameter outside its range, or none of these.
    """
    check_type("vehicle", vehicle, (str, PathLike, Vehicle), "use v4, v5, v6, a file's path or a Vehicle")
    return vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle)
