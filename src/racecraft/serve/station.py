"""Work for a console on another machine: `racecraft worker`, until Ctrl-C."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from racecraft.errors import ConfigError, RunError
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.office import AWAY, Office
from racecraft.serve.jobs.remote import ROOM, RemoteOffice
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.settings import LOOPBACK, ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.system import STOPS
from racecraft.version import VERSION

DEAF: Final = 2.0  # s before a server or a database that tells no news is asked again


def work_for(settings: ServeSettings, *, on_ready: Callable[[], None]) -> None:
    """Take jobs that travel from a console's queue until SIGINT or SIGTERM; what is under way is saved for another.

    Of the database it reads and changes the table of jobs only.

    Args:
        settings: Where runs lie while they are worked on, how many at once, and the console's database and store.
        on_ready: Called when both have answered.

    Raises:
        ConfigError: There is no database, no store, or no place for a job.
        RunError: One of them cannot be reached, or the console is of another version.
    """
    if not settings.database or not settings.artifacts:
        raise ConfigError(
            "A worker needs a console's server and a token, or its database and its object store.",
            hint="Give --server and --token-file, or --database and --artifacts as to 'racecraft serve'.",
        )
    access = Access.of(settings)
    with access.opened() as (office, database):
        assert database is not None
        database.require_current()
        Artifacts(settings.artifacts).names()
        _work(settings, office, access, on_ready)


def work_through(
    server: str, token_file: Path, settings: ServeSettings, *, on_ready: Callable[[], None], plain_http: bool = False
) -> None:
    """The same by nothing but a console's server and a token that its admin made for workers.

    Args:
        server: ``https://NAME`` or ``http://NAME:PORT``.
        token_file: Holds the token, and is read again when that has been replaced.
        settings: Where runs lie while they are worked on, and how many at once.
        on_ready: Called when the server has answered.
        plain_http: Whether the token may cross a network unencrypted.

    Raises:
        ConfigError: The address is none, the token would be seen, or there is none, or no place for a job.
        RunError: The server cannot be reached, does not know the token, or is of another version.
    """
    access = Access(server=server, token_file=str(token_file.absolute()))
    line = access.line
    parts = urlsplit(server)
    if parts.scheme != "https" and parts.hostname not in LOOPBACK and not plain_http:
        raise ConfigError(
            "The token would cross the network unencrypted.",
            hint="Give https://NAME, or say --plain-http in a network that you trust.",
        )
    found = line.ask("GET", ROOM)
    if not isinstance(found, dict) or found.get("version") != VERSION:
        said = str(found.get("version"))[:40] if isinstance(found, dict) else "of no version"
        raise RunError(
            f"The console is Racecraft {said}, this worker is {VERSION}.",
            hint="Install the same version of Racecraft on both machines.",
        )
    office = RemoteOffice(line)
    _work(settings, office, access, on_ready)


def _work(settings: ServeSettings, office: Office, access: Access, on_ready: Callable[[], None]) -> None:
    if settings.training_slots == settings.other_slots == 0:
        raise ConfigError("A worker without a place does nothing.", hint="Give --trainings or --others at least 1.")
    settings.state.mkdir(parents=True, exist_ok=True)
    supervisor = Supervisor(settings, office, access, is_home=False)
    # a daemon, as it may wait for an answer when everything else has ended
    threading.Thread(target=_hear, args=(office.listen, supervisor.wake), name="news", daemon=True).start()
    asyncio.run(_until_signalled(supervisor, on_ready))


def _hear(listen: Callable[[], None], wake: Callable[[], None]) -> None:
    """Look at the queue as soon as there is something new; in between it is looked at now and then as well."""
    while True:
        try:
            listen()
        except (*AWAY, RunError):  # nobody answers, or says no: whoever looks at the queue hears that, too
            time.sleep(DEAF)
        else:
            wake()


async def _until_signalled(supervisor: Supervisor, on_ready: Callable[[], None]) -> None:
    told = asyncio.Event()
    for number in STOPS:
        asyncio.get_running_loop().add_signal_handler(number, told.set)
    tending = asyncio.create_task(supervisor.run())
    on_ready()
    telling = asyncio.create_task(told.wait())
    await asyncio.wait((tending, telling), return_when=asyncio.FIRST_COMPLETED)
    for task in (tending, telling):
        task.cancel()
    try:
        with suppress(asyncio.CancelledError):
            await tending  # which ends by itself only where the console refuses this worker
    finally:
        await supervisor.stop()
