"""Sweeps: which of several settings is better, and which only lucky."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from racecraft.serve.context import InContext
from racecraft.serve.sweeps.schemas import NewSweep, SweepCard, SweepDetail

router = APIRouter(prefix="/api/sweeps", tags=["sweeps"])

Name = Annotated[str, Path(max_length=64)]


@router.get("")
def list_sweeps(context: InContext) -> list[SweepCard]:
    """Sweeps, newest first."""
    return context.sweeps.cards()


@router.post("", status_code=202)
def start_sweep(request: NewSweep, context: InContext) -> SweepDetail:
    """Train a table of settings with several seeds each."""
    started = context.sweeps.start(request)
    context.supervisor.wake()
    return started


@router.get("/{name}")
def get_sweep(name: Name, context: InContext) -> SweepDetail:
    """A sweep with its leaderboard."""
    return context.sweeps.get(name)


@router.post("/{name}/stop", status_code=202)
def stop_sweep(name: Name, context: InContext) -> SweepDetail:
    """End what is under way; it is saved."""
    return context.sweeps.stop(name)


@router.post("/{name}/go-on", status_code=202)
def resume_sweep(name: Name, context: InContext) -> SweepDetail:
    """Train what is not done yet."""
    found = context.sweeps.go_on(name)
    context.supervisor.wake()
    return found


@router.delete("/{name}", status_code=204)
def delete_sweep(name: Name, context: InContext) -> Response:
    """Forget that its models belong together; they stay."""
    context.sweeps.remove(name)
    return Response(status_code=204)
