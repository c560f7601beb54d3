"""How much of the machine a racer may use, and all racers of a group together.

    person ──▶ each racer of their group ──▶ everybody ──▶ DEFAULT      the first of these that has a number counts
    group, together                                                     besides

Their group is the one by which they came in: whoever organises another one gives and takes nothing. Of who belongs to
none, all groups that they are in count, of which the most generous one is enough.

Minutes are of training, in the last 24 hours; models are those in the garage; places are jobs that wait or run, without
submissions, which races limit. Organisers and admins are not limited. Being over a limit takes nothing away but time:
what is trained is saved, and goes on when there are minutes again.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Collection, Iterable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, fields, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final, Literal
from weakref import WeakValueDictionary

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from racecraft.run import list_runs
from racecraft.serve.jobs.queue import KINDS, kinds_of
from racecraft.serve.problems import Conflict
from racecraft.serve.settings import OWNER, runs_of
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, Member, Quota, User

Scope = Literal["everybody", "group", "each", "person"]
WHOLE: Final = 0
"""The number that goes with the scope ``everybody``."""
DAY: Final = timedelta(days=1)
UNCOUNTED: Final = ("judge", "final", "store")
"""Jobs that are limited otherwise, or nobody asked for."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """So much may be used; None where a scope says nothing."""

    minutes: int | None = None
    models: int | None = None
    places: int | None = None


@dataclass(frozen=True, kw_only=True)
class Usage:
    """So much is used."""

    minutes: float
    models: int
    places: int


DEFAULT: Final = Limits(models=200, places=50)
"""Of a racer, where nobody has said anything: so that a slip does not fill the disk."""
WORDS: Final = {"minutes": "minutes of training a day", "models": "models", "places": "jobs at once"}
HINTS: Final = {
    "minutes": "What you trained yesterday comes back hour by hour; whoever organises your group can give you more.",
    "models": "Delete some that you no longer need.",
    "places": "Wait for one of them, or stop it.",
}


class Quotas:
    """Everybody's.

    Args:
        database: Where they and the jobs are.
        runs: Folder of the owner's runs; those of others lie within.
    """

    def __init__(self, database: Database, runs: Path) -> None:
        self._database, self._runs = database, runs
        self._turns: WeakValueDictionary[tuple[Scope, int], asyncio.Lock] = WeakValueDictionary()

    @asynccontextmanager
    async def turn(self, user_id: int) -> AsyncIterator[None]:
        """To be held from `require` until what it let through is there, so that two requests at once do not both fit.

        Somebody's requests follow one another, and those of all who share what a group may use together. Of the
        server's event loop: who waits for it takes no thread from who has it.
        """
        async with AsyncExitStack() as stack:
            # everybody takes one person's turn and then those of groups in their order, so that nobody waits in a ring
            await stack.enter_async_context(self._turn("person", user_id))
            for group in await asyncio.to_thread(self._shared, user_id):
                await stack.enter_async_context(self._turn("group", group))
            yield

    def _turn(self, scope: Scope, number: int) -> asyncio.Lock:
        turn = self._turns.get((scope, number))
        if turn is None:
            turn = self._turns[scope, number] = asyncio.Lock()
        return turn

    def _shared(self, user_id: int) -> list[int]:
        """The groups of somebody that are limited together."""
        limited = sa.select(Quota.number).where(Quota.scope == "group")
        with self._database.transaction() as session:
            together = set(session.scalars(limited))
            return [group for group in _groups(session, user_id) if group in together]

    def said(self, scope: Scope, number: int = WHOLE) -> Limits:
        """What was said of a scope itself."""
        with self._database.transaction() as session:
            return _said(session, scope, number)

    def say(self, scope: Scope, limits: Limits, number: int = WHOLE) -> None:
        """Say something else."""
        with self._database.transaction() as session:
            session.merge(Quota(scope=scope, number=number, **vars(limits)))

    def limits(self, user_id: int) -> Limits:
        """What somebody may use; nothing is limited for who is no racer."""
        with self._database.transaction() as session:
            return _limits(session, user_id)

    def usage(self, people: Collection[int]) -> Usage:
        """What some people use together."""
        with self._database.transaction() as session:
            return self._usage(session, people)

    def usage_together(self, group: int) -> Usage:
        """What those use whom a group's limit is for."""
        with self._database.transaction() as session:
            return self._usage(session, _racers(session, group))

    def require(self, user_id: int, *what: Literal["minutes", "models", "places"], count: int = 1) -> None:
        """Refuse what would be more than somebody, or their groups, may use.

        Args:
            user_id: Who.
            what: They are about to use.
            count: Models and places at once; of minutes there have to be some.

        Raises:
            Conflict: It would.
        """
        with self._database.transaction() as session:
            over = self._over(session, user_id, what, count)
        if over is not None:
            raise Conflict(*over[:1], hint=over[1])

    def end_what_is_over(self) -> None:
        """Stop the trainings of whoever has no minutes left; they are saved."""
        kinds = kinds_of("training")
        open_ = sa.select(Job.user_id).where(Job.kind.in_(kinds), Job.state.in_(("queued", "running"))).distinct()
        with self._database.transaction() as session:
            over = [user for user in session.scalars(open_) if self._over(session, user, ("minutes",)) is not None]
            theirs = sa.and_(Job.user_id.in_(over), Job.kind.in_(kinds))
            session.execute(sa.update(Job).where(theirs, Job.state == "running").values(is_cancelled=True))
            waiting = sa.update(Job).where(theirs, Job.state == "queued")
            moment = self._database.moment(session)
            session.execute(waiting.values(is_cancelled=True, state="cancelled", finished=moment))

    def _over(self, session: Session, user_id: int, what: Iterable[str], count: int = 1) -> tuple[str, str] | None:
        """A sentence and a hint about what is used up; None where nothing is."""
        own = _limits(session, user_id)
        if own == Limits():
            return None
        together = [(group, _said(session, "group", group)) for group in _groups(session, user_id)]
        for name in what:
            limit, more = getattr(own, name), count - 1 if name != "minutes" else 0
            if limit is not None and getattr(self._usage(session, [user_id]), name) + more >= limit:
                told = f"and this takes {count} more" if more else "and they are used up"
                return f"You have {limit} {WORDS[name]}, {told}.", HINTS[name]
            if together and all(self._is_used_up(session, group, name, limits, more) for group, limits in together):
                return f"All the {WORDS[name]} of your group are used up.", HINTS[name]
        return None

    def _is_used_up(self, session: Session, group: int, name: str, limits: Limits, more: int) -> bool:
        limit = getattr(limits, name)
        if limit is None:
            return False
        return bool(getattr(self._usage(session, _racers(session, group)), name) + more >= limit)

    def _usage(self, session: Session, people: Collection[int]) -> Usage:
        moment = self._database.moment(session)
        theirs = sa.select(Job.used, Job.held_since).where(Job.user_id.in_(people), Job.kind.in_(kinds_of("training")))
        since = theirs.where(sa.func.coalesce(Job.finished, moment) > moment - DAY)
        open_ = sa.select(sa.func.count()).where(Job.user_id.in_(people), Job.state.in_(("queued", "running")))
        counted = open_.where(Job.kind.in_([kind for kind in KINDS if kind not in UNCOUNTED]))
        return Usage(
            minutes=sum(_seconds(used, held, moment) for used, held in session.execute(since)) / 60.0,
            models=sum(len(list_runs(runs_of(self._runs, user))) for user in people),
            places=session.scalar(counted) or 0,
        )


def _limits(session: Session, user_id: int) -> Limits:
    user = session.get(User, user_id)
    if user_id == OWNER or user is None or user.role != "racer":
        return Limits()
    each = [_said(session, "each", group) for group in _groups(session, user_id)]
    found = _said(session, "person", user_id)
    for more in (_most(each), _said(session, "everybody", WHOLE), DEFAULT):
        blanks = [field.name for field in fields(Limits) if getattr(found, field.name) is None]
        found = replace(found, **{name: getattr(more, name) for name in blanks})
    return found


def _groups(session: Session, user_id: int) -> list[int]:
    """The groups whose word counts for somebody, by number."""
    theirs = sa.select(Member.group_id, Member.is_home).where(Member.user_id == user_id).order_by(Member.group_id)
    found = session.execute(theirs).all()
    return [group for group, is_home in found if is_home] or [group for group, _ in found]


def _racers(session: Session, group: int) -> Sequence[int]:
    """Those of a group for whom its word counts."""
    anywhere = aliased(Member)
    has_home = sa.exists().where(anywhere.user_id == Member.user_id, anywhere.is_home)
    racers = sa.select(Member.user_id).where(Member.group_id == group, Member.role == "racer")
    return session.scalars(racers.where(Member.is_home | ~has_home)).all()


def _said(session: Session, scope: Scope, number: int) -> Limits:
    row = session.get(Quota, (scope, number))
    return Limits() if row is None else Limits(minutes=row.minutes, models=row.models, places=row.places)


def _most(several: list[Limits]) -> Limits:
    """Of several groups: what the most generous one gives."""
    values = {
        field.name: max((n for one in several if (n := getattr(one, field.name)) is not None), default=None)
        for field in fields(Limits)
    }
    return Limits(**values)


def _seconds(used: float, held_since: datetime | None, moment: datetime) -> float:
    return used + (0.0 if held_since is None else max(0.0, (moment - held_since).total_seconds()))
