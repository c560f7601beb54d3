"""One server of a league at a time: what it counts in memory, such as wrong passwords, two would count twice.

SQLite      a lock of the operating system on a file beside the database; the system drops it with the process
PostgreSQL  an advisory lock, which the database drops with the connection, from whatever machine and folder it came
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError

from racecraft.errors import InUse, RunError
from racecraft.run.lock import exclusive_lock
from racecraft.serve.store.database import SQLITE, Database

PATIENCE: Final = 30.0
"""s that a new server waits for one that stops: its trainings are saved meanwhile, for 20 s at most."""
GLANCE: Final = 0.2  # s between two tries
WATCH: Final = 5.0  # s between two looks whether PostgreSQL still knows of us
SERVER: Final = 0x7261636573657276
"""PostgreSQL's lock: who holds it is the league's server."""
# A machine that lost its power says no goodbye: half a minute later its place is free, not two hours later.
_SETTINGS: Final = ("tcp_keepalives_idle = 10", "tcp_keepalives_interval = 5", "tcp_keepalives_count = 4")


@contextmanager
def sole_server(url: str, *, on_loss: Callable[[], None], patience: float = PATIENCE) -> Iterator[None]:
    """Be a database's only server while the block runs.

    Args:
        url: Of the database.
        on_loss: Is called, from a thread, if another server has taken the place: the connection to PostgreSQL was lost.
        patience: Seconds to wait for another server, which may be stopping.

    Raises:
        RunError: Another one is running still, or the database cannot be asked.
    """
    with ExitStack() as stack:
        if url.startswith(SQLITE):
            path = Path(url.removeprefix(SQLITE)).resolve()
            path.parent.mkdir(parents=True, exist_ok=True)
            _wait(lambda: _locked(stack, path.with_name(f"{path.name}.server")), patience)
        else:
            place = _Place(url, on_loss)
            stack.callback(place.close)
            _wait(place.take, patience)
            place.watcher.start()
        yield


def _wait(is_ours: Callable[[], bool], patience: float) -> None:
    until = time.monotonic() + patience
    while not is_ours():
        if time.monotonic() > until:
            raise RunError(
                "Another server of this league is running on the same database.",
                hint="Stop it first; quotas and wrong passwords are counted in one server, and more machines that work "
                "join with racecraft worker.",
            )
        time.sleep(GLANCE)


def _locked(stack: ExitStack, path: Path) -> bool:
    try:
        stack.enter_context(exclusive_lock(path))
    except InUse:
        return False
    return True


class _Place:
    """PostgreSQL's lock, on a connection of its own."""

    def __init__(self, url: str, on_loss: Callable[[], None]) -> None:
        self._database, self._on_loss = Database(url), on_loss
        self._connection: sa.Connection | None = None
        self._ended = threading.Event()
        self.watcher = threading.Thread(target=self._watch, name="sole", daemon=True)

    def take(self) -> bool:
        """Whether it is ours now.

        Raises:
            RunError: The database cannot be asked.
        """
        try:
            return self._take()
        except SQLAlchemyError as error:
            reason = str(getattr(error, "orig", None) or error).splitlines()[0]
            raise RunError(f"The console's database cannot be opened: {reason}.") from error

    def _take(self) -> bool:
        if self._connection is None:
            self._connection = self._database.engine.connect().execution_options(isolation_level="AUTOCOMMIT")
            for setting in _SETTINGS:
                self._connection.exec_driver_sql(f"SET {setting}")
        return bool(self._connection.scalar(sa.text("SELECT pg_try_advisory_lock(:lock)"), {"lock": SERVER}))

    def _watch(self) -> None:
        """Notice that the connection is gone, and the lock with it, and take both again, until `close`."""
        while not self._ended.wait(WATCH):
            try:
                if self._connection is not None:
                    self._connection.exec_driver_sql("SELECT 1")
                elif not self._take():
                    logging.getLogger("racecraft.serve").error("Another server has taken this league's place.")
                    self._on_loss()
                    return
            except SQLAlchemyError:  # it is being restarted; what asks it says so
                self._forget()

    def _forget(self) -> None:
        if self._connection is not None:
            self._connection.invalidate()
            self._connection.close()
            self._connection = None

    def close(self) -> None:
        """Let others have it."""
        self._ended.set()
        if self.watcher.is_alive():
            self.watcher.join(WATCH)
        self._forget()
        self._database.close()
