"""Laps to drive against: one's own fastest, and the best of every model that raced on a track."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast, get_args

import sqlalchemy as sa

from racecraft.errors import RacecraftError
from racecraft.json_file import read_json_object
from racecraft.judging.trained import is_road_of
from racecraft.race.provenance import vehicle_note
from racecraft.run import RunFolder, list_runs
from racecraft.serve.driving.drives import DrivenCar
from racecraft.serve.driving.schemas import Directions, Ghost, GhostCard, Vehicles
from racecraft.serve.evaluations.traces import read_laps, read_start
from racecraft.serve.problems import NotFound
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import DrivenRecord, now
from racecraft.sim.vehicle import Vehicle
from racecraft.track import Track

NEWEST: Final = 20  # evaluations of a model that are looked at
YOU: Final = "you"


class Ghosts:
    """Laps of people and models.

    Args:
        runs: Folder of the run folders.
        database: One's own laps.
    """

    def __init__(self, runs: Path, database: Database) -> None:
        self._runs, self._database = runs, database

    def best(self, track: Track, *, vehicle: str, direction: str, user_id: int) -> DrivenRecord | None:
        """A driver's fastest lap."""
        query = _record(track, vehicle=vehicle, direction=direction, user_id=user_id)
        with self._database.transaction() as session:
            return session.scalars(query).first()

    def keep(self, car: DrivenCar, seconds: float, trace: list[list[int]]) -> bool:
        """Remember a lap if it is its driver's fastest; whether it is."""
        query = _record(car.track, vehicle=car.vehicle, direction=car.direction, user_id=car.user_id)
        with self._database.transaction() as session:
            record = session.scalars(query).first()
            if record is None:
                record = DrivenRecord(
                    user_id=car.user_id, digest=car.track.digest, vehicle=car.vehicle, direction=car.direction
                )
                session.add(record)
            elif record.seconds <= seconds:
                return False
            record.track, record.seconds, record.trace, record.driven = car.track.name[:200], seconds, trace, now()
        return True

    def cards(self, track: Track, *, vehicle: Vehicles, direction: Directions, user_id: int) -> list[GhostCard]:
        """All ghosts of a track: one's own in this vehicle and direction, then the models', fastest first.

        A model that drove this way round is listed with its fastest lap of them; one that never did, behind all others
        with its fastest lap the other way.
        """
        found = []
        record = self.best(track, vehicle=vehicle, direction=direction, user_id=user_id)
        if record is not None:
            found.append(_own(record))
        models = []
        for folder in list_runs(self._runs):
            other = None
            for lap in sorted(_raced(folder, track), key=lambda lap: lap.seconds):
                driven = _direction(read_start(lap.path), track)
                if driven == direction:
                    models.append(lap.card(driven))
                    break
                if driven and other is None:
                    other = lap.card(driven)
            else:
                models.extend([other] if other is not None else [])
        models.sort(key=lambda ghost: (ghost.direction != direction, ghost.seconds, ghost.name))
        return found + models[:100]

    def get(self, key: str, track: Track, *, vehicle: Vehicles, direction: Directions, user_id: int) -> Ghost:
        """A ghost by its key.

        Raises:
            NotFound: There is none that drove a lap here this way.
        """
        if key == YOU:
            record = self.best(track, vehicle=vehicle, direction=direction, user_id=user_id)
            if record is not None:
                return Ghost(**_own(record).model_dump(), trace=record.trace)
        name = key.removeprefix("model:")
        if key.startswith("model:") and name in {run.name for run in list_runs(self._runs)}:
            for lap in sorted(_raced(RunFolder(self._runs / name), track), key=lambda lap: lap.seconds):
                trace = _best_lap(lap)
                if trace and _direction(trace[0], track) == direction:
                    return Ghost(**lap.card(direction).model_dump(), trace=trace)
        raise NotFound(f"There is no ghost {key[:80]!r} on this track in this direction.")


def _record(track: Track, *, vehicle: str, direction: str, user_id: int) -> sa.Select[DrivenRecord]:
    return sa.select(DrivenRecord).where(
        DrivenRecord.user_id == user_id,
        DrivenRecord.digest == track.digest,
        DrivenRecord.vehicle == vehicle,
        DrivenRecord.direction == direction,
    )


@dataclass(frozen=True, kw_only=True)
class _Raced:
    """The best lap of a model's evaluation."""

    name: str
    """The model's."""
    seconds: float
    path: Path
    """The evaluation's steps."""
    vehicle: Vehicles | None

    def card(self, direction: Directions) -> GhostCard:
        key = f"model:{self.name}"
        return GhostCard(key=key, name=self.name, seconds=self.seconds, direction=direction, vehicle=self.vehicle)


def _own(record: DrivenRecord) -> GhostCard:
    vehicle, direction = cast(Vehicles, record.vehicle), cast(Directions, record.direction)
    return GhostCard(key=YOU, name="", seconds=record.seconds, direction=direction, vehicle=vehicle)


def _raced(folder: RunFolder, track: Track) -> Iterator[_Raced]:
    """The best laps of a model's newest evaluations on a track, as long as it is the road that it was."""
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True)[:NEWEST]:
        try:
            summary: dict[str, Any] = read_json_object(path)
        except RacecraftError:
            continue
        best = summary.get("best_lap_seconds")
        trace = path.parent / "evaluation-simtrace" / "0-iteration.csv"
        if summary.get("track") != track.name or not _is_its_road(summary, folder, track):
            continue
        if isinstance(best, int | float) and trace.is_file():
            vehicle = _vehicle(summary.get("vehicle"), folder)
            yield _Raced(name=folder.name, seconds=float(best), path=trace, vehicle=vehicle)


def _is_its_road(summary: dict[str, Any], folder: RunFolder, track: Track) -> bool:
    """Whether an evaluation on a track of this name was driven on this very road, as far as its files say."""
    if (told := summary.get("track_digest")) is not None:
        return bool(told == track.digest)
    with suppress(RacecraftError, KeyError, TypeError):
        return is_road_of(summary, folder.read_info(), track)
    return True


def _vehicle(told: object, folder: RunFolder) -> Vehicles | None:
    """The preset that an evaluation was driven in, as it says itself; of an older one, what its model learned in."""
    if told is None:
        with suppress(RacecraftError, KeyError, TypeError):
            told = vehicle_note(Vehicle(**folder.read_info().settings["vehicle"]))
    return cast(Vehicles, told) if told in get_args(Vehicles) else None


def _best_lap(raced: _Raced) -> list[list[int]]:
    """Poses of the completed lap that took so long."""
    laps = [lap for lap in read_laps(raced.path) if lap.is_complete]
    return min(laps, key=lambda lap: abs(lap.seconds - raced.seconds)).trace if laps else []


def _direction(start: list[int], track: Track) -> Directions | None:
    """Which way round a lap was driven that began at x, y, heading in mm and mrad; none without a start."""
    if not start:
        return None
    x, y, heading = (value / 1000 for value in start)
    s, _ = track.project([x, y])
    return "forward" if math.cos(heading - float(track.heading_at(s))) >= 0.0 else "reverse"
