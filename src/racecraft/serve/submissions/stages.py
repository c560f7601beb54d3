"""Practice, qualifying, final: which race takes its drivers from which, and what is announced of a final."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.contest.finals import FinalTerms
from racecraft.errors import ConfigError
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.state import state_of
from racecraft.serve.store.tables import Job, Race, Submission

if TYPE_CHECKING:  # jobs do without messages
    from racecraft.serve.submissions.schemas import NewLeagueRace


def final_of(race: Race) -> FinalTerms | None:
    """What was announced of a final; None of a race in which everybody drives alone."""
    return FinalTerms.of(race.document)


def announced_final(session: Session, request: NewLeagueRace, group_id: int) -> FinalTerms | None:
    """What is to be announced of a new race of a group, if two meet at a time in it.

    Raises:
        NotFound: The group has no such race to follow.
        ConfigError: The final is none that can be.
    """
    before = None if request.after is None else session.get(Race, request.after)
    if request.after is not None and (before is None or before.group_id != group_id or before.deleted is not None):
        raise NotFound(f"There is no race {request.after} in this race's group.")
    if request.form == "alone":
        return None
    if before is None:
        raise ConfigError("A final follows the race in which its drivers qualify.", hint="Say which one.")
    if request.closes is not None:
        raise ConfigError(
            "A final in which two meet at a time ends when it has been driven.", hint="Leave its end out."
        )
    return FinalTerms(form=request.form, best=request.best, qualifying=before.commitment)


def let_follow(session: Session, race_id: int, before_id: int, *, best: int) -> None:
    """Let a race take its drivers from another one.

    Raises:
        Conflict: Somebody has entered already, or it would follow itself.
    """
    if session.scalar(sa.select(Submission.id).where(Submission.race_id == race_id).limit(1)) is not None:
        raise Conflict("Somebody has entered already.", hint="Make another race.")
    one: int | None = before_id
    while one is not None:
        if one == race_id:
            raise Conflict("A race does not follow itself.")
        one = session.get_one(Race, one).after_id
    row = session.get_one(Race, race_id)
    row.after_id, row.best_of_it = before_id, best


def is_decided(session: Session, before: Race) -> bool:
    """Whether a race that another takes its drivers from is over, and all of its submissions are judged."""
    waiting = sa.select(Submission.id).join(Job, Job.id == Submission.job_id)
    waiting = waiting.where(Submission.race_id == before.id, Job.state.in_(("queued", "running")))
    return state_of(before) == "closed" and session.scalar(waiting.limit(1)) is None


def require_decided(session: Session, before: Race) -> None:
    """Refuse to say who qualified as long as that may change.

    Raises:
        Conflict: The race is not over, or not judged.
    """
    if state_of(before) != "closed":
        raise Conflict(f"Who drives here is decided by {before.title!r}, which is not over yet.")
    if not is_decided(session, before):
        raise Conflict(f"Not all submissions to {before.title!r} are judged yet.", hint="Wait for them.")


def require_alone(race: Race) -> None:
    """Refuse what only a race against the clock allows.

    Raises:
        Conflict: Two meet at a time.
    """
    if final_of(race) is not None:
        raise Conflict("This final was announced with the race that it follows.", hint="Make another race instead.")
