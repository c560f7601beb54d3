"""The board of a league's race: everybody's best submission in order, and the neighbours of whoever looks.

All in one question to the database, so that ten thousand entries take no longer to look at than ten.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.serve.store.tables import Submission, User

NONE: Final = 2**31 - 1
"""Stands for a score or a lap that there is not: after all others."""
AROUND: Final = 3  # neighbours on either side


@dataclass(frozen=True)
class Row:
    """One person's best submission."""

    submission: int
    user: int
    name: str
    model: str
    place: int | None
    """None without enough completed laps."""
    row: int
    """From 1; of equals, who was first."""
    score_ms: int | None
    best_lap_ms: int | None
    resets: int
    completion: float


@dataclass(frozen=True)
class Board:
    """What there is to see."""

    rows: list[Row]
    """The first ones, then the neighbours of whoever looks where they are further down."""
    entrants: int
    ranked: int
    first_ms: int | None


def read_board(session: Session, race_id: int, *, user_id: int | None, top: int) -> Board:
    """The board of a race.

    Args:
        session: To read in.
        race_id: Of the race.
        user_id: Who looks; None for somebody without an account.
        top: Rows from the top.
    """
    order = _order(Submission)
    judged = sa.and_(Submission.race_id == race_id, Submission.disqualified == "", Submission.judged.is_not(None))
    number = sa.func.row_number().over(partition_by=Submission.user_id, order_by=[*order, Submission.id])
    best = sa.select(Submission, number.label("turn")).where(judged).subquery()
    keys = _order(best.c)
    rows = (
        sa.select(
            best.c.id,
            best.c.user_id,
            best.c.model,
            best.c.score_ms,
            best.c.best_lap_ms,
            best.c.resets,
            best.c.completion,
            sa.func.rank().over(order_by=keys).label("place"),
            sa.func.row_number().over(order_by=[*keys, best.c.id]).label("line"),
            sa.func.count().over().label("entrants"),
            sa.func.count(best.c.score_ms).over().label("ranked"),
            sa.func.min(best.c.score_ms).over().label("first"),
        )
        .where(best.c.turn == 1)
        .cte("board")
    )
    mine = sa.select(rows.c.line).where(rows.c.user_id == (user_id or 0)).scalar_subquery()
    near = sa.func.abs(rows.c.line - mine) <= AROUND
    query = sa.select(rows, User.name).join(User, User.id == rows.c.user_id).where(sa.or_(rows.c.line <= top, near))
    found: list[Any] = list(session.execute(query.order_by(rows.c.line)))
    return Board(
        rows=[_row(one) for one in found],
        entrants=found[0].entrants if found else 0,
        ranked=found[0].ranked if found else 0,
        first_ms=found[0].first if found else None,
    )


def _order(table: Any) -> list[sa.ColumnElement[Any]]:
    """The rules of `racecraft.contest.standings` as the database orders: less is better."""
    is_ranked = table.score_ms.is_not(None)
    return [
        sa.func.coalesce(table.score_ms, NONE),
        sa.case((is_ranked, sa.func.coalesce(table.best_lap_ms, NONE)), else_=-sa.func.round(1000 * table.completion)),
        table.resets,
    ]


def _row(found: Any) -> Row:
    return Row(
        submission=found.id,
        user=found.user_id,
        name=found.name,
        model=found.model,
        place=found.place if found.score_ms is not None else None,
        row=found.line,
        score_ms=found.score_ms,
        best_lap_ms=found.best_lap_ms,
        resets=found.resets,
        completion=found.completion,
    )
