"""Starts jobs as child processes, as many at once as there are slots, and notices when one has died."""

from __future__ import annotations

import asyncio
import secrets
import subprocess
import sys
from typing import Final

from racecraft.serve.database import Database
from racecraft.serve.jobs import KINDS, JobQueue
from racecraft.serve.settings import ServeSettings

POLL: Final = 0.5  # s between two looks at the queue; `wake` makes one at once
GRACE: Final = 20.0  # s for a training to save itself when the server is stopped


class Supervisor:
    """One per server.

    Args:
        settings: Of the console.
        database: Handed to the children by its URL.
        queue: Of jobs.
    """

    def __init__(self, settings: ServeSettings, database: Database, queue: JobQueue) -> None:
        self._settings, self._database, self._queue = settings, database, queue
        self._children: dict[str, tuple[bool, subprocess.Popen[bytes]]] = {}  # by owner: is it a training, process
        self._awake = asyncio.Event()
        self._log = settings.state / "jobs.log"

    def wake(self) -> None:
        """There is something new in the queue."""
        self._awake.set()

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            await asyncio.to_thread(self._tend)
            self._awake.clear()
            try:
                await asyncio.wait_for(self._awake.wait(), POLL)
            except TimeoutError:
                continue

    async def stop(self) -> None:
        """Let the children save themselves; what they were doing is queued again for the next server."""
        for _, child in self._children.values():
            child.terminate()
        deadline = asyncio.get_running_loop().time() + GRACE
        while self._reap(is_stopping=True) and asyncio.get_running_loop().time() < deadline:
            await asyncio.sleep(0.05)
        for _, child in self._children.values():
            child.kill()

    def _tend(self) -> None:
        self._reap()
        self._queue.take_back_expired()
        trainings = sum(is_training for is_training, _ in self._children.values())
        others = len(self._children) - trainings
        for _ in range(self._settings.training_slots - trainings):
            self._start(("train",))
        for _ in range(self._settings.other_slots - others):
            self._start(tuple(kind for kind in KINDS if kind != "train"))

    def _start(self, kinds: tuple[str, ...]) -> None:
        owner = secrets.token_hex(8)
        job = self._queue.claim(kinds, owner=owner)
        if job is None:
            return
        arguments = [self._database.url, job.id, owner, str(self._settings.runs)]
        with self._log.open("ab") as log:
            child = subprocess.Popen(
                [sys.executable, "-m", "racecraft.serve.work", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,  # Ctrl-C in the server's terminal is not for it
            )
        self._children[owner] = (job.kind == "train", child)

    def _reap(self, *, is_stopping: bool = False) -> bool:
        """Take note of children that ended; whether there are others."""
        for owner, (_, child) in list(self._children.items()):
            if child.poll() is not None:
                del self._children[owner]
                self._queue.release(owner)
        return bool(self._children)
