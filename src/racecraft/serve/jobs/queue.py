"""The queue of jobs: claimed under a lease, kept alive by heartbeats, taken over when the worker is gone.

    queued ──claim──▶ running ──finish──▶ done | failed | cancelled
       ▲                 │ lease ran out (killed, machine off), or handed back (the server is stopped)
       └─────────────────┘ again, unless it was lost `MAX_LOSSES` times in a row without having got any further

Every step is one UPDATE whose WHERE says what it relies on, so two servers or workers never own a job together.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final, Literal

import sqlalchemy as sa

from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, now

Slot = Literal["training", "other"]


@dataclass(frozen=True, kw_only=True)
class JobKind:
    """What the queue and the supervisor have to know about jobs of a kind."""

    slot: Slot
    """Which of the console's places it takes; `ServeSettings` says how many there are."""
    work: str
    """``module:function``, imported only where it runs; it takes a `Task` and returns the job's result as JSON.

    A job may be started again at any moment, so the function goes on where it was, or finds that all is done.
    """
    progress: str = "{run}/checkpoints/manifest.json"
    """File below the runs folder that changes whenever something is kept for good."""


KINDS: Final[Mapping[str, JobKind]] = {
    "train": JobKind(slot="training", work="racecraft.serve.models.tasks:train"),
    "tune": JobKind(
        slot="training", work="racecraft.serve.tuning.tasks:tune", progress=".racecraft/tunings/{tuning}/result.json"
    ),
    "evaluate": JobKind(slot="other", work="racecraft.serve.evaluations.tasks:evaluate"),
    "race": JobKind(slot="other", work="racecraft.serve.races.tasks:race"),
    "store": JobKind(slot="other", work="racecraft.serve.models.tasks:store"),
}


LEASE: Final = timedelta(seconds=20)
"""How long a job without a heartbeat still counts as running."""
FIRST_LEASE: Final = timedelta(seconds=180)
"""The same before the first heartbeat: a busy machine takes its time to start a process; a dead one is seen anyway."""
MAX_LOSSES: Final = 5
"""How often a job's process may die before it is given up: it may be what kills it. Progress makes up for losses."""
ENDED: Final = ("done", "failed", "cancelled")


def new_job(kind: str, run: str, payload: Mapping[str, Any]) -> Job:
    """A job that is at the end of the queue once a session adds it."""
    return Job(id=secrets.token_hex(8), kind=kind, run=run, payload=dict(payload))


class JobQueue:
    """The jobs of a console's database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, kind: str, run: str, payload: Mapping[str, Any]) -> Job:
        """Put a job at the end of the queue."""
        job = new_job(kind, run, payload)
        with self._database.transaction() as session:
            session.add(job)
        return job

    def get(self, job_id: str) -> Job | None:
        """A job by its id."""
        with self._database.transaction() as session:
            return session.get(Job, job_id)

    def list(self, *, run: str | None = None, kind: str | None = None, limit: int = 200) -> list[Job]:
        """Jobs, newest first."""
        query = sa.select(Job).order_by(Job.created.desc()).limit(limit)
        if kind is not None:
            query = query.where(Job.kind == kind)
        if run is not None:
            query = query.where(Job.run == run)
        with self._database.transaction() as session:
            return list(session.scalars(query))

    def active(self, run: str) -> Job | None:
        """The training of a run that is queued or running."""
        query = sa.select(Job).where(Job.run == run, Job.kind == "train", Job.state.in_(("queued", "running")))
        with self._database.transaction() as session:
            return session.scalars(query).first()

    def is_busy(self, run: str) -> bool:
        """Whether a job about this run is queued or running."""
        query = sa.select(Job.id).where(Job.run == run, Job.state.in_(("queued", "running"))).limit(1)
        with self._database.transaction() as session:
            return session.scalar(query) is not None

    def before(self, job: Job) -> Sequence[str]:
        """Runs whose jobs have the places it waits for, or come first; nothing once it is no longer queued."""
        if job.state != "queued":
            return []
        is_earlier = sa.or_(Job.state == "running", sa.and_(Job.state == "queued", Job.created < job.created))
        query = sa.select(Job.run).where(Job.kind.in_(kinds_of(KINDS[job.kind].slot)), is_earlier).order_by(Job.created)
        with self._database.transaction() as session:
            return session.scalars(query).all()

    def num_running(self, kinds: tuple[str, ...]) -> int:
        """How many jobs of these kinds run, whoever started them."""
        query = sa.select(sa.func.count()).where(Job.state == "running", Job.kind.in_(kinds))
        with self._database.transaction() as session:
            return session.scalar(query) or 0

    def claim(self, kinds: tuple[str, ...], *, owner: str) -> Job | None:
        """Take the oldest queued job of these kinds, or None."""
        oldest = (
            sa.select(Job.id).where(Job.state == "queued", Job.kind.in_(kinds)).order_by(Job.created, Job.id).limit(1)
        )
        moment = now()
        with self._database.transaction() as session:
            job_id = session.scalar(oldest)
            taken = sa.update(Job).where(Job.id == job_id, Job.state == "queued")
            taken = taken.values(
                state="running",
                owner=owner,
                attempts=Job.attempts + 1,
                lease_until=moment + FIRST_LEASE,
                started=sa.func.coalesce(Job.started, moment),
            )
            if job_id is None or session.execute(taken).rowcount != 1:  # type: ignore[attr-defined]
                return None
            session.expire_all()
            return session.get_one(Job, job_id)

    def heartbeat(self, job_id: str, *, owner: str, has_progressed: bool = False) -> str:
        """Keep a job: ``go on``, ``stop`` when somebody cancelled it, or ``lost`` when it is another's now."""
        kept = sa.update(Job).where(Job.id == job_id, Job.owner == owner, Job.state == "running")
        kept = kept.values(lease_until=now() + LEASE, **({"losses": 0} if has_progressed else {}))
        with self._database.transaction() as session:
            if session.execute(kept).rowcount != 1:  # type: ignore[attr-defined]
                return "lost"
            return "stop" if session.scalar(sa.select(Job.is_cancelled).where(Job.id == job_id)) else "go on"

    def finish(
        self,
        job_id: str,
        *,
        owner: str,
        state: str,
        result: Mapping[str, Any] | None = None,
        error: Mapping[str, Any] | None = None,
    ) -> bool:
        """End a job that this owner holds; False when it is another's now."""
        ended = sa.update(Job).where(Job.id == job_id, Job.owner == owner, Job.state == "running")
        ended = ended.values(
            state=state,
            result=None if result is None else dict(result),
            error=None if error is None else dict(error),
            finished=now(),
            lease_until=None,
        )
        with self._database.transaction() as session:
            return session.execute(ended).rowcount == 1  # type: ignore[attr-defined, no-any-return]

    def cancel(self, job_id: str) -> None:
        """Ask for a job's end: a queued one ends at once, a running one when its worker hears of it."""
        with self._database.transaction() as session:
            session.execute(sa.update(Job).where(Job.id == job_id).values(is_cancelled=True))
            waiting = sa.update(Job).where(Job.id == job_id, Job.state == "queued")
            session.execute(waiting.values(state="cancelled", finished=now()))

    def hand_back(self, owner: str) -> None:
        """Put back what an owner was asked to let go of; that is no fault of the job's."""
        self._take_back(Job.owner == owner, is_lost=False)

    def release(self, owner: str) -> None:
        """Put back what an owner holds that has ended without a word."""
        self._take_back(Job.owner == owner)

    def take_back_expired(self) -> None:
        """Put back what nobody keeps alive."""
        self._take_back(Job.lease_until < now())

    def _take_back(self, condition: sa.ColumnElement[bool], *, is_lost: bool = True) -> None:
        held = sa.update(Job).where(Job.state == "running", condition)
        gone = {"code": "WorkerLost", "message": f"The job's process died {MAX_LOSSES} times.", "hint": ""}
        with self._database.transaction() as session:
            session.execute(held.where(Job.is_cancelled).values(state="cancelled", finished=now(), lease_until=None))
            if is_lost:
                tired = held.where(Job.losses >= MAX_LOSSES - 1)
                session.execute(tired.values(state="failed", error=gone, finished=now(), lease_until=None))
            session.execute(held.values(state="queued", owner="", lease_until=None, losses=Job.losses + int(is_lost)))


def kinds_of(slot: Slot) -> tuple[str, ...]:
    """The kinds that take such a place."""
    return tuple(name for name, kind in KINDS.items() if kind.slot == slot)
