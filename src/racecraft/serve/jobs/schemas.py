"""Messages about jobs."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any, Literal

from racecraft.serve.schemas import Message
from racecraft.serve.store.tables import Job


class JobInfo(Message):
    """A job."""

    id: str
    kind: str
    run: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    attempts: int
    created: datetime
    started: datetime | None
    finished: datetime | None
    result: dict[str, Any] | None
    error: dict[str, Any] | None
    machine: str
    """Where it runs or ran, if other machines may do such a job."""
    behind: list[str]
    """Runs whose work comes before this, while it waits."""


def job_info(job: Job, *, behind: Sequence[str] = ()) -> JobInfo:
    """A job as the browser sees it."""
    of_the_job = {name: getattr(job, name) for name in JobInfo.model_fields if name != "behind"}
    machine = job.machine if job.travels else ""
    return JobInfo.model_validate({**of_the_job, "machine": machine, "behind": list(behind)})
