"""Whose turn it is: places go round between people, so that nobody's hundred jobs delay another's first.

    queued ──claim──▶ running ──asked──▶ saved and queued again, behind who waited          (a training)
                              ──asked──▶ goes on, and somebody else's starts beside it      (what cannot be saved)

Somebody is asked where all places of a machine are taken and a person waits who has none: at once for who was never
served, else after a longer turn, as coming back costs a start. A person alone is never asked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from datetime import datetime, timedelta
from functools import cache
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from racecraft.serve.store.tables import Job

FIRST_TURN: Final = timedelta(seconds=4)
"""How long somebody has a place at least where a job waits that never ran."""
TURN: Final = timedelta(seconds=30)
"""The same where all who wait have been served before."""
SLOW: Final = timedelta(seconds=3)
"""How long who is asked may take to save before somebody else starts all the same."""
PATIENCE: Final = timedelta(minutes=5)
"""How long what has been served waits behind what never ran."""
SPARE: Final = 4
"""Jobs of a machine beyond its places, while others save themselves or cannot."""


def turn_order(kinds: tuple[str, ...], moment: datetime) -> tuple[Any, ...]:
    """The order in which queued jobs of some kinds get a place.

    First come jobs whose owners have nothing else running or before them; of these the ones that never ran.
    """
    is_served = sa.and_(Job.started.is_not(None), Job.rested > moment - PATIENCE)
    return turn_of(kinds), sa.case((is_served, 1), else_=0), sa.func.coalesce(Job.rested, Job.created), Job.id


@cache  # putting a statement together takes longer than answering it
def turn_of(kinds: tuple[str, ...]) -> sa.ScalarSelect[int]:
    """How many jobs of its owner have a place already or come before a queued one."""
    other = aliased(Job)
    is_earlier = sa.or_(
        other.created < Job.created, sa.and_(other.created == Job.created, other.id < Job.id), other.state == "running"
    )
    query = sa.select(sa.func.count()).where(other.user_id == Job.user_id, other.kind.in_(kinds), other.id != Job.id)
    return query.where(other.state.in_(("queued", "running")), is_earlier).scalar_subquery()


def waiting_line(session: Session, kinds: tuple[str, ...], moment: datetime) -> Sequence[Job]:
    """The jobs that have the places of these kinds, then those that wait for them in the order they get them."""
    has_place = sa.case((Job.state == "running", 0), else_=1)
    open_ = sa.select(Job).where(Job.kind.in_(kinds), Job.state.in_(("queued", "running")))
    return session.scalars(open_.order_by(has_place, *turn_order(kinds, moment))).all()


def running_on(session: Session, kinds: Collection[str], machine: str) -> Sequence[Job]:
    """The jobs of these kinds that run on a machine, whoever started them."""
    return session.scalars(
        sa.select(Job).where(Job.state == "running", Job.kind.in_(kinds), Job.machine == machine)
    ).all()


def is_full(running: Collection[Job], places: int, moment: datetime, *, resting: Collection[str]) -> bool:
    """Whether nothing more starts on a machine that has so many places.

    Args:
        running: Jobs of the places' kinds there.
        places: How many there are.
        moment: Now.
        resting: Kinds that save themselves when they are asked.
    """
    held = [job for job in running if job.asked is None or _is_saving(job, moment, resting)]
    return places == 0 or len(held) >= places or len(running) >= places + SPARE


def choose_to_rest(
    running: Collection[Job], waiting: Sequence[Job], places: int, moment: datetime, *, resting: Collection[str]
) -> Job | None:
    """The job that is to give up its place now, or None.

    Args:
        running: As for `is_full`.
        waiting: Queued jobs that could run on the machine, of people who have none there and nothing else before.
        places: Of the machine.
        moment: Now.
        resting: Kinds that save themselves when they are asked.
    """
    people = Counter(job.user_id for job in running)
    waiting = [job for job in waiting if job.user_id not in people]
    if not waiting or any(_is_saving(job, moment, resting) for job in running):
        return None
    if not is_full(running, places, moment, resting=resting) or len(running) >= places + SPARE:
        return None
    turn = FIRST_TURN if any(job.started is None for job in waiting) else TURN
    held = {job: moment - job.held_since for job in running if job.asked is None and job.held_since is not None}
    had = [job for job, time in held.items() if time >= turn]
    return max(had, key=lambda job: (people[job.user_id], held[job]), default=None)


def _is_saving(job: Job, moment: datetime, resting: Collection[str]) -> bool:
    return job.asked is not None and job.kind in resting and moment - job.asked < SLOW
