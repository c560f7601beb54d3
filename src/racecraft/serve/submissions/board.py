"""The board of a league's race: everybody's best submission in order, and the neighbours of whoever looks.

All in one question to the database, so that ten thousand entries take no longer to look at than ten.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
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
    place = sa.func.rank().over(order_by=[slim.c[name] for name in names])
    board = sa.select(slim.c.id, slim.c.user_id, slim.c.first_key, place.label("place")).where(slim.c.turn == 1)
    rows = board.cte("board")
    mine = sa.select(rows.c.place).where(rows.c.user_id == (user_id or 0)).scalar_subquery()
    near = sa.func.abs(rows.c.place - mine) <= AROUND
    query = sa.select(
        rows.c.place,
        *(getattr(Submission, name) for name in ("id", "user_id", *COLUMNS)),
        User.name,
        sa.select(sa.func.count()).select_from(rows).scalar_subquery().label("entrants"),
        sa.select(sa.func.count()).where(rows.c.first_key < NONE).scalar_subquery().label("ranked"),
        sa.select(sa.func.min(rows.c.first_key)).where(rows.c.first_key < NONE).scalar_subquery().label("first"),
    )
    query = query.join(Submission, Submission.id == rows.c.id).join(User, User.id == rows.c.user_id)
    found: list[Any] = list(
        session.execute(query.where(sa.or_(rows.c.place <= top, near)).order_by(rows.c.place, rows.c.id))
    )
    lines = list(_lines(found))
    own = next((line for line, one in lines if one.user_id == user_id), None)
    shown = [_row(line, one) for line, one in lines if line <= top or (own and abs(line - own) <= AROUND)]
    return Board(
        rows=shown,
        entrants=found[0].entrants if found else 0,
        ranked=found[0].ranked if found else 0,
        first_ms=found[0].first if found else None,
    )


def _lines(found: list[Any]) -> Iterator[tuple[int, Any]]:
    """Rows with their numbers: of equals, who share a place, all were found, who was first before the others."""
    for place, equals in itertools.groupby(found, key=lambda one: one.place):
        yield from enumerate(equals, start=place)


def _order(table: Any) -> list[sa.ColumnElement[Any]]:
    """The rules of `racecraft.contest.standings` as the database orders: less is better."""
    is_ranked = table.score_ms.is_not(None)
    return [
        sa.func.coalesce(table.score_ms, NONE),
        sa.case((is_ranked, sa.func.coalesce(table.best_lap_ms, NONE)), else_=-sa.func.round(1000 * table.completion)),
        table.resets,
    ]


def _row(line: int, found: Any) -> Row:
    return Row(
        submission=found.id,
        user=found.user_id,
        name=found.name,
        model=found.model,
        place=found.place if found.score_ms is not None else None,
        row=line,
        score_ms=found.score_ms,
        best_lap_ms=found.best_lap_ms,
        resets=found.resets,
        completion=found.completion,
    )
