"""Laps to drive against: one's own fastest, and the best of every model that raced on a track."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa

from racecraft.errors import RacecraftError
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder, list_runs
from racecraft.serve.driving.drives import DrivenCar
from racecraft.serve.driving.schemas import Ghost, GhostCard
from racecraft.serve.evaluations.traces import read_laps
from racecraft.serve.problems import NotFound
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import DrivenRecord, now
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

    def cards(self, track: Track, *, vehicle: str, direction: str, user_id: int) -> list[GhostCard]:
        """All ghosts of a track, fastest first; one's own stands at the top."""
        found = []
        record = self.best(track, vehicle=vehicle, direction=direction, user_id=user_id)
        if record is not None:
            found.append(GhostCard(key=YOU, name="", seconds=record.seconds))
        models = []
        for folder in list_runs(self._runs):
            best = min(((seconds, path) for seconds, path in _raced(folder, track.name)), default=None)
            if best is not None:
                models.append(GhostCard(key=f"model:{folder.name}", name=folder.name, seconds=best[0]))
        return found + sorted(models, key=lambda ghost: (ghost.seconds, ghost.name))[:100]

    def get(self, key: str, track: Track, *, vehicle: str, direction: str, user_id: int) -> Ghost:
        """A ghost by its key.

        Raises:
            NotFound: There is none that drove a lap here this way.
        """
        driven = track.reversed() if direction == "reverse" else track
        if key == YOU:
            record = self.best(track, vehicle=vehicle, direction=direction, user_id=user_id)
            if record is not None:
                return Ghost(key=key, name="", seconds=record.seconds, trace=record.trace)
        name = key.removeprefix("model:")
        if key.startswith("model:") and name in {run.name for run in list_runs(self._runs)}:
            for seconds, path in sorted(_raced(RunFolder(self._runs / name), track.name)):
                trace = _best_lap(path, seconds)
                if trace and _goes_along(trace, driven):
                    return Ghost(key=key, name=name, seconds=seconds, trace=trace)
        raise NotFound(f"There is no ghost {key[:80]!r} on this track in this direction.")


def _record(track: Track, *, vehicle: str, direction: str, user_id: int) -> sa.Select[DrivenRecord]:
    return sa.select(DrivenRecord).where(
        DrivenRecord.user_id == user_id,
        DrivenRecord.digest == track.digest,
        DrivenRecord.vehicle == vehicle,
        DrivenRecord.direction == direction,
    )


def _raced(folder: RunFolder, track: str) -> Iterator[tuple[float, Path]]:
    """Best lap and steps of a model's newest evaluations on a track."""
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True)[:NEWEST]:
        try:
            summary: dict[str, Any] = read_json_object(path)
        except RacecraftError:
            continue
        best = summary.get("best_lap_seconds")
        trace = path.parent / "evaluation-simtrace" / "0-iteration.csv"
        if summary.get("track") == track and isinstance(best, int | float) and trace.is_file():
            yield float(best), trace


def _best_lap(path: Path, seconds: float) -> list[list[int]]:
    """Poses of the completed lap that took so long."""
    laps = [lap for lap in read_laps(path) if lap.is_complete]
    return min(laps, key=lambda lap: abs(lap.seconds - seconds)).trace if laps else []


def _goes_along(trace: list[list[int]], track: Track) -> bool:
    """Whether a lap was driven in a track's direction."""
    middle = len(trace) // 2
    (x, y, _), (x_next, y_next, _) = trace[middle - 1], trace[min(middle + 1, len(trace) - 1)]
    s, _ = track.project([x / 1000, y / 1000])
    heading = float(track.heading_at(s))
    return math.cos(heading) * (x_next - x) + math.sin(heading) * (y_next - y) >= 0.0
