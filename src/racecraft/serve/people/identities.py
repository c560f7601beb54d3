"""By whom people are known elsewhere: a provider's name, and its name for them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from racecraft.serve.people.keys import require_still_in
from racecraft.serve.problems import Conflict, NotFound, NotLetIn
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Card, Identity, User


@dataclass(frozen=True)
class Link:
    """An account comes in through a provider."""

    since: datetime
    is_only_way: bool
    """Whether it could come in no other way."""


class Identities:
    """Everybody's, at every provider."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def user(self, issuer: str, subject: str) -> int | None:
        """Whose it is; None of somebody who has no account.

        Raises:
            NotLetIn: They are locked out.
        """
        query = sa.select(Identity.user_id, Identity.is_locked).join(User, User.id == Identity.user_id)
        query = query.where(Identity.issuer == issuer, Identity.subject == subject, User.deleted.is_(None))
        with self._database.transaction() as session:
            found = session.execute(query).first()
        if found is not None and found[1]:
            raise NotLetIn("You are locked out.", hint="Ask whoever holds your group.")
        return None if found is None else found[0]

    def link(self, user_id: int, issuer: str, subject: str, *, asked_in: str = "") -> None:
        """From now on somebody comes in through a provider, too.

        Args:
            user_id: Who.
            issuer: The provider.
            subject: Its name for them.
            asked_in: The digest of the session in which they ask for it.

        Raises:
            Conflict: Somebody else does so with that account of the provider, or they do with another one.
            NotLetIn: That session is over.
        """
        with self._database.transaction() as session:
            require_still_in(session, user_id, asked_in)
            mine = session.scalars(_of(user_id, issuer)).first()
            if mine is not None and mine.subject != subject:
                raise Conflict("You come in with another account there already.", hint="Unlink that one first.")
            if mine is None:
                add_identity(session, user_id, issuer, subject)

    def unlink(self, user_id: int, issuer: str) -> None:
        """Somebody no longer comes in through a provider.

        Raises:
            NotFound: They do not.
            Conflict: They could come in no other way.
        """
        with self._database.transaction() as session:
            mine = session.scalars(_of(user_id, issuer)).first()
            if mine is None:
                raise NotFound("Your account is not linked to it.")
            if not _has_another_way(session, user_id):
                raise Conflict("You could come in no other way.", hint="Give yourself a password first.")
            session.delete(mine)

    def of(self, user_id: int, issuer: str) -> Link | None:
        """How somebody comes in through a provider; None if they do not."""
        with self._database.transaction() as session:
            mine = session.scalars(_of(user_id, issuer)).first()
            return None if mine is None else Link(mine.created, not _has_another_way(session, user_id))


def add_identity(session: Session, user_id: int, issuer: str, subject: str) -> None:
    """An account comes in through a provider, in a transaction that goes on.

    Raises:
        Conflict: Somebody else does so with that account of the provider.
    """
    session.add(Identity(user_id=user_id, issuer=issuer, subject=subject))
    try:
        session.flush()
    except IntegrityError as error:
        raise Conflict(
            "Somebody else comes in with that account there.", hint="Sign out there, and begin again."
        ) from error


def _of(user_id: int, issuer: str) -> sa.Select[Identity]:
    return sa.select(Identity).where(Identity.user_id == user_id, Identity.issuer == issuer)


def _has_another_way(session: Session, user_id: int) -> bool:
    card = sa.select(sa.exists().where(Card.user_id == user_id))
    return bool(session.get_one(User, user_id).password) or bool(session.scalar(card))
