"""What every route works with; one per application."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from racecraft.serve.driving.drives import Drives
from racecraft.serve.driving.ghosts import Ghosts
from racecraft.serve.jobs.follower import Follower
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.races.races import Races
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.streams.hub import Hub
from racecraft.serve.tracks.courses import Courses
from racecraft.serve.tuning.tunings import Tunings


@dataclass(frozen=True)
class Context:
    """The parts of a running console."""

    settings: ServeSettings
    database: Database
    queue: JobQueue
    garage: Garage
    courses: Courses
    supervisor: Supervisor
    follower: Follower
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
