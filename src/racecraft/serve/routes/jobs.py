"""Jobs: what is queued, running and done."""

from __future__ import annotations

from fastapi import APIRouter

from racecraft.serve.context import InContext
from racecraft.serve.problems import NotFound
from racecraft.serve.schemas import JobInfo
from racecraft.serve.tables import Job

router = APIRouter(prefix="/api/jobs", tags=["jobs"])


def job_info(job: Job) -> JobInfo:
    """A job as the browser sees it."""
    return JobInfo.model_validate({name: getattr(job, name) for name in JobInfo.model_fields})


@router.get("")
def list_jobs(context: InContext, run: str | None = None) -> list[JobInfo]:
    """Jobs, newest first."""
    return [job_info(job) for job in context.queue.list(run=run)]


@router.get("/{job_id}")
def get_job(job_id: str, context: InContext) -> JobInfo:
    """A job by its id."""
    job = context.queue.get(job_id)
    if job is None:
        raise NotFound(f"There is no job {job_id[:40]!r}.")
    return job_info(job)


@router.post("/{job_id}/cancel", status_code=202)
def cancel_job(job_id: str, context: InContext) -> JobInfo:
    """End a job early."""
    if context.queue.get(job_id) is None:
        raise NotFound(f"There is no job {job_id[:40]!r}.")
    context.queue.cancel(job_id)
    return get_job(job_id, context)
