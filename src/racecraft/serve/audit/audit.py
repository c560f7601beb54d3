"""The audit log: who did what with power, on what and when.

    request ──begin──▶ a row, not done yet ──the deed──▶ done, or the row is gone

What was refused was not done, and is not in it, but for who was not let in; that is written down in one go.
The row is there before the deed: of a server that is killed in between it says that the deed may have been done.
"""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa

from racecraft.serve.audit.schemas import AuditLine
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Deed, User

TELLING: Final = (
    "title",
    "is_closed",
    "member",
    "members",
    "model",
    "reason",
    "race",
    "uses",
    "hours",
    "scopes",
    "days",
    "person",
)
"""What is kept of what somebody sends; never a real name, a password or a secret."""
MAX_TARGET: Final = 200  # characters


class Audit:
    """The log of a league."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def begin(self, user_id: int, what: str, target: str, sent: object) -> int:
        """Somebody is about to do something.

        Args:
            user_id: Who.
            what: The operation.
            target: Its address.
            sent: The request's JSON, of which what is telling is kept.

        Returns:
            The line's number.
        """
        details = {key: sent[key] for key in TELLING if key in sent} if isinstance(sent, dict) else {}
        deed = Deed(user_id=user_id, what=what, target=target[:MAX_TARGET], details=details)
        with self._database.transaction() as session:
            session.add(deed)
            session.flush()
            return deed.id

    def note(self, user_id: int | None, what: str, target: str, **details: str) -> None:
        """Something that is done already, such as coming in; `user_id` is None of who is nobody."""
        with self._database.transaction() as session:
            session.add(Deed(user_id=user_id, what=what, target=target[:MAX_TARGET], details=details, is_done=True))

    def done(self, number: int) -> None:
        """It was done."""
        with self._database.transaction() as session:
            session.execute(sa.update(Deed).where(Deed.id == number).values(is_done=True))

    def refused(self, number: int) -> None:
        """It was not done."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Deed).where(Deed.id == number))

    def latest(self, count: int, *, before: int | None = None, name: str = "", what: str = "") -> list[AuditLine]:
        """Lines, newest first.

        Args:
            count: How many at most.
            before: Only lines that are older than that of this number.
            name: Only of whose name holds this.
            what: Only of operations that are called so in part.
        """
        query = sa.select(Deed, User.name).outerjoin(User, User.id == Deed.user_id).order_by(Deed.id.desc())
        query = query.limit(count)
        if name:
            query = query.where(User.name.icontains(name, autoescape=True))
        if what:
            query = query.where(Deed.what.contains(what, autoescape=True))
        if before is not None:
            query = query.where(Deed.id < before)
        with self._database.transaction() as session:
            return [
                AuditLine(
                    id=deed.id,
                    when=deed.created,
                    who=deed.user_id,
                    name=name or "",
                    what=deed.what,
                    target=deed.target,
                    details=deed.details,
                    is_done=deed.is_done,
                )
                for deed, name in session.execute(query)
            ]
