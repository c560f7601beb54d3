"""Keeps the object store and the runs on disk alike: when the server starts, and when a run is made or removed."""

from __future__ import annotations

import logging
from pathlib import Path

from racecraft.errors import RunError
from racecraft.run import list_runs
from racecraft.serve.artifacts import Artifacts
from racecraft.serve.jobs import JobQueue
from racecraft.serve.supervisor import Supervisor

_LOG = logging.getLogger("racecraft.serve")


class Mirror:
    """What the server does with the store; copying is left to jobs. Without a store it does nothing.

    Args:
        artifacts: The store, or None.
        runs: Folder of the runs.
        state: The console's own folder.
        queue: Of jobs.
        supervisor: Is woken for a new job.
    """

    def __init__(
        self, artifacts: Artifacts | None, *, runs: Path, state: Path, queue: JobQueue, supervisor: Supervisor
    ) -> None:
        self._artifacts, self._runs, self._state = artifacts, runs, state
        self._queue, self._supervisor = queue, supervisor

    def start(self) -> None:
        """Fetch the runs that are only in the store, and copy those that changed since they were copied."""
        if self._artifacts is None:
            return
        try:
            here = {folder.name for folder in list_runs(self._runs)}
            for name in self._artifacts.names():
                if name not in here and not (self._runs / name).exists():
                    self._fetch(self._artifacts, name)
            for folder in list_runs(self._runs):
                if folder.name in here and not self._artifacts.is_current(folder):
                    self.copy(folder.name)
        except (RunError, OSError) as error:
            _LOG.error("%s %s", error, getattr(error, "hint", ""))

    def copy(self, name: str) -> None:
        """A run is new or has changed, and there is no other job that copies it at its end."""
        if self._artifacts is not None and not self._queue.is_busy(name):
            self._queue.add("store", name, {})
            self._supervisor.wake()

    def forget(self, name: str) -> None:
        """A run is no longer there."""
        if self._artifacts is not None:
            try:
                self._artifacts.forget(name)
            except RunError as error:
                _LOG.error("%s stays in the store: %s", name, error)

    def _fetch(self, artifacts: Artifacts, name: str) -> None:
        try:
            artifacts.fetch(name, self._runs, incoming=self._state / "incoming")
        except (RunError, OSError) as error:  # the others are fetched all the same
            _LOG.error("%s cannot be fetched: %s", name, error)
