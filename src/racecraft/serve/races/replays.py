"""What the browser is told to show a trial of several entries side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.analysis import driven_direction, sectors_of
from racecraft.race.recording import Recording
from racecraft.replay.replay import read_replay
from racecraft.serve.races.schemas import RaceReplay, ReplayCar
from racecraft.serve.tracks.courses import geometry
from racecraft.serve.tracks.schemas import TrackSector
from racecraft.track import Track


def trial_poses(path: Path, trial: int, *, grain: int = 1) -> tuple[list[list[int]], list[int]]:
    """Poses of one trial of a replay file in whole mm and mrad, and the steps after which its laps ended.

    Args:
        path: The file.
        trial: From 0.
        grain: mm and mrad that poses are rounded to.
    """
    return poses_of(read_replay(path).cars[trial].recording, grain=grain)


def poses_of(recording: Recording, *, grain: int = 1) -> tuple[list[list[int]], list[int]]:
    """Poses of one drive in whole mm and mrad, and the steps after which its laps ended."""
    ends = [step + 1 for step, event in recording.events if event == "lap_complete"]
    return ((1000 / grain * recording.poses).round().astype(int) * grain).tolist(), ends


def replay_of(name: str, track: Track, cars: list[ReplayCar], *, trial: int, is_coarse: bool = False) -> RaceReplay:
    """The same trial of some cars.

    Args:
        name: The track's.
        track: As the race drives it or the other way round.
        cars: At least one.
        trial: From 0.
        is_coarse: Whether the poses are rounded so that nobody reads a driver's choices off them.
    """
    driven = driven_direction(track, [np.array(car.trace, float).reshape(-1, 3)[:, :2] / 1000 for car in cars])
    return RaceReplay(
        trial=trial,
        geometry=geometry(name, track),
        is_reversed=driven is not track,
        sectors=[] if is_coarse else [TrackSector.of(sector) for sector in sectors_of(driven)],
        cars=cars,
    )
