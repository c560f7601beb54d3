"""The console itself."""

from __future__ import annotations

import os

from fastapi import APIRouter, Response

from racecraft.serve.context import InConsoles, InContext, InUser, OnlyAdmin
from racecraft.serve.machine.machine import Console, Machine, describe_machine
from racecraft.serve.settings import OWNER
from racecraft.version import VERSION

router = APIRouter(prefix="/api", tags=["console"])


@router.get("/console")
def get_console(context: InContext, consoles: InConsoles, user: InUser) -> Console:
    """What this console is; where it lies on the disk is for who runs it."""
    runs = str(context.settings.runs) if user == OWNER else ""
    return Console(version=VERSION, runs=runs, cores=os.cpu_count() or 1, user=consoles.people.get(user).name)


@router.get("/console/machine", dependencies=[OnlyAdmin])
def get_machine(context: InContext) -> Machine:
    """Where its work is done and kept."""
    return describe_machine(context.settings)


@router.head("/health", status_code=204, include_in_schema=False)  # as many monitors ask
@router.get("/health", status_code=204)
def get_health(consoles: InConsoles) -> Response:
    """Whether the server works, for a supervisor, who needs no account: 204, and 503 where its database fails."""
    consoles.owner.database.answers()
    return Response(status_code=204)
