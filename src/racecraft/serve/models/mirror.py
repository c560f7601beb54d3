"""Keeps the object store and the runs on disk alike: when the server starts, and when a run is made or removed."""

from __future__ import annotations

import logging
import os
import threading
from typing import Final

from racecraft.errors import RunError
from racecraft.run import RunFolder, list_runs
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts

_LOG = logging.getLogger("racecraft.serve")
FIRST_WAIT: Final = 2.0  # s until a store that does not answer is asked again
LONGEST_WAIT: Final = 60.0  # s


class Mirror:
    """What the server does with the store; copying is left to jobs. Without a store it does nothing.

    Args:
        artifacts: The store, or None.
        settings: Of the console.
        queue: Of jobs.
        supervisor: Is woken for a new job.
    """

    def __init__(
        self, artifacts: Artifacts | None, *, settings: ServeSettings, queue: JobQueue, supervisor: Supervisor
    ) -> None:
        self._artifacts, self._runs, self._incoming = artifacts, settings.runs, settings.incoming
        self._queue, self._supervisor = queue, supervisor
        self._is_ended = threading.Event()

    def start(self) -> None:
        """Make both alike, again and again until the store has answered; a thread's work, which `end` ends."""
        wait = FIRST_WAIT
        while not self._is_ended.is_set() and not self._align():
            self._is_ended.wait(wait)
            wait = min(2 * wait, LONGEST_WAIT)

    def end(self) -> None:
        """Stop asking a store that does not answer."""
        self._is_ended.set()

    def _align(self) -> bool:
        """Bring what is newer in the store, and copy the runs that changed since; False to try again."""
        if self._artifacts is None:
            return True
        is_whole = True
        try:
            here = {folder.name for folder in list_runs(self._runs)}
            for name in self._artifacts.names():
                if name in here or not (self._runs / name).exists():
                    is_whole &= self._bring(self._artifacts, name)
            for folder in list_runs(self._runs):
                if folder.name in here and not self._artifacts.is_current(folder):
                    self.copy(folder.name)
        except (RunError, OSError) as error:
            _LOG.error("%s %s", error, getattr(error, "hint", ""))
            return False
        return is_whole

    def share(self, folder: RunFolder, *, track: str = "") -> bool:
        """Have the store hold a run before there is a job about it; whether any machine can do that with what it holds.

        Args:
            folder: The run.
            track: Where it is to drive, if not on its own track.
        """
        if self._artifacts is None:
            return False
        info = folder.read_info()
        if any(os.sep in name for name in (info.track, track)) or info.settings.get("opponents"):
            return False  # files that only this machine has
        if not self._queue.is_travelling(folder.name):  # else who works on it copies it
            try:
                self._artifacts.keep(folder)
            except RunError as error:
                _LOG.error("%s %s", error, error.hint)
                return False
        return True

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

    def _bring(self, artifacts: Artifacts, name: str) -> bool:
        """Whether it is here now; the others are fetched all the same."""
        try:
            artifacts.bring(name, self._runs, incoming=self._incoming)
        except (RunError, OSError) as error:
            _LOG.error("%s cannot be fetched: %s", name, error)
            return False
        return True
