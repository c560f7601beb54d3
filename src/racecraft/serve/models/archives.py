"""Models as files: an archive or a reward function becomes a model, a model becomes an archive."""

from __future__ import annotations

import asyncio
import re
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Final

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse

from racecraft.errors import RunError, SourceError, TrackNotFound
from racecraft.run import archive_chunks
from racecraft.run.folder import sanitize_name
from racecraft.serve.context import Context, InConsoles, InContext, InUser
from racecraft.serve.models.schemas import ImportedModel
from racecraft.serve.problems import Conflict
from racecraft.serve.schemas import RunName
from racecraft.serve.settings import PEOPLE, STATE_FOLDER, ServeSettings

router = APIRouter(prefix="/api/models", tags=["archives"])

ENDINGS: Final = (".tar.gz", ".tgz", ".tar", ".zip", ".gz", ".py")
"""``.gz`` alone is what a browser makes of a second download: ``model.tar(1).gz``."""
UPLOADS: Final = "uploads"  # inside the state folder
ABANDONED: Final = 3600.0  # s without a byte after which an upload is one of a server that was killed
ARRIVES_S: Final = 1800.0
"""A gigabyte at 5 Mbit/s; who sends a byte now and then keeps no part of the disk for longer."""
RESERVE: Final = 1_000_000_000  # bytes of the disk that uploads leave to everybody else


@router.post(
    "/import",
    status_code=201,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def import_model(
    filename: str,
    request: Request,
    context: InContext,
    consoles: InConsoles,
    user: InUser,
    name: RunName | None = None,
    track: str = "",
) -> ImportedModel:
    """A model from an archive of DeepRacer, deepracer-for-cloud or Racecraft, or from a reward function's file.

    The request's body is the file. Nothing in it is run; the reward function is only read, and tried in its sandbox.
    """
    plain = _plain(filename)
    await run_in_threadpool(consoles.quotas.require, user, "models")
    if name is not None:
        context.garage.require_new(name)
    uploads = context.settings.state / UPLOADS
    uploads.mkdir(exist_ok=True)
    async with consoles.imports.place(user):  # a few at a time, or slow ones of one person would fill the disk
        place = Path(tempfile.mkdtemp(dir=uploads))
        try:
            await _take_in(request, place / plain)
            async with consoles.quotas.turn(user):  # not before: a body may take minutes to come
                await run_in_threadpool(consoles.quotas.require, user, "models")
                return await run_in_threadpool(_import, context, place / plain, name, track)
        except TimeoutError as error:
            raise RunError(f"The file took more than {ARRIVES_S:.0f} s to arrive.", hint="Send it again.") from error
        except OSError as error:
            raise RunError(f"The file cannot be kept: {error.strerror or error}.", hint="Free disk space.") from error
        finally:
            await run_in_threadpool(shutil.rmtree, place, ignore_errors=True)


async def _take_in(request: Request, path: Path) -> None:
    """Write what comes, as it comes.

    Raises:
        TimeoutError: It took too long.
        Conflict: Little is left of the disk.
    """
    with path.open("xb") as file:
        async with asyncio.timeout(ARRIVES_S):
            async for chunk in request.stream():
                require_disk(path.parent)
                await run_in_threadpool(file.write, chunk)


def remove_abandoned_uploads(settings: ServeSettings) -> None:
    """Clear away uploads that killed servers left, not those that another one on the same folder is taking in."""
    before = time.time() - ABANDONED
    for state in (settings.state, *settings.state.glob(f"{PEOPLE}/*/{STATE_FOLDER}")):
        for path in state.glob(f"{UPLOADS}/*"):
            with suppress(OSError):  # its server has just removed it
                if max(part.stat().st_mtime for part in (path, *path.glob("*"))) < before:
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


def require_disk(folder: Path) -> None:
    """Refuse to write more where little is left.

    Raises:
        Conflict: It is.
    """
    free = shutil.disk_usage(folder).free
    if free < RESERVE:
        raise Conflict(
            f"The server's disk is nearly full: {free / 1e9:.1f} GB are left, {RESERVE / 1e9:.0f} GB have to be.",
            hint="Delete what is no longer needed, or ask whoever runs the server.",
        )


@router.get(
    "/{name}/archive",
    response_class=StreamingResponse,
    responses={200: {"content": {"application/gzip": {"schema": {"type": "string", "format": "binary"}}}}},
)
def export_model(name: str, context: InContext) -> StreamingResponse:
    """A model as one tar.gz in AWS's layout, with its weights."""
    folder = context.garage.folder(name)
    headers = {"Content-Disposition": f'attachment; filename="{folder.name}.tar.gz"'}
    return StreamingResponse(archive_chunks(folder), media_type="application/gzip", headers=headers)


def _import(context: Context, path: Path, name: str | None, track: str) -> ImportedModel:
    from racecraft.importing import import_run  # takes a second to load, and the console has to be there at once

    where = context.courses.path_or_name(track) if track else ""
    if name is None and path.stem != "reward_function":
        stem = path.name.removesuffix(next(ending for ending in ENDINGS if path.name.endswith(ending)))
        name = stem if stem == sanitize_name(stem) and not (context.garage.runs / stem).exists() else None
    try:
        report = import_run(path, root=context.garage.runs, name=name, track=where)
    except TrackNotFound as error:
        error.hint = "Choose a track for it."
        raise
    context.mirror.copy(report.run.name)
    return ImportedModel(
        model=context.garage.card(report.run.name),
        kind=report.kind,
        used=report.used,
        unused=report.unused,
        unknown=report.unknown,
        notes=report.notes,
    )


def _plain(filename: str) -> str:
    """A name of ours for what is uploaded, with the ending of theirs."""
    base = PurePosixPath(filename.replace("\\", "/")).name
    ending = next((ending for ending in ENDINGS if base.lower().endswith(ending)), None)
    if ending is None:
        raise SourceError(
            f"{base[:80]!r} is not of a kind that can be imported; allowed are {', '.join(ENDINGS)}.",
            hint="Pack the model's folder into a tar.gz or zip.",
        )
    stem = re.sub(r"[^A-Za-z0-9._-]+", "-", base[: -len(ending)]).strip("-._")[:60]
    return (stem or "model") + ending
