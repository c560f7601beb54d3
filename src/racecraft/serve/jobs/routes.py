"""Jobs: what is queued, running and done."""

from __future__ import annotations

from fastapi import APIRouter

from racecraft.serve.context import InContext
from racecraft.serve.jobs.queue import ORGANISER
from racecraft.serve.jobs.schemas import JobInfo, job_info
from racecraft.serve.problems import Conflict, NotFound

router = APIRouter(prefix="/api/jobs", tags=["jobs"])
__all__ = ["job_info", "router"]


@router.get("")
def list_jobs(context: InContext, run: str | None = None) -> list[JobInfo]:
    """Jobs, newest first."""
    return [job_info(context.follower.see(job)) for job in context.queue.list(run=run)]


@router.get("/{job_id}")
def get_job(job_id: str, context: InContext) -> JobInfo:
    """A job by its id."""
    job = context.queue.get(job_id)
    if job is None:
        raise NotFound(f"There is no job {job_id[:40]!r}.")
    return job_info(context.follower.see(job))


@router.post("/{job_id}/cancel", status_code=202)
def cancel_job(job_id: str, context: InContext) -> JobInfo:
    """End a job early."""
    job = context.queue.get(job_id)
    if job is None:
        raise NotFound(f"There is no job {job_id[:40]!r}.")
    if job.payload.get(ORGANISER, job.user_id) != job.user_id:  # else it gave back an attempt that has counted
        raise Conflict("An organiser has this judged again, so it is not yours to cancel.")
    context.queue.cancel(job_id)
    return get_job(job_id, context)
