"""Work for a console on another machine: `racecraft worker`, until Ctrl-C."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress

from racecraft.errors import ConfigError
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.system import STOPS


def work_for(settings: ServeSettings, *, on_ready: Callable[[], None]) -> None:
    """Take jobs that travel from a console's queue until SIGINT or SIGTERM; what is under way is saved for another.

    Of the database it reads and changes the table of jobs only.

    Args:
        settings: Where runs lie while they are worked on, how many at once, and the console's database and store.
        on_ready: Called when both have answered.

    Raises:
        ConfigError: There is no database or no store.
        RunError: One of them cannot be reached, or the console is of another version.
    """
    if not settings.database or not settings.artifacts:
        raise ConfigError(
            "A worker needs the console's database and its object store.",
            hint="Give both with --database and --artifacts, as to 'racecraft serve'.",
        )
    settings.state.mkdir(parents=True, exist_ok=True)
    database = Database(settings.database)
    database.require_current()
    Artifacts(settings.artifacts).names()
    supervisor = Supervisor(settings, database, JobQueue(database), is_home=False)
    asyncio.run(_until_signalled(supervisor, on_ready))
    database.close()


async def _until_signalled(supervisor: Supervisor, on_ready: Callable[[], None]) -> None:
    told = asyncio.Event()
    for number in STOPS:
        asyncio.get_running_loop().add_signal_handler(number, told.set)
    tending = asyncio.create_task(supervisor.run())
    on_ready()
    await told.wait()
    tending.cancel()
    with suppress(asyncio.CancelledError):
        await tending
    await supervisor.stop()
