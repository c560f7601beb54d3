"""Races: made, entered, decided by jobs, ranked.

    race ──enter──▶ entry + job (kind race) ──▶ replay and video below .racecraft/races, driven again to verify it
      └─ standings ◀── ranking_key of each model's best entry ◀── the job's result

Every entry starts alike, by what was announced when the race was made: its document and the commitment of its secret
are published at once, the secret when the race is over. Until then nothing is shown that tells where it starts. The
table says whose a race and an entry are.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.contest.finals import FinalTerms
from racecraft.contest.terms import RaceTerms, race_terms
from racecraft.errors import ConfigError
from racecraft.race.announcement import Announcement, draw_secret
from racecraft.race.conditions import Conditions
from racecraft.race.rules import RaceRules
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.queue import JobQueue, new_job, new_job_id
from racecraft.serve.models.garage import Garage
from racecraft.serve.people.keys import hold_account
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.ghost_schemas import Ghost, Starter
from racecraft.serve.races.ghosts import keep
from racecraft.serve.races.rules import car_of, rules_of
from racecraft.serve.races.schemas import (
    Enter,
    NewRace,
    RaceCard,
    RaceChange,
    RaceDetail,
    Undecided,
)
from racecraft.serve.races.standings import Entered, key_of, score_of, standings_of
from racecraft.serve.races.state import OWN, told_car, told_ranges
from racecraft.serve.races.state import announcement_of as announcement_of
from racecraft.serve.races.state import is_withheld as is_withheld
from racecraft.serve.races.state import state_of as state_of
from racecraft.serve.races.tasks import entry_folder
from racecraft.serve.road import road_objects
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Entry, Job, Race, User, now
from racecraft.serve.tracks.courses import Courses
from racecraft.track import Track

KIND: Final = "race"
"""Of the jobs."""
MAX_RACES: Final = 500
MAX_ENTRIES: Final = 1000  # of a race
MISTAKES: Final = 60.0
"""s a lap that a group's race leaves for mistakes and their penalties."""
SLOWEST: Final = 0.5
"""m/s at which its laps can be driven in time, beside that."""


class Races:
    """The races that somebody holds; a league's, which others enter, are `racecraft.serve.submissions`'s.

    Args:
        database: Where they are.
        queue: Of jobs.
        garage: Of models.
        courses: Of tracks.
        share: Has the store hold what an entry needs, where there is one.
        see: Is given each entry's job before somebody hears of it.
        replays: Of an entry's ghosts that drove before: `racecraft.serve.contests.contests.Contests.replays`.
        user_id: Who holds them.
    """

    def __init__(
        self,
        database: Database,
        queue: JobQueue,
        garage: Garage,
        courses: Courses,
        *,
        share: Callable[..., Cargo | None] = lambda *_, **__: None,
        see: Callable[[Job], Job] = lambda job: job,
        replays: Callable[[Sequence[Ghost], Track, RaceRules], dict[int, Path]] = lambda *_: {},
        user_id: int = OWNER,
    ) -> None:
        self._database, self._queue, self._garage, self._courses = database, queue, garage, courses
        self._own = sa.and_(Race.owner_id == user_id, Race.group_id.is_(None), Race.deleted.is_(None))
        self._share, self._see, self._replays, self._user_id = share, see, replays, user_id

    def create(
        self,
        request: NewRace,
        *,
        user_id: int,
        group_id: int | None = None,
        final: FinalTerms | None = None,
        permit: Callable[[Session], object] = lambda _: None,
    ) -> int:
        """Make a race, of a league's group if one is given; its id.

        Args:
            request: What it is to be.
            user_id: Who holds it.
            group_id: For whom.
            final: Of a race in which two meet at a time.
            permit: Raises, in the transaction in which it is made, if it may not be.

        Raises:
            RacecraftError: The track or a setting is not usable, or what `permit` raises.
        """
        opens = request.opens or now()
        if request.closes is not None and request.closes <= opens:
            raise ConfigError("The race closes before it opens.", hint="Choose a later end, or none.")
        rules = rules_of(request, laps=request.laps)
        if request.ranking == "average" and (request.minimum_laps or 1) > rules.laps:
            raise ConfigError(
                f"An average over {request.minimum_laps} laps cannot be had from {rules.laps}.",
                hint="Ask for more laps, or average over fewer.",
            )
        track = self._courses.load(request.track)
        if group_id is not None:
            most = time_limit(track, laps=rules.laps)
            rules = replace(rules, time_limit=min(rules.time_limit or most, most))
        terms = _terms(request, track, final, rules)
        announced = terms.announcement
        with self._database.transaction() as session:
            hold_account(session, user_id)  # two at the same moment count each other
            permit(session)
            held = sa.and_(Race.owner_id == user_id, Race.deleted.is_(None))
            if (session.scalar(sa.select(sa.func.count(Race.id)).where(held)) or 0) >= MAX_RACES:
                raise Conflict(f"There are {MAX_RACES} races already.", hint="Delete some first.")
            race = Race(
                owner_id=user_id,
                group_id=group_id,
                title=request.title.strip(),
                description=request.description.strip(),
                kind=request.kind,
                track=request.track,
                rules=terms.conditions.rules.to_dict(),
                objects=terms.conditions.objects.to_dict(),
                vehicle=request.vehicle if isinstance(request.vehicle, str) else OWN,
                seed=request.seed or 0,
                ranking=request.ranking,
                minimum_laps=terms.minimum_laps,
                trials=terms.num_trials,
                document=dict(announced.document),
                commitment=announced.commitment,
                secret=announced.secret,
                opens=opens,
                closes=request.closes,
            )
            session.add(race)
            session.flush()
            return race.id

    def cards(self) -> list[RaceCard]:
        """All races, newest first."""
        with self._database.transaction() as session:
            races = list(session.scalars(sa.select(Race).where(self._own).order_by(Race.created.desc())))
            entries = _entries(session, [race.id for race in races])
        return [RaceCard(**_card(race, entries.get(race.id, []))) for race in races]

    def get(self, race_id: int) -> RaceDetail:
        """A race with its standings."""
        with self._database.transaction() as session:
            race = self._race(session, race_id)
            entries = _entries(session, [race_id]).get(race_id, [])
        for _, job, _ in entries:
            self._see(job)
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
            vehicle=told_car(race),
            randomize=told_ranges(race),
            seed=None if race.secret else race.seed,
            commitment=race.commitment,
            secret="" if is_withheld(race) else race.secret,
            is_withheld=is_withheld(race),
            standings=standings_of(race, entries, runs=self._garage.runs, is_withheld=is_withheld(race)),
            undecided=undecided,
        )

    def change(self, race_id: int, request: RaceChange) -> None:
        """Another title, description or end.

        Raises:
            Conflict: It is over and cannot be opened again.
        """
        with self._database.transaction() as session:
            hold(session, race_id)
            race = self._race(session, race_id)
            sets_end = "closes" in request.model_fields_set or request.is_over
            if sets_end and _is_told(race):
                reason = "it was driven under the old rules" if not race.commitment else "everybody knows its secret"
                raise Conflict(
                    f"The race is over and cannot be opened again: {reason}.",
                    hint="Make another one; it starts from other places.",
                )
            for name, value in request.model_dump(exclude_unset=True, exclude={"is_over"}).items():
                if name != "title" or value is not None:
                    setattr(race, name, value if value is not None or name == "closes" else "")
            if request.is_over:
                race.closes = now()
            if race.closes is not None and race.closes <= race.opens:
                raise ConfigError("The race closes before it opens.", hint="Choose a later end, or none.")

    def set_deleted(self, race_id: int, *, is_deleted: bool) -> None:
        """Put a race away, or bring it back."""
        with self._database.transaction() as session:
            self._race(session, race_id, is_deleted=not is_deleted).deleted = now() if is_deleted else None

    def enter(self, race_id: int, request: Enter, *, user_id: int) -> list[int]:
        """Enter models, each with a job of its own; the ids of the entries.

        Raises:
            NotFound: There is no such race, model or ghost.
            Conflict: The race is not open, or a model has nothing to drive with.
            ConfigError: A ghost is of another road.
        """
        models = list(dict.fromkeys(request.models))
        with self._database.transaction() as session:
            race = self._open(session, race_id, more=len(models))
        for name in models:
            self._garage.require_checkpoint(name, request.checkpoint)
        road, rivals = self._courses.path_or_name(race.track), []
        for ghost in request.ghosts:
            if isinstance(ghost, Starter):
                self._garage.require_checkpoint(ghost.model, ghost.checkpoint)
                rivals.append(self._garage.folder(ghost.model))
        replays = {}
        if request.ghosts:
            replays = self._replays(request.ghosts, self._courses.load(race.track), RaceRules.from_dict(race.rules))
        payload = {
            "track": road,
            "announcement": announcement_of(race).to_dict(),
            "checkpoint": request.checkpoint,
            "ghosts": request.model_dump()["ghosts"],
        }
        folders = {name: entry_folder(self._garage.runs, new_job_id()) for name in models}
        try:
            jobs = []
            for name, folder in folders.items():
                keep(replays, folder)
                filled = folder if replays else None
                cargo = self._share(self._garage.folder(name), *rivals, tracks=(road,), filled=filled)
                jobs.append(new_job(KIND, name, payload, cargo=cargo, user_id=user_id, job_id=folder.name))
            with self._database.transaction() as session:
                hold(session, race_id)
                self._open(session, race_id, more=len(models))
                session.add_all(jobs)
                session.flush()  # entries name their jobs
                entries = [Entry(race_id=race_id, user_id=user_id, run=job.run, job_id=job.id) for job in jobs]
                session.add_all(entries)
                session.flush()
                return [entry.id for entry in entries]
        except Exception:
            for folder in folders.values():
                shutil.rmtree(folder, ignore_errors=True)
            raise

    def withdraw(self, race_id: int, entry_id: int) -> None:
        """Take an entry back; if it is being driven, that ends."""
        with self._database.transaction() as session:
            self._race(session, race_id)
            entry = session.get(Entry, entry_id)
            if entry is None or entry.race_id != race_id or entry.withdrawn is not None:
                raise NotFound(f"There is no entry {entry_id} in this race.")
            entry.withdrawn = now()
            job_id = entry.job_id
        self._queue.cancel(job_id)

    def announcement(self, race_id: int) -> Announcement:
        """What is published of a race: its secret only when it is over.

        Raises:
            NotFound: There is no such race, or nobody announced it.
        """
        with self._database.transaction() as session:
            race = self._race(session, race_id)
        if not race.commitment:
            raise NotFound(f"Race {race_id} was driven under the old rules, and announced by nobody.")
        announced = announcement_of(race)
        return replace(announced, secret="") if is_withheld(race) else announced

    def driven(self, race_id: int, entry_ids: Iterable[int]) -> list[tuple[int, Job]]:
        """Decided entries with their jobs, in the order asked for, to be looked at.

        Raises:
            NotFound: There is no such race, or no such entry that is decided.
            Conflict: The race is not over, and they would tell where it starts.
        """
        with self._database.transaction() as session:
            race = self._race(session, race_id)
            entries = {entry.id: job for entry, job, _ in _entries(session, [race_id]).get(race_id, [])}
        if is_withheld(race):
            raise Conflict("What was driven in this race is shown when it is over: it tells where it starts.")
        found = []
        for entry_id in entry_ids:
            job = entries.get(entry_id)
            if job is None or job.state != "done":
                raise NotFound(f"Entry {entry_id} has no replay in this race.")
            found.append((entry_id, self._see(job)))
        return found

    def _open(self, session: Any, race_id: int, *, more: int) -> Race:
        """A race that can be entered so many times more."""
        race = self._race(session, race_id)
        if (state := state_of(race)) != "open":
            raise Conflict(f"The race is {'not open yet' if state == 'upcoming' else 'over'}.")
        count = session.scalar(sa.select(sa.func.count(Entry.id)).where(Entry.race_id == race_id)) or 0
        if count + more > MAX_ENTRIES:
            raise Conflict(f"A race takes {MAX_ENTRIES} entries.")
        return race

    def _race(self, session: Any, race_id: int, *, is_deleted: bool = False) -> Race:
        race: Race | None = session.get(Race, race_id) if 0 <= race_id < 2**31 else None
        is_own = race is not None and race.owner_id == self._user_id and race.group_id is None
        if race is None or not is_own or (race.deleted is not None) != is_deleted:
            raise NotFound(f"There is no race {race_id}.")
        return race


def hold(session: Any, race_id: int) -> None:
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


def time_limit(track: Track, *, laps: int) -> float:
    """Whole seconds on a trial's clock after which it is over in a race of strangers: nobody keeps a judge for ever."""
    return float(math.ceil(laps * (MISTAKES + track.length / SLOWEST)))


def _terms(request: NewRace, track: Track, final: FinalTerms | None, rules: RaceRules) -> RaceTerms:
    """What a new race is held by, with a secret unless its seed is given."""
    vehicle, randomize = car_of(request)
    conditions = Conditions(
        track=track,
        rules=rules,
        seed=request.seed or 0,
        vehicle=vehicle,
        objects=road_objects(request, request.kind, count=request.objects),
        randomize=randomize,
    )
    return race_terms(
        conditions,
        kind=request.kind if final is None else "head-to-model",
        num_cars=1 if final is None else 2,
        ranking=request.ranking,
        minimum_laps=None if request.ranking == "total" else request.minimum_laps,  # pages of before sent 1 for it
        num_trials=request.trials if final is None else None,
        secret=draw_secret() if request.seed is None else None,
        final=None if final is None else final.to_dict(),
    )


def _is_told(race: Race) -> bool:
    """Whether it is over for good: driven under the old rules, or everybody may know its secret."""
    return not race.commitment or (bool(race.secret) and state_of(race) == "closed")


def _card(race: Race, entries: list[Entered]) -> dict[str, Any]:
    ranked = [(entry.id, job) for entry, job, _ in entries if math.isfinite(score_of(race, job))]
    leader = min(ranked, key=lambda found: (key_of(race, found[1]), found[0]), default=None)
    return {
        **{name: getattr(race, name) for name in RaceCard.model_fields if hasattr(race, name)},
        "laps": int(race.rules.get("laps", 1)),
        "state": state_of(race),
        "is_old": not race.commitment,
        "entries": len(entries),
        "models": len({job.run for _, job, _ in entries}),
        "running": sum(job.state in ("queued", "running") for _, job, _ in entries),
        "leader": leader[1].run if leader else None,
        "leader_score": score_of(race, leader[1]) if leader else None,
    }
