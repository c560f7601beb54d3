"""Who may enter a league's race once more: how often, and who qualified for it."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.serve.problems import Conflict
from racecraft.serve.store.tables import Job, Race, Submission, now
from racecraft.serve.submissions.bench import DriverFailed
from racecraft.serve.submissions.finalists import board_of
from racecraft.serve.submissions.stages import final_of, require_decided

KIND: Final = "judge"
"""Of a submission's job."""
MAX_WAITING: Final = 3  # submissions of one person to one race that are not judged yet
MAX_SUBMISSIONS: Final = 200  # of one person to one race
MAX_FREE: Final = 10  # of one person's a day, in all races, that fail or are cancelled
DAY: Final = timedelta(days=1)


def require_room(session: Session, race: Race, user_id: int) -> None:
    """Refuse what is too many; what was cancelled or failed by no fault of its driver costs no attempt of the day.

    That is no way to have a judge for nothing, or to find out bit by bit where a race starts by what makes a file
    fail: a driver that fails, of NaN say, has had its attempt, and of the others only some a day are free. They are
    counted by their jobs, as the same file sent again is the same submission.

    Raises:
        Conflict: It is.
    """
    query = sa.select(Submission.created, Job.state, Job.error).join(Job, Job.id == Submission.job_id)
    mine = session.execute(query.where(Submission.race_id == race.id, Submission.user_id == user_id)).all()
    if len(mine) >= MAX_SUBMISSIONS:
        raise Conflict(f"You have {MAX_SUBMISSIONS} submissions in this race already.")
    if sum(state in ("queued", "running") for _, state, _ in mine) >= MAX_WAITING:
        raise Conflict(f"{MAX_WAITING} of your submissions are not judged yet.", hint="Wait for one of them.")
    since = now() - DAY
    free = sa.select(Job.created).where(Job.user_id == user_id, Job.kind == KIND, Job.created > since)
    lost = session.scalars(free.where(Job.state.in_(("failed", "cancelled"))).order_by(Job.created)).all()
    if len(lost) >= MAX_FREE:
        raise Conflict(
            f"{MAX_FREE} of your submissions failed or were cancelled within a day.",
            hint=f"The next one is possible at {lost[-MAX_FREE] + DAY:%H:%M} UTC.",
        )
    today = sorted(created for created, *ended in mine if created > since and not _is_free(*ended))
    if race.attempts_per_day and len(today) >= race.attempts_per_day:
        raise Conflict(
            f"This race takes {race.attempts_per_day} a day of everybody; yours are used up.",
            hint=f"The next one is possible at {today[-race.attempts_per_day] + DAY:%H:%M} UTC.",
        )


def _is_free(state: str, error: Mapping[str, Any] | None) -> bool:
    return state == "cancelled" or (state == "failed" and (error or {}).get("code") != DriverFailed.__name__)


def require_place(session: Session, race: Race, user_id: int) -> None:
    """Refuse everybody where a race is frozen, and who did not qualify where it follows another.

    Raises:
        Conflict: They may not enter.
    """
    if final_of(race) is not None:
        raise Conflict("Nobody enters this final: those drive who qualify, with what they qualified with.")
    if race.is_frozen:
        raise Conflict("The race is frozen: nobody enters it for the time being.")
    if race.after_id is None:
        return
    before = session.get_one(Race, race.after_id)
    require_decided(session, before)
    rows = board_of(session, before, user_id=user_id, top=1).rows
    place = next((row.place for row in rows if row.user == user_id), None)
    if place is None or place > race.best_of_it:
        raise Conflict(f"The first {race.best_of_it} of {before.title!r} drive here.")
