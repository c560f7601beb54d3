"""Keeps the object store and the runs on disk alike: when the server starts, and when a run is made or removed."""

from __future__ import annotations

import logging
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from racecraft.errors import RunError
from racecraft.run import RunFolder, list_runs
from racecraft.serve.jobs.cargo import Cargo, files_of, rivals_of
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
        is_whole: Whether the store is to hold all runs, and not just those that there are jobs about.
    """

    def __init__(
        self,
        artifacts: Artifacts | None,
        *,
        settings: ServeSettings,
        queue: JobQueue,
        supervisor: Supervisor,
        is_whole: bool = True,
    ) -> None:
        self._artifacts, self._runs, self._incoming = artifacts, settings.runs, settings.incoming
        self._state, self._queue, self._supervisor = settings.state, queue, supervisor
        self._is_whole, self._is_ended = is_whole, threading.Event()

    def of(self, settings: ServeSettings, queue: JobQueue) -> Mirror:
        """The same for another person, whose runs are copied when there is a job about them."""
        artifacts = self._artifacts.of(queue.user_id) if self._artifacts is not None else None
        return Mirror(artifacts, settings=settings, queue=queue, supervisor=self._supervisor, is_whole=False)

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

    def share_training(self, folder: RunFolder) -> Cargo | None:
        """Have the store hold what a run's training needs, as `share` does."""
        info = folder.read_info()
        rivals = rivals_of(info.settings, self._runs)
        if rivals is None:
            return None
        return self.share(folder, *(RunFolder(self._runs / name) for name in rivals), tracks=(info.track,))

    def share(self, *folders: RunFolder, tracks: Sequence[str] = (), filled: Path | None = None) -> Cargo | None:
        """Have the store hold what a job needs before there is one, so that any machine can do it.

        Args:
            folders: Runs that it reads or changes.
            tracks: Where it drives, as settings name tracks.
            filled: Folder below the state folder that it fills further.

        Returns:
            What the store has for it; None where it can only be done here.
        """
        files = files_of(*tracks) if self._artifacts is not None else None
        if self._artifacts is None or files is None:
            return None
        try:
            for folder in folders:
                if not self._queue.is_travelling(folder.name):  # else who works on it copies it
                    self._artifacts.keep(folder)
            if filled is not None:
                self._artifacts.shelf(filled.parent.name).keep(RunFolder(filled))
            digests = {path: self._artifacts.keep_track(Path(path)) for path in sorted(files)}
        except RunError as error:
            _LOG.error("%s %s", error, error.hint)
            return None
        names = tuple(dict.fromkeys(folder.name for folder in folders))
        return Cargo(home=str(self._runs.resolve()), runs=names, tracks=digests)

    def copy(self, name: str) -> None:
        """A run is new or has changed, and there is no other job that copies it at its end."""
        if self._artifacts is not None and self._is_whole and not self._queue.is_busy(name):
            self._queue.add("store", name, {})
            self._supervisor.wake()

    def forget(self, name: str) -> None:
        """A run is no longer there."""
        if self._artifacts is not None:
            try:
                self._artifacts.forget(name)
            except RunError as error:
                _LOG.error("%s stays in the store: %s", name, error)

    def forget_all(self) -> None:
        """Somebody is gone with all that is theirs."""
        if self._artifacts is not None:
            try:
                self._artifacts.forget_all()
            except RunError as error:
                _LOG.error("Copies of somebody who is gone stay in the store: %s", error)

    def _bring(self, artifacts: Artifacts, name: str) -> bool:
        """Whether it is here now; the others are fetched all the same."""
        try:
            artifacts.bring(name, self._runs, incoming=self._incoming, is_home=True)
        except (RunError, OSError) as error:
            _LOG.error("%s cannot be fetched: %s", name, error)
            return False
        return True
