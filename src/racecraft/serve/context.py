"""What every route works with: the parts of a console, in a league one console for each person."""

from __future__ import annotations

import threading
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Depends, Request
from fastapi.concurrency import run_in_threadpool

from racecraft.serve.audit.audit import Audit
from racecraft.serve.comments.comments import Comments
from racecraft.serve.contests.contests import Contests
from racecraft.serve.desks import Desks
from racecraft.serve.driving.drives import Drives
from racecraft.serve.driving.ghosts import Ghosts
from racecraft.serve.finals.finals import Finals
from racecraft.serve.groups.groups import Groups
from racecraft.serve.jobs.follower import Follower
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.people.devices import Devices
from racecraft.serve.people.identities import Identities
from racecraft.serve.people.keys import Keys
from racecraft.serve.people.people import People, Person
from racecraft.serve.people.tries import Tries
from racecraft.serve.problems import NotFound
from racecraft.serve.provider_settings import ProviderSettings
from racecraft.serve.quotas.quotas import Quotas
from racecraft.serve.races.races import Races
from racecraft.serve.settings import OWNER, ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.streams.hub import Hub
from racecraft.serve.submissions.entries import Entries
from racecraft.serve.submissions.league import League
from racecraft.serve.sweeps.sweeps import Sweeps
from racecraft.serve.tracks.courses import Courses
from racecraft.serve.tuning.tunings import Tunings
from racecraft.serve.workers.leases import Leases
from racecraft.serve.workers.parcels import Parcels

if TYPE_CHECKING:
    from racecraft.serve.provider.provider import Provider

SAFE: Final = ("GET", "HEAD")


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
    contests: Contests
    tunings: Tunings
    sweeps: Sweeps
    mirror: Mirror
    hub: Hub
    leases: Leases
    parcels: Parcels


class Consoles:
    """A console for each person: the same rooms over folders and jobs of their own.

    Args:
        owner: Of who started the server.
        keys: What opens the door.
    """

    def __init__(self, owner: Context, keys: Keys) -> None:
        self.owner, self.keys = owner, keys
        told = owner.settings.provider
        self.people, self.groups = People(owner.database), Groups(owner.database, issuer=told.issuer if told else "")
        self.identities = Identities(owner.database)
        self._provider = _provider(told) if told is not None else None
        self.quotas = Quotas(owner.database, owner.settings.runs)
        self.audit, self.devices = Audit(owner.database), Devices()
        self.league = League(owner.database, self._courses)
        self.entries = Entries(owner.database, owner.settings.state, self._courses, self.league)
        self.comments = Comments(owner.database)
        self.finals = Finals(owner.database, owner.settings.state, self._courses, self.league)
        self._others: dict[int, Context] = {}
        self._lock = threading.Lock()

    def of(self, user_id: int) -> Context:
        """Somebody's console."""
        if user_id == OWNER:
            return self.owner
        with self._lock:
            if user_id not in self._others:
                self._others[user_id] = _console(self.owner, user_id)
            return self._others[user_id]

    @cached_property
    def tries(self) -> Tries:
        """How often somebody may try to get in."""
        return Tries()

    @cached_property
    def desks(self) -> Desks:
        """Where requests that compute take a place."""
        return Desks()

    @cached_property
    def uploads(self) -> Desks:
        """Where large files arrive."""
        return Desks()

    @cached_property
    def imports(self) -> Desks:
        """Where archives arrive, which may be larger and take longer."""
        return Desks()

    @property
    def provider(self) -> Provider:
        """Through whom people sign in.

        Raises:
            NotFound: Through nobody.
        """
        if self._provider is None:
            raise NotFound("Nobody signs in through a provider here.")
        return self._provider

    def _courses(self, user_id: int) -> Courses:
        return self.of(user_id).courses

    def forget(self, user_id: int) -> None:
        """Somebody is gone."""
        with self._lock:
            self._others.pop(user_id, None)


def _provider(settings: ProviderSettings) -> Provider:
    from racecraft.serve.provider.provider import Provider  # leagues without one do without

    return Provider(settings)


def _console(owner: Context, user_id: int) -> Context:
    settings, database, queue = owner.settings.of(user_id), owner.database, owner.queue.of(user_id)
    settings.tracks.mkdir(parents=True, exist_ok=True)
    garage = Garage(settings.runs, settings.state, database, user_id=user_id)
    courses, mirror = Courses(settings.tracks), owner.mirror.of(settings, queue)
    heats = Contests(settings.state, database, queue, garage, courses, mirror=mirror)
    return replace(
        owner,
        settings=settings,
        queue=queue,
        garage=garage,
        courses=courses,
        ghosts=Ghosts(settings.runs, database),
        races=Races(
            database,
            queue,
            garage,
            courses,
            share=mirror.share,
            see=owner.follower.see,
            replays=heats.replays,
            user_id=user_id,
        ),
        contests=heats,
        tunings=Tunings(settings.state, queue, garage, mirror=mirror, see=owner.follower.see),
        sweeps=Sweeps(queue, garage, courses, mirror=mirror, see=owner.follower.see),
        mirror=mirror,
        hub=Hub(settings.runs, queue, see=owner.follower.see),
    )


# What nearly every route is given takes the request alone, as each step on the way to it is built for each route when
# the server starts, and does not wait: what may wait runs in a thread, which costs more than it does.
async def _consoles(request: Request) -> Consoles:
    consoles: Consoles = request.app.state.consoles
    return consoles


async def _user(request: Request) -> int:
    user: int = request.state.user_id
    return user


def _asked(request: Request) -> tuple[Consoles, int]:
    return request.app.state.consoles, request.state.user_id


InConsoles = Annotated[Consoles, Depends(_consoles)]
"""A route's parameter of this type is given everybody's consoles."""

InUser = Annotated[int, Depends(_user)]
"""A route's parameter of this type is given the id of who asks."""


async def _context(request: Request) -> Context:
    """The console of who asks; with ``?of=NUMBER`` an organiser looks, and only looks, at that of a group's member."""
    (consoles, user), of = _asked(request), request.query_params.get("of")
    if of is None or not consoles.owner.settings.league:
        return consoles.of(user)
    member = int(of) if of.isascii() and of.isdigit() and len(of) < 10 else 0
    if request.method not in SAFE or not (
        member == user or await run_in_threadpool(consoles.groups.may_look, user, member)
    ):
        raise NotFound(f"There is nobody with the number {of[:10]} whom you may look at.")
    return consoles.of(member)


async def _league(request: Request) -> Consoles:
    consoles: Consoles = request.app.state.consoles
    if not consoles.owner.settings.league:
        raise NotFound("This console is one person's; accounts begin with racecraft serve --league.")
    return consoles


InLeague = Annotated[Consoles, Depends(_league)]
"""The same, only in a league."""


def _person(request: Request, consoles: InLeague) -> Person:
    return consoles.people.get(request.state.user_id)


def _admin(request: Request) -> None:
    consoles, user = _asked(request)
    if consoles.people.get(user).role != "admin":
        raise NotFound("Only whoever holds the league sees this.")


OnlyAdmin = Depends(_admin)
"""A route with this dependency exists for admins only; alone at the console everybody is one."""


async def _takes_turn(request: Request) -> AsyncIterator[None]:
    consoles, user = _asked(request)
    async with consoles.quotas.turn(user):
        yield


TakesTurn = Depends(_takes_turn)
"""A route with this dependency waits until earlier ones of those who share a quota are done, so that it holds."""


def _makes_model(request: Request, turn: Annotated[None, TakesTurn]) -> None:
    consoles, user = _asked(request)
    consoles.quotas.require(user, "models")


def _takes_place(request: Request, turn: Annotated[None, TakesTurn]) -> None:
    consoles, user = _asked(request)
    consoles.quotas.require(user, "places")


def _trains(request: Request, turn: Annotated[None, TakesTurn]) -> None:
    consoles, user = _asked(request)
    consoles.quotas.require(user, "places", "minutes")


async def _computes(request: Request) -> AsyncIterator[None]:
    consoles, user = _asked(request)
    async with consoles.desks.place(user):
        yield


async def _asks_provider(consoles: InLeague) -> AsyncIterator[None]:
    async with consoles.provider.place():
        yield


AsksProvider = Depends(_asks_provider)
"""A route with this dependency asks the provider, and waits until there is a place to."""
Computes = Depends(_computes)
"""A route with this dependency takes a thread for a while: somebody's follow one another, two at a time."""
MakesModel = Depends(_makes_model)
"""A route with this dependency makes a model, where its quota lets somebody."""
TakesPlace = Depends(_takes_place)
"""The same for a job."""
Trains = Depends(_trains)
"""The same for a training."""

InContext = Annotated[Context, Depends(_context)]
"""A route's parameter of this type is given the parts of a console: one's own."""

InPerson = Annotated[Person, Depends(_person)]
"""A route's parameter of this type is given who asks; only in a league."""
