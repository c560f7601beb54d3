"""The queue of jobs: claimed under a lease, kept alive by heartbeats, taken over when the worker is gone.

    queued ──claim──▶ running ──finish──▶ done | failed | cancelled
       ▲                 │ lease ran out (killed, machine off), or handed back (the server stops, others wait)
       └─────────────────┘ again, unless it was lost too often in a row without having got any further

Every step is one UPDATE whose WHERE says what it relies on, so two servers or workers never own a job together.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cache
from importlib import import_module
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import aliased

from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.office import Answer, Slot
from racecraft.serve.jobs.outcome import check_outcome
from racecraft.serve.jobs.turns import choose_to_rest, is_full, running_on, turn_of, turn_order, waiting_line
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job


@dataclass(frozen=True, kw_only=True)
class JobKind:
    """What the queue and the supervisor have to know about jobs of a kind."""

    slot: Slot
    """Which of the console's places it takes; `ServeSettings` says how many there are."""
    work: str
    """``module:function``, imported only where it runs; it takes a `Task` and returns the job's result as JSON.

    A job may be started again at any moment, so the function goes on where it was, or finds that all is done.
    """
    travels: bool = False
    """Whether another machine can do it, given its cargo."""
    rests: bool = False
    """Whether it saves itself when it is asked to, and goes on later with nothing lost."""
    folder: str = ""
    """What it fills below the state folder, if that is not its run."""
    news: str = ""
    """File of that folder that changes whenever there is something to show."""
    needs: str = ""
    """Module of an extra without which a worker leaves it to others."""
    stays: bool = False
    """Whether its process waits for another job afterwards: it is short, and loading takes longer."""
    progress: str = "{run}/checkpoints/manifest.json"
    """File below the runs folder that changes whenever something is kept for good."""
    counts: str = ""
    """``module:function`` that writes elsewhere what comes of it being done, in that very transaction: of a job that
    was cancelled a moment before nothing counts. It takes the session, the job's id and its result."""


KINDS: Final[Mapping[str, JobKind]] = {
    "train": JobKind(slot="training", work="racecraft.serve.models.tasks:train", travels=True, rests=True),
    "tune": JobKind(
        slot="training",
        work="racecraft.serve.tuning.tasks:tune",
        travels=True,
        folder="tunings/{tuning}",
        news="result.json",
        needs="optuna",
        progress=".racecraft/tunings/{tuning}/result.json",
    ),
    "evaluate": JobKind(slot="other", work="racecraft.serve.evaluations.tasks:evaluate", travels=True),
    "evolution": JobKind(slot="other", work="racecraft.serve.models.tasks:film_evolution"),
    "race": JobKind(slot="other", work="racecraft.serve.races.tasks:race", travels=True, folder="races/{job}"),
    "heat": JobKind(slot="other", work="racecraft.serve.contests.tasks:heat", travels=True, folder="contests/{job}"),
    "ladder": JobKind(
        slot="other",
        work="racecraft.serve.contests.tasks:ladder",
        travels=True,
        folder="contests/{job}",
        news="driven.txt",
    ),
    "judge": JobKind(
        slot="other",
        work="racecraft.serve.submissions.tasks:judge",
        stays=True,
        counts="racecraft.serve.submissions.tasks:count",
    ),
    "final": JobKind(
        slot="other",
        work="racecraft.serve.finals.tasks:final",
        stays=True,
        counts="racecraft.serve.finals.tasks:count",
    ),
    "store": JobKind(slot="other", work="racecraft.serve.models.tasks:store"),
}
WRITERS: Final = tuple(name for name, kind in KINDS.items() if not kind.folder)
"""Kinds whose jobs change their run."""
LEASE: Final = timedelta(seconds=20)
"""How long a job without a heartbeat still counts as running."""
FIRST_LEASE: Final = timedelta(seconds=180)
"""The same before the first heartbeat: a busy machine takes its time to start a process; a dead one is seen anyway."""
MAX_LOSSES: Final = 5
"""How often a job's process may die before it is given up: it may be what kills it. Progress makes up for losses."""
MAX_DEATHS: Final = 20
"""The same where all else on its machine died with it: rarely the job's doing."""
ORGANISER: Final = "organiser"
"""Of a job's payload: who has it done again for whoever it belongs to, who therefore does not cancel it."""
ENDED: Final = ("done", "failed", "cancelled")
RESTING: Final = tuple(name for name, kind in KINDS.items() if kind.rests)
WATCHED: Final = timedelta(seconds=5)
"""How long a look at a training on another machine makes that show its cars."""
GLANCE: Final = 0.1  # s between two looks of who listens: a small question, a fifth of a millisecond each
PATIENCE: Final = 5.0  # s that it listens


def function_named(name: str) -> Callable[..., Any]:
    """What a kind of job names as ``module:function``; imported now."""
    module, _, function = name.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), function)
    return found


def folder_of(job: Job) -> tuple[str, str] | None:
    """What a job fills below the state folder: kind of folder and its name; None where it is its run."""
    shelf, _, name = KINDS[job.kind].folder.partition("/") if job.kind in KINDS else ("", "", "")
    return (shelf, name.format(job=job.id, tuning=job.payload.get("tuning", ""))) if name else None


def new_job_id() -> str:
    """An id that no job has."""
    return secrets.token_hex(8)


def new_job(
    kind: str,
    run: str,
    payload: Mapping[str, Any],
    *,
    cargo: Cargo | None = None,
    user_id: int = OWNER,
    job_id: str | None = None,
) -> Job:
    """A job that is at the end of the queue once a session adds it."""
    return Job(
        id=job_id or new_job_id(),
        kind=kind,
        run=run,
        payload=dict(payload),
        user_id=user_id,
        travels=cargo is not None and KINDS[kind].travels,
        cargo={} if cargo is None else cargo.to_dict(),
    )


class JobQueue:
    """The jobs of a console's database; what is asked about runs and jobs is about one person's.

    Args:
        database: Where they are.
        user_id: The person.
    """

    def __init__(self, database: Database, *, user_id: int = OWNER) -> None:
        self._database, self._user_id = database, user_id
        self._heard: str | None = None  # of `listen`

    def of(self, user_id: int) -> JobQueue:
        """The same for another person."""
        return JobQueue(self._database, user_id=user_id)

    @property
    def user_id(self) -> int:
        """Whose jobs these are."""
        return self._user_id

    def add(
        self,
        kind: str,
        run: str,
        payload: Mapping[str, Any],
        *,
        cargo: Cargo | None = None,
        job_id: str | None = None,
    ) -> Job:
        """Put a job at the end of the queue; any machine may do one whose cargo is in the store.

        Args:
            kind: Of `KINDS`.
            run: That it is about.
            payload: What is to be done.
            cargo: What the store has for it.
            job_id: From `new_job_id`, of one whose folder was begun already.
        """
        job = new_job(kind, run, payload, cargo=cargo, user_id=self._user_id, job_id=job_id)
        with self._database.transaction() as session:
            session.add(job)
        return job

    def get(self, job_id: str) -> Job | None:
        """A job by its id; None for another's, too."""
        with self._database.transaction() as session:
            job = session.get(Job, job_id)
        return job if job is not None and job.user_id == self._user_id else None

    def list(self, *, run: str | None = None, kind: str | None = None, limit: int = 200) -> list[Job]:
        """Jobs, newest first."""
        query = sa.select(Job).where(Job.user_id == self._user_id).order_by(Job.created.desc()).limit(limit)
        if kind is not None:
            query = query.where(Job.kind == kind)
        if run is not None:
            query = query.where(Job.run == run)
        with self._database.transaction() as session:
            return list(session.scalars(query))

    def newest(self, kind: str, runs: Sequence[str]) -> dict[str, Job]:
        """The newest job of a kind about each of some runs that has one."""
        query = sa.select(Job).where(Job.user_id == self._user_id, Job.kind == kind, Job.run.in_(runs))
        with self._database.transaction() as session:
            return {job.run: job for job in session.scalars(query.order_by(Job.created))}

    def active(self, run: str) -> Job | None:
        """The training of a run that is queued or running."""
        query = sa.select(Job).where(self._about(run), Job.kind == "train", Job.state.in_(("queued", "running")))
        with self._database.transaction() as session:
            return session.scalars(query).first()

    def is_busy(self, run: str) -> bool:
        """Whether a job about this run is queued or running."""
        query = sa.select(Job.id).where(self._about(run), Job.state.in_(("queued", "running"))).limit(1)
        with self._database.transaction() as session:
            return session.scalar(query) is not None

    def is_travelling(self, run: str) -> bool:
        """Whether some machine works on this run and takes it to the store."""
        query = sa.select(Job.id).where(self._about(run), Job.state == "running", Job.travels, Job.kind.in_(WRITERS))
        with self._database.transaction() as session:
            return session.scalar(query.limit(1)) is not None

    def _about(self, run: str) -> sa.ColumnElement[bool]:
        return sa.and_(Job.user_id == self._user_id, Job.run == run)

    def before(self, job: Job) -> Sequence[str]:
        """Runs whose jobs have the places it waits for, or come first; nothing once it is no longer queued.

        Another's run has no name here.
        """
        if job.state != "queued":
            return []
        with self._database.transaction() as session:
            line = waiting_line(session, kinds_of(KINDS[job.kind].slot), self._database.moment(session))
        earlier = line[: next((place for place, one in enumerate(line) if one.id == job.id), 0)]
        return [one.run if one.user_id == self._user_id else "…" for one in earlier]

    def held(self, owner: str) -> Job | None:
        """The job that a worker has."""
        with self._database.transaction() as session:
            return session.scalars(sa.select(Job).where(Job.owner == owner, Job.state == "running")).first()

    @contextmanager
    def holding(self, job_id: str, *, owner: str) -> Iterator[bool]:
        """Whether an owner has a job, which nobody takes from it before the block ends."""
        kept = sa.update(Job).where(Job.id == job_id, Job.owner == owner, Job.state == "running")
        with self._database.transaction() as session:
            kept = kept.values(lease_until=self._database.moment(session) + LEASE)
            yield session.execute(kept).rowcount == 1  # type: ignore[attr-defined]

    def elsewhere(self, machine: str) -> Sequence[Job]:
        """What other machines are doing."""
        query = sa.select(Job).where(Job.state == "running", Job.travels, Job.machine != machine)
        with self._database.transaction() as session:
            return session.scalars(query).all()

    def watch(self, job_id: str) -> None:
        """Have the machine that does a job show its cars, for a moment."""
        with self._database.transaction() as session:
            until = self._database.moment(session) + WATCHED
            session.execute(sa.update(Job).where(Job.id == job_id).values(watched_until=until))

    def has_room(self, kinds: tuple[str, ...], *, machine: str, places: int) -> bool:
        """Whether a machine with so many places for these kinds may start one more."""
        with self._database.transaction() as session:
            moment = self._database.moment(session)
            return not is_full(running_on(session, kinds, machine), places, moment, resting=RESTING)

    def make_room(self, kinds: tuple[str, ...], *, machine: str, places: int, is_home: bool = True) -> None:
        """Where people wait who have no place on a machine, ask for that of somebody whose turn is over."""
        first = sa.select(Job).where(Job.state == "queued", Job.kind.in_(kinds), turn_of(kinds) == 0)
        if not is_home:
            first = first.where(Job.travels)
        with self._database.transaction() as session:
            waiting = session.scalars(first).all()
            if not waiting:
                return
            moment, running = self._database.moment(session), running_on(session, kinds, machine)
            chosen = choose_to_rest(running, waiting, places, moment, resting=RESTING)
            if chosen is not None:
                session.execute(sa.update(Job).where(Job.id == chosen.id, Job.state == "running").values(asked=moment))

    def take(
        self, slot: Slot, kinds: tuple[str, ...], *, owner: str, machine: str, places: int, is_home: bool
    ) -> Job | None:
        """The next job for a place of a machine; where all are taken, have somebody rest for who waits."""
        job = None
        if not self._has_waiting(kinds, is_home=is_home):  # nearly always, and asked twice a second
            return None
        if self.has_room(kinds_of(slot), machine=machine, places=places):
            job = self.claim(kinds, owner=owner, machine=machine, is_home=is_home)
        if job is None:
            self.make_room(kinds, machine=machine, places=places, is_home=is_home)
        return job

    def listen(self) -> None:
        """Return when there is a newer job for other machines than before, or after some seconds."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            with self._database.asking() as connection:
                before, self._heard = self._heard, connection.scalar(_NEWEST)
            if self._heard not in (None, before):
                return
            time.sleep(GLANCE)

    def _has_waiting(self, kinds: tuple[str, ...], *, is_home: bool) -> bool:
        with self._database.asking() as connection:
            return connection.scalar(_waiting(kinds, is_home=is_home)) is not None

    def claim(self, kinds: tuple[str, ...], *, owner: str, machine: str = "", is_home: bool = True) -> Job | None:
        """Take the next queued job of these kinds, or None; away from home one that travels.

        Whose turn it is says `racecraft.serve.jobs.turns`.

        A run is changed by one machine at a time, which has its newest files.
        """
        other = aliased(Job)
        is_away = sa.exists().where(
            other.user_id == Job.user_id,
            other.run == Job.run,
            other.state == "running",
            other.machine != machine,
            other.travels,
            other.kind.in_(WRITERS),
        )
        is_free = sa.or_(Job.kind.not_in(WRITERS), ~is_away)
        oldest = sa.select(Job.id).where(Job.state == "queued", Job.kind.in_(kinds), is_free)
        if not is_home:
            oldest = oldest.where(Job.travels)
        with self._database.transaction() as session:
            moment = self._database.moment(session)
            # of two that ask at once the second gets the next one; SQLite has one writer at a time
            oldest = oldest.order_by(*turn_order(kinds, moment)).limit(1).with_for_update(skip_locked=True)
            job_id = session.scalar(oldest)
            taken = sa.update(Job).where(Job.id == job_id, Job.state == "queued")
            taken = taken.values(
                state="running",
                owner=owner,
                machine=machine,
                attempts=Job.attempts + 1,
                lease_until=moment + FIRST_LEASE,
                started=sa.func.coalesce(Job.started, moment),
                held_since=moment,
                asked=None,
            )
            if job_id is None or session.execute(taken).rowcount != 1:  # type: ignore[attr-defined]
                return None
            session.expire_all()
            return session.get_one(Job, job_id)

    def heartbeat(self, job_id: str, *, owner: str, has_progressed: bool = False) -> Answer:
        """Keep a job, and hear whether to go on."""
        kept = sa.update(Job).where(Job.id == job_id, Job.owner == owner, Job.state == "running")
        told = sa.select(Job.is_cancelled, Job.watched_until, Job.asked, Job.kind).where(Job.id == job_id)
        with self._database.transaction() as session:
            moment = self._database.moment(session)
            kept = kept.values(lease_until=moment + LEASE, **({"losses": 0} if has_progressed else {}))
            if session.execute(kept).rowcount != 1:  # type: ignore[attr-defined]
                return Answer("lost")
            is_cancelled, watched_until, asked, kind = session.execute(told).one()
            is_to_rest = asked is not None and kind in RESTING
            word: Literal["stop", "rest", "go on"] = "stop" if is_cancelled else "rest" if is_to_rest else "go on"
            return Answer(word, watched_until is not None and watched_until > moment)

    def finish(
        self,
        job_id: str,
        *,
        owner: str,
        state: str,
        result: Mapping[str, Any] | None = None,
        error: Mapping[str, Any] | None = None,
    ) -> bool:
        """End a job that this owner holds; False when it is another's now.

        Raises:
            RunError: What came of it cannot be kept.
        """
        for told in (result, error):
            check_outcome(told)
        ended = sa.update(Job).where(Job.id == job_id, Job.owner == owner, Job.state == "running")
        with self._database.transaction() as session:
            moment, job = self._database.moment(session), session.get(Job, job_id)
            if job is None:
                return False
            ended = ended.values(
                state=state,
                result=None if result is None else dict(result),
                error=None if error is None else dict(error),
                finished=moment,
                lease_until=None,
                **_let_go(job, moment),
            )
            if session.execute(ended).rowcount != 1:  # type: ignore[attr-defined]
                return False
            if state == "done" and job.kind in KINDS and KINDS[job.kind].counts:
                function_named(KINDS[job.kind].counts)(session, job_id, dict(result or {}))
            return True

    def cancel(self, job_id: str) -> None:
        """Ask for a job's end: a queued one ends at once, a running one when its worker hears of it."""
        with self._database.transaction() as session:
            session.execute(sa.update(Job).where(Job.id == job_id).values(is_cancelled=True))
            waiting = sa.update(Job).where(Job.id == job_id, Job.state == "queued")
            session.execute(waiting.values(state="cancelled", finished=self._database.moment(session)))

    def hand_back(self, owner: str) -> None:
        """Put back what an owner was asked to let go of; that is no fault of the job's."""
        self._take_back(Job.owner == owner)

    def release(self, owner: str, *, has_company: bool = False) -> None:
        """Put back what an owner holds that has ended without a word; given up after so many losses."""
        self._take_back(Job.owner == owner, limit=MAX_DEATHS if has_company else MAX_LOSSES)

    def take_back_expired(self) -> None:
        """Put back what nobody keeps alive."""
        with self._database.transaction() as session:
            moment = self._database.moment(session)
        self._take_back(Job.lease_until < moment, limit=MAX_DEATHS)

    def _take_back(self, condition: sa.ColumnElement[bool], *, limit: int = 0) -> None:
        gone = {"code": "WorkerLost", "message": f"The job's process died {limit} times.", "hint": ""}
        with self._database.transaction() as session:
            moment = self._database.moment(session)
            for job in session.scalars(sa.select(Job).where(Job.state == "running", condition)).all():
                values: dict[str, Any] = {"lease_until": None, **_let_go(job, moment)}
                if job.is_cancelled:
                    values |= {"state": "cancelled", "finished": moment}
                elif limit and job.losses >= limit - 1:
                    values |= {"state": "failed", "error": gone, "finished": moment}
                else:
                    values |= {"state": "queued", "owner": "", "losses": job.losses + int(limit > 0)}
                    if job.asked is not None:  # what was lost or stopped with the server keeps its turn
                        values["rested"] = moment
                is_it = sa.and_(Job.id == job.id, Job.owner == job.owner, Job.state == "running", condition)
                session.execute(sa.update(Job).where(is_it).values(values))


_NEWEST: Final = sa.select(Job.id).where(Job.state == "queued", Job.travels).order_by(Job.created.desc()).limit(1)


@cache  # as it is asked all the time
def _waiting(kinds: tuple[str, ...], *, is_home: bool) -> sa.Select[str]:
    query = sa.select(Job.id).where(Job.state == "queued", Job.kind.in_(kinds)).limit(1)
    return query if is_home else query.where(Job.travels)


def _let_go(job: Job, moment: datetime) -> dict[str, Any]:
    """What a job's row says from now on of the place that it had."""
    held = (moment - job.held_since).total_seconds() if job.held_since is not None else 0.0
    return {"held_since": None, "asked": None, "used": job.used + max(0.0, held)}


def kinds_of(slot: Slot) -> tuple[str, ...]:
    """The kinds that take such a place."""
    return tuple(name for name, kind in KINDS.items() if kind.slot == slot)
