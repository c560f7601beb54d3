"""The console's server: an application that guards its door, answers below /api and hands out the pages."""

from __future__ import annotations

import asyncio
import logging
import secrets
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse, Response
from sqlalchemy.exc import SQLAlchemyError

from racecraft.serve import replies, tab
from racecraft.serve.audit import routes as audit
from racecraft.serve.comments import routes as comments
from racecraft.serve.compression import Compressed, accepts, gzipped
from racecraft.serve.contests import routes as contests
from racecraft.serve.contests.contests import Contests
from racecraft.serve.context import Consoles, Context
from racecraft.serve.door import routes as door
from racecraft.serve.door.guard import Guard, content_policy
from racecraft.serve.driving import routes as drives
from racecraft.serve.driving.drives import Drives
from racecraft.serve.driving.ghosts import Ghosts
from racecraft.serve.evaluations import analysis, beliefs
from racecraft.serve.evaluations import routes as evaluations
from racecraft.serve.finals import routes as finals
from racecraft.serve.groups import routes as groups
from racecraft.serve.jobs import routes as jobs
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.follower import Follower
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.lessons import routes as lessons
from racecraft.serve.machine import routes as console
from racecraft.serve.models import archives, choices, exports
from racecraft.serve.models import routes as models
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.people import routes as account
from racecraft.serve.people.keys import Keys
from racecraft.serve.provider import routes as provider
from racecraft.serve.quotas import routes as quotas
from racecraft.serve.races import routes as races
from racecraft.serve.races.races import Races
from racecraft.serve.rewards import routes as rewards
from racecraft.serve.schemas import ProblemReply
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.streams import routes as events
from racecraft.serve.streams.hub import Hub
from racecraft.serve.submissions import routes as league
from racecraft.serve.sweeps import routes as sweeps
from racecraft.serve.sweeps.sweeps import Sweeps
from racecraft.serve.tracks import routes as tracks
from racecraft.serve.tracks.courses import Courses
from racecraft.serve.tuning import routes as tunings
from racecraft.serve.tuning.tunings import Tunings
from racecraft.serve.workers import routes as workers
from racecraft.serve.workers.leases import Leases
from racecraft.serve.workers.parcels import Parcels
from racecraft.version import VERSION

PAGES: Final = Path(__file__).parent / "pages"
"""The built web client, part of the package."""
KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".woff2": "font/woff2"}


COUNT: Final = 5.0  # s between two looks at who has trained enough for a day
CHECK: Final = 0.5  # s between two looks whether who has jobs by a token still may


async def _again(action: Callable[[], None], *, every: float, what: str) -> None:
    while True:
        await asyncio.sleep(every)
        try:
            await asyncio.to_thread(action)
        except SQLAlchemyError as error:  # the database is being restarted
            logging.getLogger("racecraft.serve").error("%s cannot be read: %s", what, str(error).splitlines()[0])


def _looks(consoles: Consoles) -> list[Coroutine[Any, Any, None]]:
    """What a league looks at now and then."""
    if not consoles.owner.settings.league:
        return []
    leases, keys = consoles.owner.leases, consoles.keys
    return [
        _again(consoles.quotas.end_what_is_over, every=COUNT, what="Quotas"),
        _again(partial(leases.end_without_token, keys), every=CHECK, what="Tokens"),
    ]


def create_app(settings: ServeSettings, *, hosts: set[str]) -> FastAPI:
    """The application; `app.state.guard.ticket()` opens its door once.

    Args:
        settings: Of the console.
        hosts: Names with ports that it may be called by.

    Raises:
        RunError: A folder or the database cannot be opened.
    """
    settings.state.mkdir(parents=True, exist_ok=True)
    settings.tracks.mkdir(exist_ok=True)
    archives.remove_abandoned_uploads(settings)
    database = Database(settings.database_url)
    database.migrate()
    queue = JobQueue(database)
    garage, courses = Garage(settings.runs, settings.state, database), Courses(settings.tracks)
    supervisor = Supervisor(settings, queue, Access.of(settings))
    artifacts = Artifacts(settings.artifacts) if settings.artifacts else None
    follower = Follower(artifacts, settings=settings, queue=queue)
    mirror = Mirror(artifacts, settings=settings, queue=queue, supervisor=supervisor)
    heats = Contests(settings.state, database, queue, garage, courses, mirror=mirror)
    context = Context(
        settings=settings,
        database=database,
        queue=queue,
        garage=garage,
        courses=courses,
        supervisor=supervisor,
        follower=follower,
        drives=Drives(),
        ghosts=Ghosts(settings.runs, database),
        races=Races(database, queue, garage, courses, share=mirror.share, see=follower.see, replays=heats.replays),
        contests=heats,
        tunings=Tunings(settings.state, queue, garage, mirror=mirror, see=follower.see),
        sweeps=Sweeps(queue, garage, courses, mirror=mirror, see=follower.see),
        mirror=mirror,
        hub=Hub(settings.runs, queue, see=follower.see),
        leases=Leases(database, queue),
        parcels=Parcels(artifacts),
    )

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        tending = asyncio.create_task(context.supervisor.run())
        looking = [asyncio.create_task(look) for look in _looks(app.state.consoles)]
        for name, work in (("mirror", context.mirror.start), ("follower", follower.run)):
            threading.Thread(target=work, name=name, daemon=True).start()
        yield
        context.mirror.end()
        follower.end()
        for look in looking:
            look.cancel()
        tending.cancel()
        with suppress(asyncio.CancelledError):
            await tending
        await context.supervisor.stop()
        database.close()

    app = FastAPI(
        title="Racecraft",
        version=VERSION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url="/api/openapi.json",
        responses={422: {"model": ProblemReply, "description": "What is wrong with the request"}},
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.context = context
    keys = Keys(database)
    app.state.consoles = Consoles(context, keys)
    app.state.guard = guard = Guard(keys, settings, hosts)
    app.add_middleware(Compressed)  # behind the guard, which stands before everything
    app.add_middleware(guard.middleware)
    replies.install(app)
    parts = [console, tracks, drives, rewards, choices, archives, exports, models]
    parts += [evaluations, analysis, beliefs, tunings, sweeps, races]
    parts += [contests, jobs, events, door, provider, audit, lessons, workers]
    for part in parts:
        app.include_router(part.router)
    for part in (account, groups, comments, league, finals, quotas):
        app.include_router(part.router, dependencies=[audit.Audited])

    @app.get("/assets/{name}", include_in_schema=False)
    def asset(name: str, request: Request) -> Response:
        path = PAGES / "assets" / name
        if "/" in name or path.suffix not in KINDS or not path.is_file():
            return replies.problem(404, "NotFound", f"There is no file {name[:80]!r}.")
        headers = {"Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}
        kind = KINDS[path.suffix]
        if kind != "font/woff2" and accepts(request.headers.get("accept-encoding", ""), "gzip"):
            return Response(gzipped(path), media_type=kind, headers={**headers, "Content-Encoding": "gzip"})
        return FileResponse(path, media_type=kind, headers=headers)

    tab.offer(app)
    rooms = "league" if settings.league else "console"

    @app.get("/{path:path}", include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        if path == "api" or path.startswith("api/"):
            return replies.problem(404, "NotFound", f"There is nothing at /{path[:80]}.")
        supervisor.expect()
        nonce = secrets.token_urlsafe(16)
        try:
            text = (PAGES / "index.html").read_text(encoding="utf-8")
        except OSError:
            text = "<!doctype html><title>Racecraft</title><p>The pages are not built. Run <code>make console</code>."
        return HTMLResponse(
            text.replace("__NONCE__", nonce).replace("__ROOMS__", rooms),
            headers={"Content-Security-Policy": content_policy(nonce), "Cache-Control": "no-store"},
        )

    return app
