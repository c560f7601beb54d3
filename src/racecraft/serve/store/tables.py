"""The console's tables: what a run folder does not say about itself. Times are UTC.

Run folders stay the truth about models; a row here can be lost and made again, but for jobs, races and tags.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, ClassVar

from sqlalchemy import JSON, BigInteger, DateTime, ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

from racecraft.serve.settings import OWNER


def now() -> datetime:
    """This moment in UTC."""
    return datetime.now(UTC)


class UtcTime(TypeDecorator[datetime]):
    """A moment in UTC, whatever zone it was told in: SQLite keeps none, and PostgreSQL gives it in its server's."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: object) -> datetime | None:
        """Tell the database the moment in UTC; a bare time is."""
        return _in_utc(value)

    def process_result_value(self, value: datetime | None, dialect: object) -> datetime | None:
        """Give a bare time its zone, and a moment of another one this."""
        return _in_utc(value)


def _in_utc(value: datetime | None) -> datetime | None:
    if value is None or value.tzinfo is UTC:
        return value
    return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


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
    """As everybody sees it."""
    handle: Mapped[str | None] = mapped_column(String(200), unique=True)
    """The name as `racecraft.serve.people.names.handle_of` folds it, so that no two look alike; None once deleted."""
    is_moderated: Mapped[bool] = mapped_column(default=False)
    """Whether an organiser gave them their name, which they do not change any more."""
    role: Mapped[str] = mapped_column(String(16), default="racer")
    """``admin``, ``organiser`` or ``racer``."""
    password: Mapped[str] = mapped_column(String(200), default="")
    """Its hash; empty for who comes by card."""
    is_locked: Mapped[bool] = mapped_column(default=False)
    """Whether they were locked out, and are not let in by their password."""
    created: Mapped[datetime] = mapped_column(default=now)
    deleted: Mapped[datetime | None]


class Session(Table):
    """A browser that was let in; only a hash of its cookie is kept."""

    __tablename__ = "sessions"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    created: Mapped[datetime] = mapped_column(default=now)
    expires: Mapped[datetime | None]
    """None of a console that has no accounts."""
    provider_session: Mapped[str | None] = mapped_column(String(255))
    """Of one that came through a provider, that one's name for the sign-in there, empty if it has none; else None."""


class Card(Table):
    """A printed card that signs somebody in, as often as it is shown; only a hash of its secret is kept."""

    __tablename__ = "cards"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    created: Mapped[datetime] = mapped_column(default=now)


class Token(Table):
    """What a program signs in with; only its hash is kept."""

    __tablename__ = "tokens"

    id: Mapped[int] = mapped_column(primary_key=True)
    digest: Mapped[str] = mapped_column(String(64), unique=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    title: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[list[str]] = mapped_column(default=list)
    created: Mapped[datetime] = mapped_column(default=now)
    expires: Mapped[datetime]


class Reset(Table):
    """A link by which somebody gives themselves a new password, once; only a hash of its secret is kept."""

    __tablename__ = "resets"

    digest: Mapped[str] = mapped_column(String(64), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    created: Mapped[datetime] = mapped_column(default=now)
    expires: Mapped[datetime]


class Identity(Table):
    """By whom somebody is known at a school's or company's provider; never by an e-mail address."""

    __tablename__ = "identities"
    __table_args__ = (UniqueConstraint("issuer", "subject"), UniqueConstraint("user_id", "issuer"))

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    issuer: Mapped[str] = mapped_column(String(255))
    """The provider's name."""
    subject: Mapped[str] = mapped_column(String(255))
    """Its name for them, which never changes."""
    is_locked: Mapped[bool] = mapped_column(default=False)
    """Whether they were locked out, and are not let in by it."""
    created: Mapped[datetime] = mapped_column(default=now)


class Group(Table):
    """A class, a club, an event."""

    __tablename__ = "groups"

    id: Mapped[int] = mapped_column(primary_key=True)
    title: Mapped[str] = mapped_column(String(100))
    created: Mapped[datetime] = mapped_column(default=now)
    closed: Mapped[datetime | None]
    """Since when nobody comes in and no race is made; all that is there stays."""


class Member(Table):
    """Somebody in a group."""

    __tablename__ = "members"

    group_id: Mapped[int] = mapped_column(ForeignKey("groups.id"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), primary_key=True, index=True)
    role: Mapped[str] = mapped_column(String(16), default="racer")
    """``organiser`` or ``racer``."""
    real_name: Mapped[str] = mapped_column(String(100), default="")
    """For the organisers only."""
    is_home: Mapped[bool] = mapped_column(default=False)
    """Whether they came in here: its organisers print their cards, name them, and look at what they made."""
    created: Mapped[datetime] = mapped_column(default=now)


class Invitation(Table):
    """A code that makes accounts: of a group's members, or of an organiser."""

    __tablename__ = "invitations"

    id: Mapped[int] = mapped_column(primary_key=True)
    code: Mapped[str] = mapped_column(String(32), unique=True)
    group_id: Mapped[int | None] = mapped_column(ForeignKey("groups.id"), index=True)
    role: Mapped[str] = mapped_column(String(16))
    uses_left: Mapped[int]
    created: Mapped[datetime] = mapped_column(default=now)
    expires: Mapped[datetime]


class Deed(Table):
    """Something that somebody did with power, or how somebody came in; see racecraft.serve.audit."""

    __tablename__ = "deeds"

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int | None] = mapped_column(ForeignKey("users.id"), index=True)
    """None of who did not get in, under no name that there is."""
    what: Mapped[str] = mapped_column(String(64))
    target: Mapped[str] = mapped_column(String(200))
    details: Mapped[dict[str, Any]] = mapped_column(default=dict)
    is_done: Mapped[bool] = mapped_column(default=False)
    created: Mapped[datetime] = mapped_column(default=now)


class Model(Table):
    """What people say about a run, and a summary of its folder that is as old as its `fingerprint`."""

    __tablename__ = "models"

    owner_id: Mapped[int] = mapped_column(ForeignKey("users.id"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    tags: Mapped[list[str]] = mapped_column(default=list)
    fingerprint: Mapped[str] = mapped_column(String(200), default="")
    summary: Mapped[dict[str, Any]] = mapped_column(default=dict)
    deleted: Mapped[datetime | None]


class Comment(Table):
    """What an organiser has said about a racer's model."""

    __tablename__ = "comments"

    id: Mapped[int] = mapped_column(primary_key=True)
    owner_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    """Whose model it is."""
    model: Mapped[str] = mapped_column(String(64))
    author_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    text: Mapped[str] = mapped_column(String(1000))
    created: Mapped[datetime] = mapped_column(default=now)


class Job(Table):
    """Work for a child process; see racecraft.serve.jobs.queue."""

    __tablename__ = "jobs"
    __table_args__ = (
        Index("jobs_by_state", "state", "created"),
        Index("jobs_by_kind", "kind", "run", "created"),
        Index("jobs_by_user", "user_id", "state", "created"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    run: Mapped[str] = mapped_column(String(64), index=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), default=OWNER)
    """Whose it is, and in whose folder its run lies."""
    payload: Mapped[dict[str, Any]] = mapped_column(default=dict)
    state: Mapped[str] = mapped_column(String(16), default="queued")
    attempts: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0)
    owner: Mapped[str] = mapped_column(String(32), default="")
    """The worker that has it."""
    lease_until: Mapped[datetime | None]
    is_cancelled: Mapped[bool] = mapped_column(default=False)
    travels: Mapped[bool] = mapped_column(default=False)
    """Whether what it needs is in the object store, so that any machine may do it."""
    cargo: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """What the store has for it, see `racecraft.serve.jobs.cargo`."""
    machine: Mapped[str] = mapped_column(String(64), default="")
    """Where it runs, or ran last."""
    held_since: Mapped[datetime | None]
    """When it got the place that it has."""
    rested: Mapped[datetime | None]
    """When it last gave one up because others waited."""
    asked: Mapped[datetime | None]
    """Since when others wait for its place."""
    used: Mapped[float] = mapped_column(default=0.0)
    """Seconds for which it had places, without the one that it has now."""
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
    group_id: Mapped[int | None] = mapped_column(ForeignKey("groups.id"), index=True)
    """Of a league's race, which is entered by submissions; None for a race of one's own models."""
    title: Mapped[str] = mapped_column(String(100))
    description: Mapped[str] = mapped_column(String(500), default="")
    visibility: Mapped[str] = mapped_column(String(16), default="private")
    """``public`` where the board of a league's race is shown to everybody, without an account."""
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
    attempts_per_day: Mapped[int] = mapped_column(default=0)
    """Of each person; 0 for as many as they like."""
    is_frozen: Mapped[bool] = mapped_column(default=False)
    """Whether nobody may enter for the time being."""
    after_id: Mapped[int | None] = mapped_column(ForeignKey("races.id"))
    """The race that this one follows: qualifying before a final."""
    best_of_it: Mapped[int] = mapped_column(default=0)
    """How many of the first of that race may enter this one."""
    final_job_id: Mapped[str | None] = mapped_column(ForeignKey("jobs.id"))
    """What drives the duels of a final, once its organiser has begun it."""
    last_places: Mapped[dict[str, int] | None] = mapped_column(JSON)
    """Of a final that is driven once more, what a season counts until there are new ones; by submission."""
    opens: Mapped[datetime] = mapped_column(default=now)
    closes: Mapped[datetime | None]
    over: Mapped[datetime | None]
    """Since when people were told that a league's race is over: it stays so, though a clock be set back."""
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


class Submission(Table):
    """Somebody's attempt at a league's race: a file of weights, judged by its job."""

    __tablename__ = "submissions"
    __table_args__ = (
        UniqueConstraint("race_id", "digest"),
        Index("submissions_by_score", "race_id", "score_ms", "best_lap_ms", "resets"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    race_id: Mapped[int] = mapped_column(ForeignKey("races.id"), index=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id"), index=True)
    digest: Mapped[str] = mapped_column(String(64))
    """SHA-256 of what drives, whatever it was called."""
    model: Mapped[str] = mapped_column(String(64))
    """What its owner calls it, or who organises the race."""
    is_moderated: Mapped[bool] = mapped_column(default=False)
    """Whether it is the latter, which its owner does not change any more."""
    score_ms: Mapped[int | None]
    """None until it is judged, and for one that did not complete enough laps."""
    best_lap_ms: Mapped[int | None]
    resets: Mapped[int] = mapped_column(default=0)
    completion: Mapped[float] = mapped_column(default=0.0)
    judged: Mapped[datetime | None]
    """None for one that waits, is driven or failed: it is not on the board."""
    disqualified: Mapped[str] = mapped_column(String(200), default="")
    """The reason; empty for who is in the race."""
    created: Mapped[datetime] = mapped_column(default=now)


class Choices(Table):
    """What a submission's driver chooses on its race's hidden frames, and whose earlier entry that is like."""

    __tablename__ = "choices"

    submission_id: Mapped[int] = mapped_column(ForeignKey("submissions.id"), primary_key=True)
    commands: Mapped[str] = mapped_column(String(2000))
    """Base64 of little-endian 16-bit integers: steering angle in mrad and speed in mm/s on one frame after another."""
    like_id: Mapped[int | None] = mapped_column(ForeignKey("submissions.id"))
    """The earliest submission that drives like it, where that is somebody else's."""
    likeness: Mapped[float] = mapped_column(default=0.0)
    """To that one, see racecraft.race.likeness."""
    is_accepted: Mapped[bool] = mapped_column(default=False)
    """Whether a person has looked at it and let it stand."""


class Finalist(Table):
    """Who drives in a final in which two meet at a time, with what they qualified with."""

    __tablename__ = "finalists"

    race_id: Mapped[int] = mapped_column(ForeignKey("races.id"), primary_key=True)
    seed: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """From 1, the best in qualifying."""
    submission_id: Mapped[int] = mapped_column(ForeignKey("submissions.id"))
    """To the race that it follows."""
    place: Mapped[int | None]
    """From 1, once all duels are decided."""


class Duel(Table):
    """Two finalists who met; see racecraft.contest.finals."""

    __tablename__ = "duels"

    race_id: Mapped[int] = mapped_column(ForeignKey("races.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """From 0, in the order in which they are driven."""
    first: Mapped[int]
    """Seed of the better one."""
    second: Mapped[int]
    winner: Mapped[int]
    """Its seed."""
    results: Mapped[dict[str, Any]]
    """By seed, what the duel was decided by: racecraft.contest.classification.Standing.in_whole_ms."""


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


class Quota(Table):
    """What somebody, or several people, may use of the machine; see racecraft.serve.quotas."""

    __tablename__ = "quotas"

    scope: Mapped[str] = mapped_column(String(16), primary_key=True)
    """``everybody``, ``group`` (all its racers together), ``each`` (each of its racers) or ``person``."""
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Of the group or the person; 0 for everybody."""
    minutes: Mapped[int | None]
    models: Mapped[int | None]
    places: Mapped[int | None]


class StudiedLesson(Table):
    """How far somebody is in a lesson of the course."""

    __tablename__ = "studied_lessons"

    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), primary_key=True)
    lesson: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Its number."""
    read: Mapped[datetime | None]
    """When they came to its end for the first time."""
    quiz: Mapped[float | None]
    """Best share of right answers."""
