"""A console without a free place: what it is asked for waits, and can be looked at while it does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import sqlalchemy as sa
from running_consoles import RunningConsole

from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job


@contextmanager
def full(console: RunningConsole, kind: str) -> Iterator[None]:
    """The only place for jobs of this kind, and of those that share it, is taken; on SQLite."""
    database = Database(f"sqlite:///{console.runs / '.racecraft' / 'console.db'}")
    home = ServeSettings(runs=console.runs).machine
    with database.transaction() as session:
        session.add(Job(id="busy", kind=kind, run="", state="running", owner="nobody", machine=home))
    try:
        yield
    finally:
        with database.transaction() as session:
            session.execute(sa.delete(Job).where(Job.id == "busy"))
        database.close()
