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
COLUMNS: Final = ("model", "score_ms", "best_lap_ms", "resets", "completion")


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
    behind: int
    """Entrants whose place is behind that of whoever looks; 0 for who is not on it."""


def read_board(session: Session, race_id: int, *, user_id: int | None, top: int) -> Board:
    """The board of a race.

    Args:
        session: To read in.
        race_id: Of the race.
        user_id: Who looks; None for somebody without an account.
        top: Rows from the top.
    """
    keys, names = _order(Submission), ("first_key", "second_key", "third_key")
    judged = sa.and_(Submission.race_id == race_id, Submission.disqualified == "", Submission.judged.is_not(None))
    number = sa.func.row_number().over(partition_by=Submission.user_id, order_by=[*keys, Submission.id])
    told = [key.label(name) for key, name in zip(keys, names, strict=True)]
    # what is sorted is kept small: all else of a row is looked up for the few that are shown
    slim = sa.select(Submission.id, Submission.user_id, *told, number.label("turn")).where(judged).subquery()
    order = [slim.c[name] for name in names]
    place = sa.func.rank().over(order_by=order)
    line = sa.func.row_number().over(order_by=[*order, slim.c.id])
    columns = (slim.c.id, slim.c.user_id, slim.c.first_key, place.label("place"), line.label("line"))
    rows = sa.select(*columns).where(slim.c.turn == 1).cte("board")
    mine = sa.select(rows.c.line).where(rows.c.user_id == (user_id or 0)).scalar_subquery()
    my_place = sa.select(rows.c.place).where(rows.c.user_id == (user_id or 0)).scalar_subquery()
    query = sa.select(
        rows.c.place,
        rows.c.line,
        *(getattr(Submission, name) for name in ("id", "user_id", *COLUMNS)),
        User.name,
        sa.select(sa.func.count()).select_from(rows).scalar_subquery().label("entrants"),
        sa.select(sa.func.count()).where(rows.c.first_key < NONE).scalar_subquery().label("ranked"),
        sa.select(sa.func.min(rows.c.first_key)).where(rows.c.first_key < NONE).scalar_subquery().label("first"),
        sa.select(sa.func.count()).where(rows.c.place > my_place).scalar_subquery().label("behind"),
    )
    query = query.join(Submission, Submission.id == rows.c.id).join(User, User.id == rows.c.user_id)
    is_near = sa.func.abs(rows.c.line - mine) <= AROUND
    found: list[Any] = list(session.execute(query.where(sa.or_(rows.c.line <= top, is_near)).order_by(rows.c.line)))
    return Board(
        rows=[_row(one) for one in found],
        entrants=found[0].entrants if found else 0,
        ranked=found[0].ranked if found else 0,
        first_ms=found[0].first if found else None,
        behind=found[0].behind if found else 0,
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
