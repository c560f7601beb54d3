"""Messages about jobs."""

from __future__ import annotations

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


def job_info(job: Job) -> JobInfo:
    """A job as the browser sees it."""
    return JobInfo.model_validate({name: getattr(job, name) for name in JobInfo.model_fields})
