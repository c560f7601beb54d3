"""Comments: said by an organiser about a racer's model, read by both, taken back by either."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import sqlalchemy as sa

from racecraft.serve.comments.schemas import CommentInfo
from racecraft.serve.people.keys import hold_account
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Comment, User

MAX_COMMENTS: Final = 200
"""About the models of one person."""


class Comments:
    """What is said about everybody's models; who may say it is for `racecraft.serve.groups` to know."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, owner_id: int, model: str, text: str, *, author_id: int) -> int:
        """Say something about somebody's model; its number.

        Raises:
            Conflict: There is too much about their models already.
        """
        count = sa.select(sa.func.count(Comment.id)).where(Comment.owner_id == owner_id)
        with self._database.transaction() as session:
            hold_account(session, owner_id)  # two at the same moment count each other
            if (session.scalar(count) or 0) >= MAX_COMMENTS:
                raise Conflict(f"There are {MAX_COMMENTS} comments on their models already.", hint="Take some back.")
            row = Comment(owner_id=owner_id, model=model, author_id=author_id, text=text.strip())
            session.add(row)
            session.flush()
            return row.id

    def about(self, owner_id: int, models: Sequence[str], *, user_id: int) -> list[CommentInfo]:
        """What is said about some of somebody's models, newest first.

        Args:
            owner_id: Whose models they are.
            models: Their names.
            user_id: Who looks.
        """
        query = sa.select(Comment, User.name).join(User, User.id == Comment.author_id)
        query = query.where(Comment.owner_id == owner_id, Comment.model.in_(models)).order_by(Comment.id.desc())
        with self._database.transaction() as session:
            rows = session.execute(query).all()
        return [
            CommentInfo(
                id=row.id,
                model=row.model,
                author=author,
                is_mine=row.author_id == user_id,
                text=row.text,
                created=row.created,
            )
            for row, author in rows
        ]

    def remove(self, comment_id: int, *, user_id: int) -> None:
        """Take a comment back, as its author or as whose model it is about.

        Raises:
            NotFound: They are neither, or there is none.
        """
        with self._database.transaction() as session:
            row = session.get(Comment, comment_id)
            if row is None or user_id not in (row.author_id, row.owner_id):
                raise NotFound(f"There is no comment {comment_id} by you or on a model of yours.")
            session.delete(row)
