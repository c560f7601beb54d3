"""What a job is done with; the functions that do them stand in the rooms they are about, see `KINDS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecraft.errors import RunError
from racecraft.run import RunFolder
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job


@dataclass(frozen=True, kw_only=True)
class Task:
    """A job and what it may use."""

    job: Job
    runs: Path
    """Folder of the runs of whose job it is."""
    home: Path
    """Folder of the owner's runs, in whose state folder lies what is nobody's own."""
    database: Database | None
    """The console's, for what is done at home; a worker elsewhere may have none."""
    artifacts: Artifacts | None
    """Where runs are copied to."""
    on_stop: Callable[[Callable[[], None]], None]
    """Takes what to call when the job is to end early and be saved; without that it is just ended."""

    @property
    def own_database(self) -> Database:
        """The console's database, of a job that is done at home."""
        if self.database is None:
            raise RunError(f"Jobs of kind {self.job.kind!r} are done on the console's own machine.")
        return self.database

    @property
    def folder(self) -> RunFolder:
        """The run that the job is about."""
        return RunFolder.open(self.runs / self.job.run)
