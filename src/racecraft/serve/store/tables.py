"""The console's tables: what a run folder does not say about itself. Times are UTC.

Run folders stay the truth about models; a row here can be lost and made again, but for jobs, races and tags.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, ClassVar

from sqlalchemy import JSON, BigInteger, DateTime, ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator


def now() -> datetime:
    """This moment in UTC."""
    return datetime.now(UTC)


class UtcTime(TypeDecorator[datetime]):
    """A moment that comes back with its zone, from SQLite too."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, dialect: object) -> datetime | None:
        """Give a bare time its zone."""
        return value.replace(tzinfo=UTC) if value is not None and value.tzinfo is None else value


class Table(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcTime(),
        dict[str, Any]: JSON,
        list[str]: JSON,
        list[list[int]]: JSON,
    }


class User(Table):
    """Somebody who may sign in; a console of one's own has one."""

    __tablename__ = "users"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64), unique=True)
    created: Mapped[datetime] = mapped_column(default=now)


class Session(Table):
    """A browser that came with the link; only a hash of its cookie is kept."""

    __tablename__ = "sessions"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    created: Mapped[datetime] = mapped_column(default=now)


class Model(Table):
    """What people say about a run, and a summary of its folder that is as old as its `fingerprint`."""

    __tablename__ = "models"

    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    owner_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    tags: Mapped[list[str]] = mapped_column(default=list)
    fingerprint: Mapped[str] = mapped_column(String(200), default="")
    summary: Mapped[dict[str, Any]] = mapped_column(default=dict)
    deleted: Mapped[datetime | None]


class Job(Table):
    """Work for a child process; see racecraft.serve.jobs.queue."""

    __tablename__ = "jobs"
    __table_args__ = (Index("jobs_by_state", "state", "created"), Index("jobs_by_kind", "kind", "run", "created"))

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    run: Mapped[str] = mapped_column(String(64), index=True)
    payload: Mapped[dict[str, Any]] = mapped_column(default=dict)
    state: Mapped[str] = mapped_column(String(16), default="queued")
    attempts: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0)
    owner: Mapped[str] = mapped_column(String(32), default="")
    lease_until: Mapped[datetime | None]
    is_cancelled: Mapped[bool] = mapped_column(default=False)
    travels: Mapped[bool] = mapped_column(default=False)
    """Whether what it needs is in the object store, so that any machine may do it."""
    machine: Mapped[str] = mapped_column(String(64), default="")
    """Where it runs, or ran last."""
    watched_until: Mapped[datetime | None]
    """Until when the machine that does it is to show its cars in the object store."""
    result: Mapped[dict[str, Any] | None] = mapped_column(JSON)
    error: Mapped[dict[str, Any] | None] = mapped_column(JSON)
    created: Mapped[datetime] = mapped_column(default=now)
    started: Mapped[datetime | None]
    finished: Mapped[datetime | None]


class Race(Table):
    """A race that models are entered in."""

    __tablename__ = "races"

    id: Mapped[int] = mapped_column(primary_key=True)
    owner_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    title: Mapped[str] = mapped_column(String(100))
    description: Mapped[str] = mapped_column(String(500), default="")
    visibility: Mapped[str] = mapped_column(String(16), default="private")
    """Who sees it once there are accounts: ``private``, ``unlisted`` or ``public``."""
    kind: Mapped[str] = mapped_column(String(24), default="time-trial")
    track: Mapped[str] = mapped_column(String(200))
    rules: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """As `racecraft.race.RaceRules.to_dict` gives them."""
    objects: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """As `racecraft.sim.Objects.to_dict` gives them."""
    vehicle: Mapped[str] = mapped_column(String(16), default="")
    """The same for all; of an old race empty for the one that each model was trained with."""
    seed: Mapped[int] = mapped_column(BigInteger, default=0)
    """Of a race whose starts everybody may know."""
    ranking: Mapped[str] = mapped_column(String(16))
    minimum_laps: Mapped[int] = mapped_column(default=1)
    trials: Mapped[int] = mapped_column(default=1)
    """Of each entry."""
    document: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """As announced, see `racecraft.race.announcement`; empty of an old race, which nobody announced."""
    commitment: Mapped[str] = mapped_column(String(64), default="")
    """Published from the beginning; empty of an old race."""
    secret: Mapped[str] = mapped_column(String(64), default="")
    """Hexadecimal, published when the race is over; empty where everybody knows the seed."""
    opens: Mapped[datetime] = mapped_column(default=now)
    closes: Mapped[datetime | None]
    created: Mapped[datetime] = mapped_column(default=now)
    deleted: Mapped[datetime | None]


class Entry(Table):
    """A model's attempt at a race; its job says how it went."""

    __tablename__ = "entries"
    __table_args__ = (UniqueConstraint("race_id", "job_id"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    race_id: Mapped[int] = mapped_column(ForeignKey("races.id"), index=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    run: Mapped[str] = mapped_column(String(64))
    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id"))
    created: Mapped[datetime] = mapped_column(default=now)
    withdrawn: Mapped[datetime | None]


class DrivenRecord(Table):
    """Somebody's fastest lap by hand on a track, which is known by its geometry's digest."""

    __tablename__ = "driven_records"
    __table_args__ = (UniqueConstraint("user_id", "digest", "vehicle", "direction"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    digest: Mapped[str] = mapped_column(String(64))
    vehicle: Mapped[str] = mapped_column(String(16))
    direction: Mapped[str] = mapped_column(String(16))
    track: Mapped[str] = mapped_column(String(200))
    seconds: Mapped[float]
    trace: Mapped[list[list[int]]]
    """x, y, heading of every step, in whole mm and mrad."""
    driven: Mapped[datetime] = mapped_column(default=now)
