"""Who drives in a final, what its duels came to, and its board; where everybody drives alone, the board of all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.serve.store.tables import Duel, Finalist, Race, Submission, User
from racecraft.serve.submissions.board import AROUND, Board, Row, read_board
from racecraft.serve.submissions.stages import final_of


def finalists_of(session: Session, race_id: int) -> Sequence[Any]:
    """Rows of `Finalist`, `Submission` and the racer's name, the first seed first."""
    query = sa.select(Finalist, Submission, User.name).join(Submission, Submission.id == Finalist.submission_id)
    query = query.join(User, User.id == Submission.user_id).where(Finalist.race_id == race_id)
    return session.execute(query.order_by(Finalist.seed)).all()


def duels_of(session: Session, race_id: int) -> Sequence[Duel]:
    """Those that are decided, in the order in which they were driven."""
    return session.scalars(sa.select(Duel).where(Duel.race_id == race_id).order_by(Duel.number)).all()


def places_of(session: Session, race: Race) -> dict[str, int] | None:
    """Places in a final by submission; while it is driven once more, or where that failed, those of before."""
    query = sa.select(Finalist.submission_id, Finalist.place).where(Finalist.race_id == race.id)
    return {str(submission): place for submission, place in session.execute(query) if place} or race.last_places


def last_board_of(session: Session, race: Race, *, top: int) -> Board:
    """The board of any race for who looks at none of its rows, of a final as it was driven last.

    Args:
        session: To read in.
        race: Whose.
        top: Rows from the top.
    """
    places = None if final_of(race) is None else places_of(session, race)
    if not places:
        return board_of(session, race, user_id=None, top=top)
    query = sa.select(Submission, User.name).join(User, User.id == Submission.user_id)
    found = session.execute(query.where(Submission.id.in_(map(int, places)))).all()
    entered = sorted(((places[str(one.id)], one, name) for one, name in found), key=lambda of: (of[0], of[1].id))
    rows = [_row(one, name, place, number) for number, (place, one, name) in enumerate(entered, start=1)]
    return Board(rows=rows[:top], entrants=len(rows), ranked=len(rows), first_ms=None, behind=0)


def board_of(session: Session, race: Race, *, user_id: int | None, top: int) -> Board:
    """The board of any race; that of a final has places instead of scores, and before it has them seeds.

    Args:
        session: To read in.
        race: Whose.
        user_id: Who looks; None for somebody without an account.
        top: Rows from the top.
    """
    if final_of(race) is None:
        return read_board(session, race.id, user_id=user_id, top=top)
    found = sorted(finalists_of(session, race.id), key=lambda one: (one.Finalist.place or 0, one.Finalist.seed))
    rows = [
        _row(submission, name, finalist.place, number)
        for number, (finalist, submission, name) in enumerate(found, start=1)
    ]
    mine = next((row for row in rows if row.user == user_id), None)
    return Board(
        rows=[row for row in rows if row.row <= top or (mine is not None and abs(row.row - mine.row) <= AROUND)],
        entrants=len(rows),
        ranked=sum(row.place is not None for row in rows),
        first_ms=None,
        behind=sum((row.place or row.row) > (mine.place or mine.row) for row in rows) if mine is not None else 0,
    )


def _row(submission: Submission, name: str, place: int | None, number: int) -> Row:
    """Of somebody in a final: a place, and no score of their own."""
    return Row(
        submission=submission.id,
        user=submission.user_id,
        name=name,
        model=submission.model,
        place=place,
        row=number,
        score_ms=None,
        best_lap_ms=None,
        resets=0,
        completion=0.0,
    )


def published_final(session: Session, race: Race) -> dict[str, Any]:
    """What anybody needs to check a final besides its board: who drove, and how every duel ended."""
    return {
        "qualifying": race.after_id,
        "finalists": [
            {"seed": finalist.seed, "submission": submission.id, "name": name, "model": submission.model}
            for finalist, submission, name in finalists_of(session, race.id)
        ],
        "duels": [
            {"number": duel.number, "seeds": [duel.first, duel.second], "winner": duel.winner, "results": duel.results}
            for duel in duels_of(session, race.id)
        ],
    }
