"""What has power is written down; and the log, for admins."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool

from racecraft.serve.audit.schemas import AuditLine
from racecraft.serve.context import SAFE, InLeague, InUser, OnlyAdmin

router = APIRouter(prefix="/api/audit", tags=["audit"])

POWERLESS: Final = ("submit", "enter_model")
"""Operations that change something, and of which the tables tell as much themselves."""


async def _write_down(request: Request, consoles: InLeague, user: InUser) -> AsyncIterator[None]:
    what: str = request.scope["route"].name
    if request.method in SAFE or what in POWERLESS:
        yield
        return
    number = await run_in_threadpool(consoles.audit.begin, user, what, request.url.path, await _sent(request))
    try:
        yield
    except Exception:
        await run_in_threadpool(consoles.audit.refused, number)
        raise
    await run_in_threadpool(consoles.audit.done, number)


async def _sent(request: Request) -> object:
    try:
        return json.loads(await request.body() or b"null")
    except (ValueError, RecursionError):
        return None


Audited = Depends(_write_down, scope="function")
"""Routers with this dependency have whatever they change written down, unless it is powerless."""


@router.get("", dependencies=[OnlyAdmin])
def read_audit(
    consoles: InLeague,
    count: Annotated[int, Query(ge=1, le=500)] = 100,
    before: Annotated[int | None, Query(ge=0, lt=2**31)] = None,
    name: Annotated[str, Query(max_length=64)] = "",
    what: Annotated[str, Query(max_length=64)] = "",
) -> list[AuditLine]:
    """Who did what with power and who came in or did not, newest first; of names and operations that hold a text."""
    return consoles.audit.latest(count, before=before, name=name, what=what)
