"""Takes a run between the object store and the machine that works on it.

fetch ──▶ the job, meanwhile every checkpoint, and its cars while somebody elsewhere looks ──▶ deliver
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
from racecraft.serve.live.cars import LiveReader
from racecraft.serve.store.artifacts import Artifacts

BEAT: Final = 0.25  # s between two looks
REST: Final = 2.0  # s until a store that did not answer is asked again
PATIENCE: Final = 120.0  # s for a store that does not answer, where nobody else has what was done


class Courier:
    """One for a job that travels.

    Args:
        artifacts: The store.
        folder: The run, which need not be here yet.
        incoming: Folder on the same disk where it is put together.
        kept: File that changes whenever something is kept for good.
    """

    def __init__(self, artifacts: Artifacts, folder: RunFolder, *, incoming: Path, kept: Path) -> None:
        self._artifacts, self._folder, self._incoming, self._kept = artifacts, folder, incoming, kept
        self._live = LiveReader(folder.path)
        self._is_ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.is_watched = False
        """Whether somebody looks, as the last heartbeat had it."""

    def fetch(self) -> None:
        """Have the run here as new as it is anywhere, and begin to take along what comes of it.

        Raises:
            RunError: The store does not answer, or what it has is damaged.
        """
        name, runs = self._folder.name, self._folder.path.parent
        _patiently(lambda: self._artifacts.bring(name, runs, incoming=self._incoming))
        self._thread = threading.Thread(target=self._carry, name="courier", daemon=True)
        self._thread.start()

    def deliver(self) -> None:
        """Take all that was done to the store.

        Raises:
            RunError: The store does not answer, or another machine went on with the run.
        """
        self._is_ended.set()
        if self._thread is not None:
            self._thread.join()
        _patiently(lambda: self._artifacts.keep(self._folder))

    def _carry(self) -> None:
        taken, wait = self._moment(), BEAT
        while not self._is_ended.wait(wait):
            wait = BEAT
            try:
                if (moment := self._moment()) != taken:
                    self._artifacts.keep(self._folder)
                    taken = moment
                if self.is_watched and (live := self._live.snapshot()):
                    self._artifacts.show(self._folder.name, live)
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
        except RunError:
            if time.monotonic() > deadline:
                raise
            time.sleep(REST)
