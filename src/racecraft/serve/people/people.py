"""Accounts: made, renamed, given a password, removed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, aliased

from racecraft.serve.people.keys import hold_account, require_still_in, revoke_all
from racecraft.serve.people.names import checked_name, gone_name, handle_of, is_gone_name
from racecraft.serve.people.passwords import hash_password, is_password
from racecraft.serve.problems import Conflict, NotFound, NotLetIn
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import LOCAL_USER, Database
from racecraft.serve.store.tables import (
    Card,
    Comment,
    Invitation,
    Job,
    Member,
    Quota,
    StudiedLesson,
    Submission,
    User,
    now,
)

Role = Literal["admin", "organiser", "racer"]


@dataclass(frozen=True)
class Person:
    """Somebody, as the rest of the server knows them."""

    id: int
    name: str
    role: Role
    has_password: bool

    @property
    def may_organise(self) -> bool:
        """Whether they may make groups."""
        return self.role in ("admin", "organiser")


class People:
    """Everybody who has an account."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, user_id: int) -> Person:
        """Somebody.

        Raises:
            NotFound: There is nobody of this number.
        """
        with self._database.transaction() as session:
            user = session.get(User, user_id)
            if user is None or user.deleted is not None:
                raise NotFound(f"There is nobody with the number {user_id}.")
            return _person(user)

    def named(self, name: str) -> Person:
        """Somebody by the name that everybody sees.

        Raises:
            NotFound: There is nobody of this name.
        """
        query = sa.select(User).where(User.handle == handle_of(name), User.deleted.is_(None))
        with self._database.transaction() as session:
            user = session.scalars(query).first()
            if user is None:
                raise NotFound(f"There is nobody called {name[:64]!r}.")
            return _person(user)

    def rename(self, user_id: int, name: str, *, by_organiser: bool = False) -> None:
        """Another name; one that an organiser gave is only changed by an organiser.

        Raises:
            Conflict: It is taken, or looks like one that is; or the one that there is stays.
        """
        with self._database.transaction() as session:
            hold_account(session, user_id)  # or a name that came at the same moment would stay as the organiser's
            user = session.get_one(User, user_id)
            if user.is_moderated and not by_organiser:
                raise Conflict("Who organises your group gave you this name.", hint="Ask them for another one.")
            user.is_moderated = by_organiser
            user.name, user.handle = checked_name(name), handle_of(checked_name(name))
            _flush(session, user.name)

    def set_password(self, user_id: int, password: str, *, old: str, asked_in: str = "") -> bool:
        """A first password, or another one, which makes a card worthless; False where `old` is not the one there is.

        Args:
            user_id: Whose.
            password: The new one.
            old: The one that there is; empty where there is none.
            asked_in: The digest of the session in which somebody asks for it.

        Raises:
            ConfigError: It is too short.
            NotLetIn: That session is over.
        """
        kept = self.kept_password(user_id)
        if kept and not is_password(old, kept):
            return False
        hashed = hash_password(password)
        with self._database.transaction() as session:
            require_still_in(session, user_id, asked_in)
            user = session.get_one(User, user_id)
            if user.password != kept:  # somebody was quicker: the old one is another now
                return False
            user.password = hashed
            if kept:  # who changes it fears that others can come in
                session.execute(sa.delete(Card).where(Card.user_id == user_id))
        return True

    def by_password(self, name: str, password: str) -> tuple[int, str] | None:
        """Whose name and password these are, and what is kept of it; takes as long where there is nobody of that name.

        Raises:
            NotLetIn: They are right, and of somebody who was locked out.
        """
        found = self.kept(name)
        is_right = is_password(password, found[1] if found is not None else "")
        if found is None or not is_right:
            return None
        with self._database.transaction() as session:
            if session.get_one(User, found[0]).is_locked:
                raise NotLetIn("You are locked out.", hint="Ask whoever holds your group.")
        return found

    def confirms(self, user_id: int, password: str) -> bool:
        """Whether it is somebody's password, or they have none."""
        kept = self.kept_password(user_id)
        return not kept or is_password(password, kept)

    def kept(self, name: str) -> tuple[int, str] | None:
        """Number, and what is kept of the password, of who has a name; None where nobody has."""
        query = sa.select(User.id, User.password).where(User.handle == handle_of(name), User.deleted.is_(None))
        with self._database.transaction() as session:
            found = session.execute(query).first()
        return None if found is None else (found[0], found[1])

    def kept_password(self, user_id: int) -> str:
        """What is kept of somebody's password; empty where they have none."""
        with self._database.transaction() as session:
            return session.get_one(User, user_id).password

    def remove(self, user_id: int) -> None:
        """Forget somebody: name, keys and groups; their places on boards stay, nameless and out of the race.

        A group that nobody else organises is from then on for whoever holds the league to organise.

        Raises:
            Conflict: It is who started the server.
        """
        if user_id == OWNER:
            raise Conflict("Whoever starts the server cannot be removed.")
        with self._database.transaction() as session:
            hold_account(session, user_id)
            user = session.get_one(User, user_id)
            user.name, user.handle, user.password = gone_name(user_id), None, ""
            user.role, user.deleted = "racer", now()
            revoke_all(session, user_id)
            _hand_over(session, user_id)
            session.execute(sa.delete(Member).where(Member.user_id == user_id))
            session.execute(sa.delete(StudiedLesson).where(StudiedLesson.user_id == user_id))
            session.execute(sa.delete(Comment).where(sa.or_(Comment.owner_id == user_id, Comment.author_id == user_id)))
            session.execute(sa.delete(Quota).where(Quota.scope == "person", Quota.number == user_id))
            waiting = sa.update(Job).where(Job.user_id == user_id, Job.state.in_(("queued", "running")))
            session.execute(waiting.values(is_cancelled=True))
            queued = sa.update(Job).where(Job.user_id == user_id, Job.state == "queued")
            session.execute(queued.values(state="cancelled", finished=now()))
            mine = sa.update(Submission).where(Submission.user_id == user_id)
            session.execute(mine.values(model="-", disqualified="Withdrawn by its owner."))


def add_person(session: Session, name: str, *, role: Role = "racer") -> int:
    """A new account, in a transaction that goes on; its number.

    Raises:
        Conflict: The name is taken, or looks like one that is.
    """
    shown = checked_name(name)
    user = User(name=shown, handle=handle_of(shown), role=role)
    session.add(user)
    _flush(session, shown)
    return user.id


def use_invitation(session: Session, code: str) -> Invitation | None:
    """Take one of a code's uses; None where it is wrong, used up or too old."""
    is_it = sa.and_(Invitation.code == code, Invitation.uses_left > 0, Invitation.expires > now())
    taken = sa.update(Invitation).where(is_it).values(uses_left=Invitation.uses_left - 1)
    if session.execute(taken).rowcount != 1:  # type: ignore[attr-defined]
        return None
    return session.scalars(sa.select(Invitation).where(Invitation.code == code)).one()


def _hand_over(session: Session, user_id: int) -> None:
    """Give the groups that somebody alone organises to whoever holds the league: who came in by one may need a card."""
    other = aliased(Member)
    is_shared = sa.exists().where(
        other.group_id == Member.group_id, other.role == "organiser", other.user_id != user_id
    )
    alone = sa.select(Member.group_id).where(Member.user_id == user_id, Member.role == "organiser", ~is_shared)
    for group_id in session.scalars(alone).all():
        session.merge(Member(group_id=group_id, user_id=OWNER, role="organiser"))


def _flush(session: Session, name: str) -> None:
    if handle_of(name) == LOCAL_USER or is_gone_name(name):  # by which the pages know who has no name yet, or none now
        raise _taken(name)
    try:
        session.flush()
    except IntegrityError as error:
        raise _taken(name) from error


def _taken(name: str) -> Conflict:
    return Conflict(f"The name {name!r} is taken, or looks like one that is.", hint="Choose another.")


def _person(user: User) -> Person:
    role: Role = "admin" if user.role == "admin" else "organiser" if user.role == "organiser" else "racer"
    return Person(id=user.id, name=user.name, role=role, has_password=bool(user.password))
