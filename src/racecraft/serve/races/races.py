"""Races: made, entered, decided by jobs, ranked.

    race ──enter──▶ entry + job (kind race) ──▶ evaluation in the model's run folder, driven again to verify it
      └─ standings ◀── ranking_key of each model's best entry ◀── the job's result

Every entry starts alike: one car, the race's rules, objects and seed. The table says whose a race and an entry are, so
that accounts can come later.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa

from racecraft.contest import Key, places, ranking_key, ranking_score
from racecraft.errors import ConfigError
from racecraft.race import RaceRules
from racecraft.serve.jobs.queue import JobQueue, new_job
from racecraft.serve.models.garage import Garage
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.schemas import (
    Enter,
    NewRace,
    RaceCard,
    RaceChange,
    RaceDetail,
    RaceState,
    Standing,
    Undecided,
)
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Entry, Job, Race, User, now
from racecraft.serve.tracks.courses import Courses
from racecraft.sim import objects_for_race
from racecraft.sim.objects import NO_OBJECTS, Objects

KIND: Final = "race"
"""Of the jobs."""
MAX_RACES: Final = 500
MAX_ENTRIES: Final = 1000  # of a race


class Races:
    """The races of a console."""

    def __init__(self, database: Database, queue: JobQueue, garage: Garage, courses: Courses) -> None:
        self._database, self._queue, self._garage, self._courses = database, queue, garage, courses

    def create(self, request: NewRace, *, user_id: int) -> int:
        """Make a race; its id.

        Raises:
            RacecraftError: The track or a setting is not usable.
        """
        self._courses.load(request.track)
        opens = request.opens or now()
        if request.closes is not None and request.closes <= opens:
            raise ConfigError("The race closes before it opens.", hint="Choose a later end, or none.")
        if request.ranking == "average" and request.minimum_laps > request.laps:
            raise ConfigError(
                f"An average over {request.minimum_laps} laps cannot be had from {request.laps}.",
                hint="Ask for more laps, or average over fewer.",
            )
        rules = RaceRules(
            laps=request.laps,
            max_resets=request.max_resets,
            offtrack_penalty=request.offtrack_penalty,
            collision_penalty=request.collision_penalty,
            direction=request.direction,
        )
        with self._database.transaction() as session:
            if (session.scalar(sa.select(sa.func.count(Race.id)).where(Race.deleted.is_(None))) or 0) >= MAX_RACES:
                raise Conflict(f"There are {MAX_RACES} races already.", hint="Delete some first.")
            race = Race(
                owner_id=user_id,
                title=request.title.strip(),
                description=request.description.strip(),
                kind=request.kind,
                track=request.track,
                rules=rules.to_dict(),
                objects=_objects(request).to_dict(),
                vehicle=request.vehicle,
                seed=request.seed,
                ranking=request.ranking,
                minimum_laps=_laps_needed(request),
                opens=opens,
                closes=request.closes,
            )
            session.add(race)
            session.flush()
            return race.id

    def cards(self) -> list[RaceCard]:
        """All races, newest first."""
        with self._database.transaction() as session:
            races = list(session.scalars(sa.select(Race).where(Race.deleted.is_(None)).order_by(Race.created.desc())))
            entries = _entries(session, [race.id for race in races])
        return [RaceCard(**_card(race, entries.get(race.id, []))) for race in races]

    def get(self, race_id: int) -> RaceDetail:
        """A race with its standings."""
        with self._database.transaction() as session:
            race = _race(session, race_id)
            entries = _entries(session, [race_id]).get(race_id, [])
        undecided = [
            Undecided.model_validate(
                {"entry": entry.id, "model": job.run, "state": job.state, "created": entry.created, "error": job.error}
            )
            for entry, job, _ in entries
            if job.state != "done"
        ]
        return RaceDetail(
            **_card(race, entries),
            rules=race.rules,
            objects=race.objects,
            vehicle=race.vehicle,
            seed=race.seed,
            standings=_standings(race, entries, runs=self._garage.runs),
            undecided=undecided,
        )

    def change(self, race_id: int, request: RaceChange) -> None:
        """Another title, description or end."""
        with self._database.transaction() as session:
            race = _race(session, race_id)
            for name, value in request.model_dump(exclude_unset=True).items():
                if name != "title" or value is not None:
                    setattr(race, name, value if value is not None or name == "closes" else "")
            if race.closes is not None and race.closes <= race.opens:
                raise ConfigError("The race closes before it opens.", hint="Choose a later end, or none.")

    def set_deleted(self, race_id: int, *, is_deleted: bool) -> None:
        """Put a race away, or bring it back."""
        with self._database.transaction() as session:
            _race(session, race_id, is_deleted=not is_deleted).deleted = now() if is_deleted else None

    def enter(self, race_id: int, request: Enter, *, user_id: int) -> list[int]:
        """Enter models, each with a job of its own; the ids of the entries.

        Raises:
            NotFound: There is no such race or model.
            Conflict: The race is not open, or a model has nothing to drive with.
        """
        models = list(dict.fromkeys(request.models))
        with self._database.transaction() as session:
            _hold(session, race_id)
            race = _race(session, race_id)
            for name in models:
                if self._garage.folder(name).checkpoints.last is None:
                    raise Conflict(f"Model {name!r} has no checkpoint to race with.", hint="Train it first.")
            if (state := _state(race)) != "open":
                raise Conflict(f"The race is {'not open yet' if state == 'upcoming' else 'over'}.")
            count = session.scalar(sa.select(sa.func.count(Entry.id)).where(Entry.race_id == race_id)) or 0
            if count + len(models) > MAX_ENTRIES:
                raise Conflict(f"A race takes {MAX_ENTRIES} entries.")
            payload = {
                "track": self._courses.path_or_name(race.track),
                "rules": race.rules,
                "objects": race.objects,
                "vehicle": race.vehicle,
                "seed": race.seed,
                "checkpoint": request.checkpoint,
            }
            jobs = [new_job(KIND, name, payload) for name in models]
            session.add_all(jobs)
            session.flush()  # entries name their jobs
            entries = [Entry(race_id=race_id, user_id=user_id, run=job.run, job_id=job.id) for job in jobs]
            session.add_all(entries)
            session.flush()
            return [entry.id for entry in entries]

    def withdraw(self, race_id: int, entry_id: int) -> None:
        """Take an entry back; if it is being driven, that ends."""
        with self._database.transaction() as session:
            entry = session.get(Entry, entry_id)
            if entry is None or entry.race_id != race_id or entry.withdrawn is not None:
                raise NotFound(f"There is no entry {entry_id} in this race.")
            entry.withdrawn = now()
            job_id = entry.job_id
        self._queue.cancel(job_id)

    def evaluations(self, race_id: int, entry_ids: Iterable[int]) -> list[tuple[int, str, Path]]:
        """Entry, model and folder of the evaluation of some decided entries, in the order asked for."""
        with self._database.transaction() as session:
            _race(session, race_id)
            entries = {entry.id: job for entry, job, _ in _entries(session, [race_id]).get(race_id, [])}
        found = []
        for entry_id in entry_ids:
            job = entries.get(entry_id)
            folder = None if job is None else _folder(job, self._garage.runs)
            if job is None or folder is None:
                raise NotFound(f"Entry {entry_id} has no replay in this race.")
            found.append((entry_id, job.run, folder))
        return found


Entered = tuple[Entry, Job, str]
"""An entry, its job and its user's name."""


def _race(session: Any, race_id: int, *, is_deleted: bool = False) -> Race:
    race: Race | None = session.get(Race, race_id) if 0 <= race_id < 2**31 else None
    if race is None or (race.deleted is not None) != is_deleted:
        raise NotFound(f"There is no race {race_id}.")
    return race


def _hold(session: Any, race_id: int) -> None:
    """Keep others from changing a race or entering it until the transaction ends, in either database.

    What a transaction writes first it holds, SQLite the whole file and PostgreSQL the row; what it reads first it does
    not, so two could count the entries and both add one.
    """
    if 0 <= race_id < 2**31:
        session.execute(sa.update(Race).where(Race.id == race_id).values(title=Race.title))


def _entries(session: Any, race_ids: list[int]) -> dict[int, list[Entered]]:
    query = (
        sa.select(Entry, Job, User.name)
        .join(Job, Entry.job_id == Job.id)
        .join(User, Entry.user_id == User.id)
        .where(Entry.race_id.in_(race_ids), Entry.withdrawn.is_(None))
        .order_by(Entry.created, Entry.id)
    )
    found: dict[int, list[Entered]] = {}
    for entry, job, user in session.execute(query):
        found.setdefault(entry.race_id, []).append((entry, job, user))
    return found


def _laps_needed(request: NewRace) -> int:
    """Laps that an entry must complete to be ranked."""
    return {"total": request.laps, "best": 1, "average": request.minimum_laps}[request.ranking]


def _objects(request: NewRace) -> Objects:
    if request.kind == "time-trial":
        return NO_OBJECTS
    settings: dict[str, Any] = {"count": request.objects}
    if request.kind == "head-to-bot":
        settings["speed"] = request.bot_speed
    return objects_for_race(request.kind, settings=settings)


def _state(race: Race, moment: datetime | None = None) -> RaceState:
    moment = moment or now()
    if moment < race.opens:
        return "upcoming"
    return "closed" if race.closes is not None and moment >= race.closes else "open"


def _card(race: Race, entries: list[Entered]) -> dict[str, Any]:
    ranked = [(entry.id, job) for entry, job, _ in entries if math.isfinite(_score(race, job))]
    leader = min(ranked, key=lambda found: (_key(race, found[1]), found[0]), default=None)
    return {
        **{name: getattr(race, name) for name in RaceCard.model_fields if hasattr(race, name)},
        "laps": int(race.rules.get("laps", 1)),
        "state": _state(race),
        "entries": len(entries),
        "models": len({job.run for _, job, _ in entries}),
        "running": sum(job.state in ("queued", "running") for _, job, _ in entries),
        "leader": leader[1].run if leader else None,
        "leader_score": _score(race, leader[1]) if leader else None,
    }


def _lap_times(job: Job) -> list[float]:
    trials = (job.result or {}).get("lap_seconds") or [[]]
    return [float(seconds) for seconds in trials[0]]


def _score(race: Race, job: Job) -> float:
    if job.state != "done":
        return math.inf
    return ranking_score(_lap_times(job), ranking=race.ranking, minimum_laps=race.minimum_laps)


def _key(race: Race, job: Job) -> Key:
    """What the place of a decided entry is decided by."""
    result: dict[str, Any] = job.result or {}
    return ranking_key(
        _score(race, job),
        lap_times=_lap_times(job),
        completion=float(result.get("mean_completion") or 0.0),
        resets=int(result.get("resets") or 0),
    )


def _standings(race: Race, entries: list[Entered], *, runs: Path) -> list[Standing]:
    """Each model's best entry, in the order of their places; of equals, who was first."""
    best: dict[tuple[int, str], tuple[tuple[Key, int], Entered]] = {}
    attempts: dict[tuple[int, str], int] = {}
    for entered in entries:
        entry, job, _ = entered
        if job.state != "done" or job.result is None:
            continue
        who = (entry.user_id, job.run)
        attempts[who] = attempts.get(who, 0) + 1
        rank = (_key(race, job), entry.id)
        if who not in best or rank < best[who][0]:
            best[who] = (rank, entered)
    ordered = sorted(best.values(), key=lambda found: found[0])
    scores = [_score(race, job) for _, (_, job, _) in ordered]
    first = min(scores, default=math.inf)
    return [
        _standing(
            entered,
            place=place,
            score=score,
            first=first,
            attempts=attempts[entered[0].user_id, entered[1].run],
            runs=runs,
        )
        for (_, entered), place, score in zip(ordered, places([rank[0] for rank, _ in ordered]), scores, strict=True)
    ]


def _standing(entered: Entered, *, place: int, score: float, first: float, attempts: int, runs: Path) -> Standing:
    entry, job, user = entered
    result: dict[str, Any] = job.result or {}
    is_ranked = math.isfinite(score)
    times = _lap_times(job)
    folder = _folder(job, runs)
    verification = result.get("verification")
    return Standing(
        place=place if is_ranked else None,
        entry=entry.id,
        model=job.run,
        user=user,
        score=score if is_ranked else None,
        gap=score - first if is_ranked else None,
        lap_times=times,
        best_lap=min(times, default=None),
        laps=len(times),
        completion=float(result.get("mean_completion") or 0.0),
        off_tracks=int(result.get("off_track_count") or 0),
        crashes=int(result.get("crash_count") or 0),
        resets=int(result.get("resets") or 0),
        penalty=float(result.get("penalty_seconds") or 0.0),
        attempts=attempts,
        entered=entry.created,
        video=_file(result, "video", runs / job.run),
        picture=_file(result, "racing line", runs / job.run),
        has_replay=folder is not None and (folder / "evaluation-simtrace" / "0-iteration.csv").is_file(),
        is_verified=None if not isinstance(verification, dict) else bool(verification.get("is_genuine")),
        verdict=str(verification.get("verdict", "")) if isinstance(verification, dict) else "",
    )


def _relative(result: dict[str, Any], name: str) -> Path | None:
    """A file's place inside its run, which may have been renamed since."""
    try:
        return Path(result["files"][name]).relative_to(result["run"])
    except (KeyError, TypeError, ValueError):
        return None


def _file(result: dict[str, Any], name: str, run: Path) -> str | None:
    place = _relative(result, name)
    return place.as_posix() if place is not None and (run / place).is_file() else None


def _folder(job: Job, runs: Path) -> Path | None:
    place = _relative(job.result or {}, "summary") if job.state == "done" else None
    return (runs / job.run / place).parent if place is not None else None
