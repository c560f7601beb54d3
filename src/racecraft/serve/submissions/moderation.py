"""What an entry is called where others see it, given by whoever organises its race, for good."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sqlalchemy.orm import Session

from racecraft.replay.replay import read_replay, write_replay
from racecraft.serve.problems import Conflict
from racecraft.serve.store.tables import Job, Submission
from racecraft.serve.submissions.tasks import REPLAY, submission_folder


def rename_model(session: Session, state: Path, submission: Submission, model: str) -> None:
    """Call an entry otherwise: on the board, in its replay, and when it is judged again.

    Raises:
        Conflict: It waits or is driven, and nobody else sees it yet.
    """
    job = session.get_one(Job, submission.job_id)
    if job.state in ("queued", "running"):
        raise Conflict("It is not judged yet.")
    before = str(job.payload.get("name", ""))
    submission.model, submission.is_moderated = model, True
    job.payload = {**job.payload, "name": model}
    session.flush()
    path = submission_folder(state, job.id) / REPLAY
    if path.is_file():
        replay = read_replay(path)
        write_replay(replace(replay, names=tuple(model + name.removeprefix(before) for name in replay.names)), path)
