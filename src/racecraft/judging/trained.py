"""What a run was trained with, where nothing else is asked for: its car, its camera, its objects and its track."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.run.folder import RunInfo
from racecraft.sim.camera import CAMERAS, CameraSpec
from racecraft.sim.objects import Objects
from racecraft.sim.vehicle import Vehicle
from racecraft.track import Track, joint_digest, load_tracks
from racecraft.track.selection import JOINT


def trained_vehicle(info: RunInfo) -> Vehicle:
    """The vehicle of run.json.

    Raises:
        RunError: It is of another version.
    """
    try:
        return Vehicle(**info.settings.get("vehicle", {}))
    except TypeError as error:
        raise RunError(f"The vehicle in run.json does not fit this version of Racecraft: {error}.") from error


def trained_camera(info: RunInfo) -> CameraSpec:
    """The camera of run.json; runs of earlier versions have the only one that there was.

    Raises:
        RunError: It is of another version.
    """
    name = info.settings.get("camera", "2018")
    if name not in CAMERAS:
        raise RunError(f"The camera {name!r} in run.json is none of this version of Racecraft: {', '.join(CAMERAS)}.")
    return CAMERAS[name]


def trained_objects(info: RunInfo) -> Objects:
    """The objects of run.json."""
    return Objects.from_dict(info.settings.get("objects") or {})


def trained_tracks(info: RunInfo) -> list[Track]:
    """The tracks of run.json, at least one.

    Raises:
        ConfigError: There is another by that name now.
    """
    tracks = load_tracks(info.track)
    if joint_digest(tracks) != info.track_digest:
        raise ConfigError(
            f"Track {trained_title(info)!r} has changed since the run was trained on it.",
            hint="Choose the track anew (--track), be it the same.",
        )
    return list(tracks)


def trained_track(info: RunInfo) -> Track:
    """The first of them.

    Raises:
        ConfigError: There is another by that name now.
    """
    return trained_tracks(info)[0]


def trained_title(info: RunInfo) -> str:
    """The tracks of run.json as a sentence calls them: no folder of somebody's disk."""
    return JOINT.join(Path(part).stem if os.sep in part else part for part in info.track.split(JOINT))


def is_road_of(summary: Mapping[str, Any], info: RunInfo, track: Track) -> bool:
    """Whether an evaluation on a track of this name was driven on this very road.

    Args:
        summary: The evaluation's ``evaluation.json``. An older one does not tell its road; then run.json's counts.
        info: Of the run that was evaluated.
        track: What goes by that name now.
    """
    told = summary.get("track_digest")
    if told is not None:
        return bool(told == track.digest)
    if info.track_digest == track.digest:
        return True
    try:
        is_trained_on = any(road.name == track.name for road in load_tracks(info.track))
        return not is_trained_on or any(road.digest == track.digest for road in trained_tracks(info))
    except RacecraftError:  # another by that name now, or gone
        return False
