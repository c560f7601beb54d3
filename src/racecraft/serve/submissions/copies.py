"""Near-copies: entries that choose on hidden frames what an earlier entry of somebody else chooses.

    judge ──choices──▶ kept ──▶ compared with those of the race ──▶ the earliest alike is another person's: marked

A mark takes nothing away: the entry stands where it stands, and a person decides. Of one's own entries the earliest
counts as well, so that nobody is taken for a copy of who has copied them.
"""

from __future__ import annotations

import base64
import binascii
from typing import Any, Final

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from racecraft.race.likeness import ALIKE, FRAMES, likeness
from racecraft.serve.store.tables import Choices, Submission

KIND: Final = np.dtype("<i2")


def packed(choices: Any) -> str:
    """What a judge's process says of choices, as the table keeps it.

    Raises:
        ValueError: It says something else.
    """
    found = np.array(choices)
    if found.shape != (FRAMES, 2) or found.dtype.kind != "i" or (found != found.astype(KIND)).any():
        raise ValueError("no choices")
    return base64.b64encode(found.astype(KIND).tobytes()).decode()


def keep_choices(session: Session, job_id: str, commands: str) -> None:
    """Keep what the submission of a job chooses; its mark, if it has one, stays."""
    number = session.scalars(sa.select(Submission.id).where(Submission.job_id == job_id)).one()
    if (row := session.get(Choices, number)) is None:
        session.add(Choices(submission_id=number, commands=commands))
    else:
        row.commands = commands


def mark_copies(session: Session, job_id: str) -> None:
    """Mark the submission of a job, and later ones, where the earliest that is like them is somebody else's.

    Its choices have to be committed before: of two that are judged at once the later one finds the other.
    """
    mine = session.scalars(sa.select(Submission).where(Submission.job_id == job_id)).one()
    query = sa.select(Submission.id, Submission.user_id, Choices.commands)
    query = query.join(Choices, Choices.submission_id == Submission.id).where(Submission.race_id == mine.race_id)
    found = session.execute(query.order_by(Submission.id)).all()
    numbers, users = [row.id for row in found], [row.user_id for row in found]
    choices = np.stack([_unpacked(row.commands) for row in found])
    index = numbers.index(mine.id)
    alike = likeness(choices[index], choices)
    later = [one for one in _places(alike) if one > index and users[one] != mine.user_id]
    for one in (index, *later):
        values = alike if one == index else likeness(choices[one], choices)
        first = min(_places(values), default=one)
        _mark(session, numbers[one], None if users[first] == users[one] else numbers[first], float(values[first]))


def accept(session: Session, submission_id: int) -> bool:
    """A person lets an entry stand; whether it had a mark."""
    is_it = sa.and_(Choices.submission_id == submission_id, Choices.like_id.is_not(None))
    changed = session.execute(sa.update(Choices).where(is_it).values(is_accepted=True))
    return bool(changed.rowcount)  # type: ignore[attr-defined]


def _mark(session: Session, number: int, like: int | None, value: float) -> None:
    row = session.get_one(Choices, number)
    if row.like_id != like:
        row.like_id, row.is_accepted = like, False
    row.likeness = value if like is not None else 0.0


def _places(alike: NDArray[np.float64]) -> list[int]:
    return [one for one, value in enumerate(alike.tolist()) if value >= ALIKE]


def _unpacked(commands: str) -> NDArray[np.int16]:
    return np.frombuffer(binascii.a2b_base64(commands), KIND).reshape(FRAMES, 2)
