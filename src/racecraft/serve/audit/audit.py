"""The audit log: who did what with power, on what and when. What was refused was not done, and is not in it.

    request ──begin──▶ a row, not done yet ──the deed──▶ done, or the row is gone

The row is there before the deed: of a server that is killed in between it says that the deed may have been done.
"""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa

from racecraft.serve.audit.schemas import AuditLine
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Deed, User

TELLING: Final = ("title", "member", "members", "model", "reason", "race", "uses", "hours", "scopes", "days")
"""What is kept of what somebody sends; never a name, a password or a secret."""
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

    def done(self, number: int) -> None:
        """It was done."""
        with self._database.transaction() as session:
            session.execute(sa.update(Deed).where(Deed.id == number).values(is_done=True))

    def refused(self, number: int) -> None:
        """It was not done."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Deed).where(Deed.id == number))

    def latest(self, count: int, *, before: int | None = None) -> list[AuditLine]:
        """Lines, newest first.

        Args:
            count: How many at most.
            before: Only lines that are older than that of this number.
        """
        query = sa.select(Deed, User.name).join(User, User.id == Deed.user_id).order_by(Deed.id.desc()).limit(count)
        if before is not None:
            query = query.where(Deed.id < before)
        with self._database.transaction() as session:
            return [
                AuditLine(
                    id=deed.id,
                    when=deed.created,
                    who=deed.user_id,
                    name=name,
                    what=deed.what,
                    target=deed.target,
                    details=deed.details,
                    is_done=deed.is_done,
                )
                for deed, name in session.execute(query)
            ]
