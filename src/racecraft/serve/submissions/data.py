"""All that a league keeps of somebody, but for their models, which are archives of their own."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa

from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import (
    Card,
    Comment,
    Deed,
    Finalist,
    Group,
    Identity,
    Job,
    Member,
    Race,
    Session,
    StudiedLesson,
    Submission,
    Table,
    Token,
    User,
)

KEPT: dict[str, type[Table]] = {
    "sessions": Session,
    "cards": Card,
    "tokens": Token,
    "identities": Identity,
    "jobs": Job,
    "deeds": Deed,
    "lessons": StudiedLesson,
}
"""Tables of rows that belong to somebody, by the name that they have in the document."""
SECRET = ("digest", "password", "owner", "secret")
"""What is not handed out, at any depth: hashes, what is of the machine, and where a race starts that is not over."""


def data_of(database: Database, user_id: int) -> dict[str, Any]:
    """A document of everything that is about somebody."""
    with database.transaction() as session:
        groups = sa.select(Group.title, Member).join(Member, Member.group_id == Group.id)
        finals = sa.select(Race.title, Finalist).join(Finalist, Finalist.race_id == Race.id)
        finals = finals.join(Submission, Submission.id == Finalist.submission_id)
        submissions = sa.select(Race.title, Submission).join(Submission, Submission.race_id == Race.id)
        return {
            "account": _row(session.get_one(User, user_id)),
            **{
                name: [_row(row) for row in session.scalars(sa.select(table).where(table.user_id == user_id))]  # type: ignore[attr-defined]
                for name, table in KEPT.items()
            },
            "groups": [
                {"title": title, **_row(row)} for title, row in session.execute(groups.where(Member.user_id == user_id))
            ],
            "races": [_row(row) for row in session.scalars(sa.select(Race).where(Race.owner_id == user_id))],
            "finals": [
                {"race": title, **_row(row)}
                for title, row in session.execute(finals.where(Submission.user_id == user_id))
            ],
            "comments": [
                _row(row)
                for row in session.scalars(
                    sa.select(Comment).where(sa.or_(Comment.owner_id == user_id, Comment.author_id == user_id))
                )
            ],
            "submissions": [
                {"race": title, "file": row.digest, **_row(row)}
                for title, row in session.execute(submissions.where(Submission.user_id == user_id))
            ],
        }


def _row(row: Table) -> dict[str, Any]:
    told: dict[str, Any] = _told({column.key: getattr(row, column.key) for column in row.__table__.columns})
    return told


def _told(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _told(inner) for name, inner in value.items() if name not in SECRET}
    return [_told(inner) for inner in value] if isinstance(value, list) else value
