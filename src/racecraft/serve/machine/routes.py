"""The console itself."""

from __future__ import annotations

import os

from fastapi import APIRouter

from racecraft.serve.context import InContext
from racecraft.serve.machine.machine import Console, Machine, describe_machine
from racecraft.serve.settings import version
from racecraft.serve.store.database import LOCAL_USER

router = APIRouter(prefix="/api/console", tags=["console"])


@router.get("")
def get_console(context: InContext) -> Console:
    """What this console is."""
    return Console(version=version(), runs=str(context.settings.runs), cores=os.cpu_count() or 1, user=LOCAL_USER)


@router.get("/machine")
def get_machine(context: InContext) -> Machine:
    """Where its work is done and kept."""
    return describe_machine(context.settings)
