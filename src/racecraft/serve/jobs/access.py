"""The way from a process that does jobs to where they are handed out, and to what they need.

a database and an object store       who works reaches both itself: the console, and workers that it trusts so far
a console's server and a token       everything through the server, which sees that it is about jobs of the token's
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from racecraft.serve.jobs.line import Line
from racecraft.serve.jobs.office import Office
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.remote import RemoteObjects, RemoteOffice
from racecraft.serve.settings import ARTIFACTS, DATABASE, SERVER, TOKEN_FILE, ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job


@dataclass(frozen=True, kw_only=True)
class Access:
    """One of the two ways."""

    database: str = ""
    """URL of the console's database."""
    artifacts: str = ""
    """URL of its object store, or empty where it has none."""
    server: str = ""
    """Address of its server."""
    token_file: str = ""
    """File that holds a token for that."""

    @classmethod
    def of(cls, settings: ServeSettings) -> Access:
        """That of who reaches database and store."""
        return cls(database=settings.database_url, artifacts=settings.artifacts)

    def environment(self) -> dict[str, str]:
        """For `from_environment` in a child; others can read a command line, and a password in it."""
        return {DATABASE: self.database, ARTIFACTS: self.artifacts, SERVER: self.server, TOKEN_FILE: self.token_file}

    @classmethod
    def from_environment(cls) -> Access:
        """What `environment` gave, which is not left there for what is started next."""
        database, artifacts, server, token_file = (
            os.environ.pop(name, "") for name in (DATABASE, ARTIFACTS, SERVER, TOKEN_FILE)
        )
        return cls(database=database, artifacts=artifacts, server=server, token_file=token_file)

    @cached_property
    def line(self) -> Line:
        """To the server."""
        return Line(self.server, Path(self.token_file))

    @contextmanager
    def opened(self) -> Iterator[tuple[Office, Database | None]]:
        """The office, and the database where that is reached."""
        if self.server:
            yield RemoteOffice(self.line), None
            return
        database = Database(self.database)
        yield JobQueue(database), database
        database.close()

    def artifacts_of(self, job: Job, owner: str) -> Artifacts | None:
        """The store for a job that this owner has; None where there is none."""
        if self.server:
            return Artifacts(RemoteObjects(self.line, owner))
        return Artifacts(self.artifacts).of(job.user_id) if self.artifacts else None
