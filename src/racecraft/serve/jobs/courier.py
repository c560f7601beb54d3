"""Takes what a job needs and what it makes between the object store and the machine that works on it.

fetch ──▶ the job, meanwhile whatever is kept, and its cars while somebody elsewhere looks ──▶ deliver
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from racecraft.errors import RunError
from racecraft.run import RunFolder
from racecraft.run.lock import exclusive_lock
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.line import Refused
from racecraft.serve.jobs.queue import KINDS, folder_of
from racecraft.serve.live.cars import LiveReader
from racecraft.serve.settings import INCOMING, STATE_FOLDER
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.tables import Job

BEAT: Final = 0.25  # s between two looks
REST: Final = 2.0  # s until a store that did not answer is asked again
PATIENCE: Final = 120.0  # s for a store that does not answer, where nobody else has what was done


class Courier:
    """One for a job that travels.

    Args:
        artifacts: The store, of whose job it is.
        job: The job.
        runs: Folder of the runs of whose job it is, which need not be here yet.
        kept: File that changes whenever something is kept for good.
    """

    def __init__(self, artifacts: Artifacts, job: Job, runs: Path, *, kept: Path) -> None:
        self._cargo, self._runs, self._state = Cargo.from_dict(job.cargo), runs, runs / STATE_FOLDER
        self._store = artifacts
        folder = folder_of(job)
        if folder is None:
            self._filled, self._shelf, self._kept = RunFolder(runs / job.run), artifacts, kept
        else:
            shelf, name = folder
            self._filled, self._shelf = RunFolder(self._state / shelf / name), artifacts.shelf(shelf)
            self._kept = self._filled.path / (KINDS[job.kind].news or "-")
        self._live = LiveReader(runs / job.run) if folder is None else None
        self._is_ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.is_watched = False
        """Whether somebody looks, as the last heartbeat had it."""

    def fetch(self) -> dict[str, Path]:
        """Have all that the job needs here as new as it is anywhere, and begin to take along what comes of it.

        Returns:
            Where files lie here, by the paths that settings name.

        Raises:
            RunError: The store does not answer, or what it has is damaged.
        """
        for name in self._cargo.runs:
            self._bring(name)
        for path, digest in self._cargo.tracks.items():
            file = self._cargo.place_of_track(self._state, path)
            _patiently(lambda: self._store.bring_track(digest, file))  # noqa: B023 - called here and now
        if self._live is None:
            folder = self._filled.path
            folder.parent.mkdir(parents=True, exist_ok=True)
            _patiently(lambda: self._shelf.bring(folder.name, folder.parent, incoming=self._incoming, missing_ok=True))
        self._thread = threading.Thread(target=self._carry, name="courier", daemon=True)
        self._thread.start()
        return self._cargo.places(self._runs, self._state)

    def deliver(self) -> None:
        """Take all that was done to the store.

        Raises:
            RunError: The store does not answer, or another machine went on with the run.
        """
        self._is_ended.set()
        if self._thread is not None:
            self._thread.join()
        if self._filled.path.is_dir():
            _patiently(lambda: self._shelf.keep(self._filled))

    @property
    def _incoming(self) -> Path:
        return self._state / INCOMING

    def _bring(self, name: str) -> None:
        """A run; other jobs on this machine may want the same one now."""
        self._incoming.mkdir(parents=True, exist_ok=True)

        def brought() -> None:
            with exclusive_lock(self._incoming / f"{name}.lock"):
                self._store.bring(name, self._runs, incoming=self._incoming)

        _patiently(brought)

    def _carry(self) -> None:
        taken, wait = self._moment(), BEAT
        while not self._is_ended.wait(wait):
            wait = BEAT
            try:
                if (moment := self._moment()) != taken:
                    self._shelf.keep(self._filled)
                    taken = moment
                if self._live is not None and self.is_watched and (live := self._live.snapshot()):
                    self._store.show(self._filled.name, live)
            except RunError as error:  # the job goes on; what is missing is taken later
                logging.getLogger("racecraft.serve").error("%s", error)
                wait = REST

    def _moment(self) -> int:
        try:
            return self._kept.stat().st_mtime_ns
        except OSError:
            return 0


def _patiently(action: Callable[[], Any]) -> None:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            action()
            return
        except Refused:
            raise
        except RunError:
            if time.monotonic() > deadline:
                raise
            time.sleep(REST)
