"""What every route works with; one per application."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from racecraft.serve.courses import Courses
from racecraft.serve.database import Database
from racecraft.serve.drives import Drives
from racecraft.serve.garage import Garage
from racecraft.serve.ghosts import Ghosts
from racecraft.serve.hub import Hub
from racecraft.serve.jobs import JobQueue
from racecraft.serve.mirror import Mirror
from racecraft.serve.races import Races
from racecraft.serve.settings import ServeSettings
from racecraft.serve.supervisor import Supervisor
from racecraft.serve.tunings import Tunings


@dataclass(frozen=True)
class Context:
    """The parts of a running console."""

    settings: ServeSettings
    database: Database
    queue: JobQueue
    garage: Garage
    courses: Courses
    supervisor: Supervisor
    drives: Drives
    ghosts: Ghosts
    races: Races
    tunings: Tunings
    mirror: Mirror
    hub: Hub


def _context(request: Request) -> Context:
    context: Context = request.app.state.context
    return context


def _user(request: Request) -> int:
    user: int = request.state.user_id
    return user


InContext = Annotated[Context, Depends(_context)]
"""A route's parameter of this type is given the console's parts."""

InUser = Annotated[int, Depends(_user)]
"""A route's parameter of this type is given the id of who asks."""
