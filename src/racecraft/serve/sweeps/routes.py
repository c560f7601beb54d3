"""Sweeps: which of several settings is better, and which only lucky."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from racecraft.serve.context import InConsoles, InContext, InUser, TakesTurn
from racecraft.serve.sweeps.schemas import NewSweep, SweepCard, SweepDetail

router = APIRouter(prefix="/api/sweeps", tags=["sweeps"])

Name = Annotated[str, Path(max_length=64)]


@router.get("")
def list_sweeps(context: InContext) -> list[SweepCard]:
    """Sweeps, newest first."""
    return context.sweeps.cards()


@router.post("", status_code=202, dependencies=[TakesTurn])
def start_sweep(request: NewSweep, context: InContext, consoles: InConsoles, user: InUser) -> SweepDetail:
    """Train a table of settings with several seeds each."""

    def allow(count: int) -> None:
        consoles.quotas.require(user, "models", "places", "minutes", count=count)

    started = context.sweeps.start(request, allow=allow)
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


@router.post("/{name}/go-on", status_code=202, dependencies=[TakesTurn])
def resume_sweep(name: Name, context: InContext, consoles: InConsoles, user: InUser) -> SweepDetail:
    """Train what is not done yet."""
    found = context.sweeps.go_on(
        name, allow=lambda count: consoles.quotas.require(user, "places", "minutes", count=count)
    )
    context.supervisor.wake()
    return found


@router.delete("/{name}", status_code=204)
def delete_sweep(name: Name, context: InContext) -> Response:
    """Forget that its models belong together; they stay."""
    context.sweeps.remove(name)
    return Response(status_code=204)
