"""What its owner, or whoever organises the race, is told of a submission."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.serve.races.races import is_withheld
from racecraft.serve.store.tables import Choices, Job, Race, Submission, User
from racecraft.serve.submissions.schemas import Likeness, SubmissionInfo

LAST: Final = 20  # judged ones that the time left is taken from


def told_of() -> sa.Select[Submission, Job, str, int | None, float, bool]:
    """The question for all that `submission_info` needs of a row."""
    query = sa.select(Submission, Job, User.name, Choices.like_id, Choices.likeness, Choices.is_accepted)
    query = query.join(Job, Job.id == Submission.job_id).join(User, User.id == Submission.user_id)
    return query.outerjoin(Choices, Choices.submission_id == Submission.id)


def pace(session: Session, kind: str) -> float | None:
    """Seconds that the last submissions took to be judged."""
    query = sa.select(Job.started, Job.finished).where(Job.kind == kind, Job.state == "done")
    rows = session.execute(query.order_by(Job.created.desc()).limit(LAST)).all()
    took = [(finished - started).total_seconds() for started, finished in rows if started and finished]
    return statistics.median(took) if took else None


def whose(session: Session, rows: Sequence[Any]) -> dict[int, Likeness]:
    """By submission, whose earlier entry it drives like."""
    query = sa.select(Submission.id, Submission.model, User.name).join(User, User.id == Submission.user_id)
    earlier = {row.like_id for row in rows if row.like_id is not None}
    found = {one.id: one for one in session.execute(query.where(Submission.id.in_(earlier)))}
    return {
        row.Submission.id: Likeness(submission=one.id, name=one.name, model=one.model, likeness=round(row.likeness, 3))
        for row in rows
        if (one := found.get(row.like_id)) is not None
    }


def submission_info(row: Any, *, ahead: int, pace: float | None, race: Race, like: Likeness | None) -> SubmissionInfo:
    """A row of `told_of` in words; `like` for organisers."""
    submission, job = row.Submission, row.Job
    is_waiting = job.state in ("queued", "running")
    return SubmissionInfo.model_validate(
        {
            "id": submission.id,
            "name": row.name,
            "model": submission.model,
            "digest": submission.digest,
            "state": job.state,
            "ahead": ahead,
            "seconds_left": round((ahead + 1) * pace, 1) if is_waiting and pace is not None else None,
            "score": seconds_of(submission.score_ms),
            "best_lap": seconds_of(submission.best_lap_ms),
            "completion": submission.completion,
            "error": job.error,
            "disqualified": submission.disqualified,
            "is_looked_at": row.like_id is not None and not row.is_accepted and not submission.disqualified,
            "like": like,
            "created": submission.created,
            "has_replay": submission.judged is not None and not is_withheld(race),
        }
    )


def seconds_of(milliseconds: int | None) -> float | None:
    """The same in s."""
    return None if milliseconds is None else milliseconds / 1000
