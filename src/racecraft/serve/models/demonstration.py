"""What a model's page shows when nobody trains: the lap that its best checkpoint drives, and the laps of its training.

run folder -> best checkpoint -> a lap on one of its roads, among what it met there -> poses
           -> laps of its training from one start -> poses
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from racecraft.judging.demonstration import demonstrate
from racecraft.judging.evolution import evolution_of
from racecraft.judging.trained import trained_tracks
from racecraft.run import RunFolder, read_stretches, stretch_at
from racecraft.serve.evaluations.objects import objects_in
from racecraft.serve.models.schemas import Demonstration, Evolution, EvolutionLap
from racecraft.serve.tracks.courses import geometry

KEPT: Final = 64
"""Demonstrations of different checkpoints; a lap is some 10 kB."""


def demonstration(folder: RunFolder, *, road: int = 0) -> Demonstration | None:
    """The lap of a model's best checkpoint; None without one, or where it learned on fewer roads.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    best = folder.checkpoints.best
    if best is None or road >= len(trained_tracks(folder.read_info())):
        return None
    return _drive(folder.path, best.step, _changed(folder), road)


def evolution(folder: RunFolder) -> Evolution:
    """The laps of a model's training, the best one last; none without a checkpoint.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    best = folder.checkpoints.best
    laps = [] if best is None else _evolve(folder.path, best.step, _changed(folder))
    film = folder.videos / "evolution.mp4"
    return Evolution(laps=laps, film=film.relative_to(folder.path).as_posix() if film.is_file() else None)


def _changed(folder: RunFolder) -> int:
    return (folder.path / "run.json").stat().st_mtime_ns


@lru_cache(maxsize=KEPT)
def _drive(path: Path, step: int, _changed: int, road: int) -> Demonstration:
    folder = RunFolder(path)
    tracks = trained_tracks(folder.read_info())
    lap = demonstrate(folder, step, road=road).recording
    columns = [*lap.poses.T, lap.column("actual_speed"), lap.column("actual_steering_angle"), lap.column("progress")]
    milli = np.rint(1000.0 * np.column_stack(columns)).astype(int)
    return Demonstration(
        step=step,
        seconds=lap.lap_times.get(1),
        poses=milli.tolist(),
        objects=objects_in(lap.rows),
        road=road,
        roads=[track.name for track in tracks],
        geometry=geometry(tracks[road].name, tracks[road]),
    )


@lru_cache(maxsize=KEPT)
def _evolve(path: Path, _best: int, _changed: int) -> list[EvolutionLap]:
    folder = RunFolder(path)
    stretches = read_stretches(folder)
    return [
        EvolutionLap(
            step=drive.step,
            stretch=stretch_at(stretches, drive.step).number,
            seconds=drive.lap_time,
            completion=drive.completion,
            poses=drive.poses.tolist(),
        )
        for drive in evolution_of(folder)
    ]
