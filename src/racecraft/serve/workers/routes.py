"""What workers ask who hold a token of theirs and nothing else; nobody else finds anything here."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path as File
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse

from racecraft.errors import RunError
from racecraft.serve.context import Consoles, InConsoles, InLeague
from racecraft.serve.jobs.parcel import unpack
from racecraft.serve.models.archives import UPLOADS, require_disk
from racecraft.serve.people.keys import WORKER
from racecraft.serve.problems import NotFound
from racecraft.serve.store.tables import Job
from racecraft.serve.workers import schemas
from racecraft.serve.workers.leases import Lease
from racecraft.serve.workers.parcels import Key
from racecraft.serve.workers.results import check_result
from racecraft.version import VERSION

SMALL: Final = 1 << 20
"""Bytes of what is kept in memory until it is in the store; more goes over a file."""
WAIT: Final = 5.0
"""s that a worker waits for news; half of what it waits for any answer."""
BINARY: Final = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}


async def _token(request: Request, _: InLeague) -> int:  # async, as a thread for it costs more than it does
    if request.state.scopes is None or WORKER not in request.state.scopes:
        raise NotFound("Only workers with a token see this.")
    token: int = request.state.token
    return token


Token = Annotated[int, Depends(_token)]
router = APIRouter(prefix="/api/workers", tags=["workers"], dependencies=[Depends(_token)])


async def _lease(consoles: InConsoles, token: Token, worker: Annotated[str, Path(pattern=r"^[0-9a-f]{16}$")]) -> Lease:
    return consoles.owner.leases.of(token, worker)


InLease = Annotated[Lease, Depends(_lease)]


@router.get("")
def greet_worker() -> schemas.Welcome:
    """Before a worker begins."""
    return schemas.Welcome(version=VERSION)


@router.get("/news")
async def hear_news(consoles: InConsoles, after: Annotated[int, Query(ge=-1, lt=2**53)] = -1) -> schemas.News:
    """Waits until there is something new in the queue since the number that was told last, or some seconds."""
    return schemas.News(number=await consoles.owner.supervisor.news.later_than(after, seconds=WAIT))


@router.post("/{worker}/take")
def take_job(body: schemas.Take, lease: InLease) -> schemas.Lease | None:
    """The next job that travels, where a place is free; where none is, somebody rests for who waits."""
    job = lease.take(body.slot, body.kinds, machine=body.machine, places=body.places, of_version=body.version)
    return None if job is None else _told(job)


@router.get("/{worker}/job")
def held_job(lease: InLease) -> schemas.Lease | None:
    """The job that this worker has."""
    job = lease.held()
    return None if job is None else _told(job)


@router.post("/{worker}/heartbeat")
def keep_job(body: schemas.Beat, lease: InLease) -> schemas.BeatAnswer:
    """Keep a job, and hear whether to go on."""
    answer = lease.heartbeat(body.job, has_progressed=body.has_progressed)
    return schemas.BeatAnswer(word=answer.word, is_watched=answer.is_watched)


@router.post("/{worker}/finish", status_code=204)
def finish_job(body: schemas.End, lease: InLease, consoles: InConsoles) -> Response:
    """A job is done, or failed."""
    job = lease.required()
    error = None if body.error is None else body.error.model_dump()
    if body.state == "done":
        check_result(job.kind, body.result)
    lease.finish(body.job, body.state, result=body.result, error=error)
    consoles.owner.parcels.forget(job)
    return Response(status_code=204)


@router.post("/{worker}/release", status_code=204)
def release_job(body: schemas.Release, lease: InLease, consoles: InConsoles) -> Response:
    """A job is for others again."""
    if (job := lease.held()) is not None:
        consoles.owner.parcels.forget(job)
        lease.release(body.why)
    return Response(status_code=204)


@router.get("/{worker}/objects/{key:path}", response_class=StreamingResponse, responses={200: {"content": {**BINARY}}})
def fetch_object(key: str, lease: InLease, consoles: InConsoles) -> StreamingResponse:
    """What the worker's job needs."""
    content = consoles.owner.parcels.fetch(lease.required(), Key.parse(key))
    headers = {"Content-Length": str(content.size)}
    return StreamingResponse(content.chunks, media_type="application/octet-stream", headers=headers)


@router.put("/{worker}/objects", status_code=204, openapi_extra={"requestBody": {"required": True, "content": BINARY}})
async def keep_objects(request: Request, lease: InLease, consoles: InConsoles) -> Response:
    """What the worker's job made, several small files in one request, kept in their order."""
    await run_in_threadpool(_keep_all, await request.body(), lease, consoles)
    return Response(status_code=204)


def _keep_all(data: bytes, lease: Lease, consoles: Consoles) -> None:
    pieces, parcels, job = unpack(data), consoles.owner.parcels, lease.required()
    require_disk(consoles.owner.settings.state)
    for text, content in pieces:
        key = Key.parse(text)
        parcels.require_writable(job, key, len(content))
        found = hashlib.sha256(content).hexdigest()
        parcels.keep(job, key, content, size=len(content), digest=found, lease=lease)


@router.put(
    "/{worker}/objects/{key:path}",
    status_code=204,
    openapi_extra={"requestBody": {"required": True, "content": BINARY}},
)
async def keep_object(key: str, request: Request, lease: InLease, consoles: InConsoles) -> Response:
    """What the worker's job made."""
    place, parcels, length = Key.parse(key), consoles.owner.parcels, request.headers.get("content-length", "")
    if not length:
        raise RunError("What is sent has to say how much it is.")
    job = await run_in_threadpool(lease.required)
    parcels.require_writable(job, place, int(length))
    require_disk(consoles.owner.settings.state)
    if not place.digest or int(length) <= SMALL:
        data = await request.body()
        found = hashlib.sha256(data).hexdigest()
        await run_in_threadpool(parcels.keep, job, place, data, size=len(data), digest=found, lease=lease)
        return Response(status_code=204)
    uploads = consoles.owner.settings.state / UPLOADS
    uploads.mkdir(exist_ok=True)
    try:
        with tempfile.NamedTemporaryFile(dir=uploads) as file:
            digest, size = hashlib.sha256(), 0
            async for chunk in request.stream():
                digest.update(chunk)
                size += len(chunk)
                await run_in_threadpool(file.write, chunk)
            file.flush()
            sent = File(file.name)
            await run_in_threadpool(parcels.keep, job, place, sent, size=size, digest=digest.hexdigest(), lease=lease)
    except OSError as error:
        raise RunError(f"The file cannot be kept: {error.strerror or error}.", hint="Free disk space.") from error
    return Response(status_code=204)


def _told(job: Job) -> schemas.Lease:
    return schemas.Lease(**{name: getattr(job, name) for name in schemas.Lease.model_fields})
