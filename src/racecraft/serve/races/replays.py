"""What the browser is told to show a trial of several entries side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from racecraft.analysis import driven_direction, sectors_of
from racecraft.errors import ReplayError
from racecraft.race.recording import Recording
from racecraft.replay.replay import MAX_CELLS, read_replay
from racecraft.serve.evaluations.objects import objects_in
from racecraft.serve.evaluations.schemas import RoadObject
from racecraft.serve.problems import NotFound
from racecraft.serve.races.schemas import MissingCar, RaceReplay, ReplayCar, ReplayGhost
from racecraft.serve.tracks.courses import geometry
from racecraft.serve.tracks.schemas import TrackSector
from racecraft.track import Track


def car_of(entry: int, model: str, recording: Recording, *, grain: int = 1, is_alone: bool = True) -> ReplayCar:
    """One drive.

    Args:
        entry: Its number.
        model: Its name.
        recording: What it did.
        grain: mm and mrad that its poses are rounded to.
        is_alone: Whether it had the road and what stood there for itself.
    """
    return ReplayCar(
        entry=entry,
        model=model,
        trace=((1000 / grain * recording.poses).round().astype(int) * grain).tolist(),
        laps=[step + 1 for step, event in recording.events if event == "lap_complete"],
        objects=road_of(recording) if is_alone else [],
    )


def trial_of(
    path: Path, trial: int, *, entry: int, model: str, grain: int = 1, max_numbers: int = MAX_CELLS
) -> ReplayCar:
    """One trial of a replay file, see `car_of` and `read_replay`; trials count from 0.

    Raises:
        ReplayError: The file cannot be read, or has no such trial.
    """
    cars = read_replay(path, max_numbers=max_numbers).cars
    if trial >= len(cars):
        raise ReplayError(f"{path.name} has no trial {trial + 1}.")
    return car_of(entry, model, cars[trial].recording, grain=grain)


def cars_there(
    models: Mapping[int, str], car_of: Callable[[int], ReplayCar]
) -> tuple[list[ReplayCar], list[MissingCar]]:
    """The drives of some entries, and the entries that have none: what became of one's file is no other's loss.

    Args:
        models: Names of the entries' models, by their numbers.
        car_of: The drive of one of them; NotFound or ReplayError where its replay is gone or damaged.

    Raises:
        NotFound, ReplayError: None of them has one; says it of the first.
    """
    cars: list[ReplayCar] = []
    missing: list[MissingCar] = []
    problems: list[NotFound | ReplayError] = []
    for entry, model in models.items():
        try:
            cars.append(car_of(entry))
        except (NotFound, ReplayError) as error:
            missing.append(MissingCar(entry=entry, model=model))
            problems.append(error)
    if not cars and problems:
        raise problems[0]
    return cars, missing


def road_of(*recordings: Recording) -> list[RoadObject]:
    """Boxes and bot cars of one road, as whoever drove longest saw them."""
    return objects_in(max(recordings, key=len).rows, has_racers=False)


def replay_of(
    name: str,
    track: Track,
    cars: list[ReplayCar],
    *,
    trial: int,
    is_coarse: bool = False,
    objects: Sequence[RoadObject] = (),
    ghosts: Sequence[ReplayGhost] = (),
    missing: Sequence[MissingCar] = (),
) -> RaceReplay:
    """The same trial of some cars.

    Args:
        name: The track's.
        track: As the race drives it or the other way round.
        cars: At least one.
        trial: From 0.
        is_coarse: Whether the poses are rounded so that nobody reads a driver's choices off them.
        objects: Boxes and bot cars of a road that all share.
        ghosts: Cars beside them that were not there.
        missing: Others that were asked for and cannot be shown.
    """
    driven = driven_direction(track, [np.array(car.trace, float).reshape(-1, 3)[:, :2] / 1000 for car in cars])
    return RaceReplay(
        trial=trial,
        geometry=geometry(name, track),
        is_reversed=driven is not track,
        sectors=[] if is_coarse else [TrackSector.of(sector) for sector in sectors_of(driven)],
        objects=list(objects),
        cars=cars,
        missing=list(missing),
        ghosts=list(ghosts),
    )
