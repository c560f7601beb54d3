"""The job of a submission: it is judged in a process of its own, and what that says is checked before it counts.

    FOLDER/entry.safetensors   what was sent
    FOLDER/entry.replay        what was driven, to be driven again by anybody once the race is over

The judge is given no secret. This process has it, drives the replay again from its actions alone, and only believes
what comes out the same, from the starts that the secret gives: laps and mistakes are taken from there. What the judge
says of choices on hidden frames is only compared with that of others, and never makes a place. The score comes onto the
board in the moment in which the job is done (`count`), so that one which is cancelled a moment before has none.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.errors import RunError
from racecraft.race.announcement import Announcement
from racecraft.serve.jobs.task import Task
from racecraft.serve.races.state import announcement_of
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.tables import Race, Submission, now
from racecraft.serve.submissions.bench import Bench, clear
from racecraft.serve.submissions.copies import keep_choices, mark_copies, packed

FOLDER: Final = "submissions"
REPLAY: Final = "entry.replay"
BUG: Final = "This is a bug in Racecraft."
MOST_STEPS: Final = 10**18
BENCH: Final = Bench()
"""Of this process, which does one job at a time."""


def submission_folder(state: Path, job_id: str) -> Path:
    """Where the files of a submission lie, by its job."""
    return state / FOLDER / job_id


def judge(task: Task) -> dict[str, Any]:
    """Judge a submission; its score, and what there is to tell of it."""
    from racecraft.contest.classification import classify
    from racecraft.replay.replay import read_replay, write_replay
    from racecraft.replay.verification import verify

    payload = task.job.payload
    announcement = _announcement(task)
    folder = submission_folder(task.home / STATE_FOLDER, task.job.id)
    told = {
        "document": dict(announcement.document),
        "commitment": announcement.commitment,
        "seed": announcement.seed,
        "frames": announcement.frames_seed,
        "track": payload["track"],
        "name": payload["name"],
    }
    clear(folder)
    with BENCH.asked(told, folder=folder) as (result, judged):
        replay = read_replay(judged)
    try:
        choices, step = packed(result["choices"]), result["step"]
        if type(step) is not int or not 0 <= step < MOST_STEPS:
            raise ValueError("no step")
    except (KeyError, ValueError) as error:
        raise RunError("The judge's result does not hold: it says neither choices nor steps.", hint=BUG) from error
    found = verify(replay, race=announcement)
    if not found.is_genuine:
        raise RunError(f"The judge's result does not hold: {found.sentence}", hint=BUG)
    public = Announcement(document=announcement.document, commitment=announcement.commitment)
    write_replay(replace(replay, race=public), folder / REPLAY)
    terms = announcement.document
    (standing,) = classify([replay.cars], ranking=terms["ranking"], minimum_laps=terms["minimum_laps"])
    with task.own_database.transaction() as session:
        keep_choices(session, task.job.id, choices)
    return {**replay.evaluation.report(), "step": step, "standing": standing.in_whole_ms()}


def count(session: Session, job_id: str, result: dict[str, Any]) -> None:
    """Write the score of a job that is done where the board is read from."""
    values = {name: result["standing"][name] for name in ("score_ms", "best_lap_ms", "resets", "completion")}
    mark_copies(session, job_id)
    session.execute(sa.update(Submission).where(Submission.job_id == job_id).values({**values, "judged": now()}))


def _announcement(task: Task) -> Announcement:
    """The race as it was made, with its secret, which is in no job: whoever entered can read what their jobs hold."""
    race = sa.select(Race).join(Submission, Submission.race_id == Race.id).where(Submission.job_id == task.job.id)
    with task.own_database.transaction() as session:
        return announcement_of(session.scalars(race).one())
