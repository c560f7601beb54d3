"""Starts jobs in child processes, as many at once as there are slots, and notices when one has died.

A child holds a lock on a file of its own, which the system drops with it. So a server sees at once that a child of the
server before it is dead, too; what ran on another machine is taken over when its lease has run out. One child more has
loaded what jobs need and waits for one, as soon as somebody looks at a page: a click is followed by driving and not by
imports. After a short job a child waits for another one itself. All ring a bell when a job has ended: a pipe that the
server listens at.
"""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import subprocess
import sys
import time
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Final

from racecraft import system
from racecraft.errors import RunError
from racecraft.run.lock import exclusive_lock
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.news import News
from racecraft.serve.jobs.office import AWAY, Office, Slot
from racecraft.serve.jobs.queue import KINDS, kinds_of
from racecraft.serve.settings import WORKERS, ServeSettings

POLL: Final = 0.5  # s between two looks at the queue; `wake` makes one at once
GRACE: Final = 20.0  # s for a training to save itself when the server is stopped
CALM: Final = 5.0  # s after the start of a job before the next worker loads: the job has the machine to itself first


class Supervisor:
    """One per machine.

    Args:
        settings: Of the console, or of a machine that works for one.
        office: Where jobs are handed out.
        access: The way to that, for the children.
        is_home: Whether this is the console's own machine, where all runs, tracks and files are; others take jobs that
            travel.
    """

    def __init__(self, settings: ServeSettings, office: Office, access: Access, *, is_home: bool = True) -> None:
        self._settings, self._office, self._is_home = settings, office, is_home
        self._children: dict[str, subprocess.Popen[bytes]] = {}  # by owner
        self._staying: set[str] = set()  # those of them that wait for another job after theirs
        self._awake = asyncio.Event()
        self._is_stopping = False
        self._is_expecting = not is_home  # elsewhere nobody is seen
        self._loop: asyncio.AbstractEventLoop | None = None
        log = settings.state / "jobs.log"
        self._started = float("-inf")  # the newest job, in `time.monotonic()` seconds
        self._workers = settings.state / WORKERS
        self._workers.mkdir(parents=True, exist_ok=True)
        self.news = News()
        """For workers that wait elsewhere."""
        self._standby = Standby(settings.runs, workers=self._workers, access=access, log=log)

    def wake(self) -> None:
        """There is something new in the queue; safe from any thread."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._look)

    def expect(self) -> None:
        """Somebody looks at a page, and may have something done at any moment."""
        self._is_expecting = True

    def _look(self) -> None:
        self._awake.set()
        self.news.tell()

    async def run(self) -> None:
        """Until cancelled."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._standby.bell, self._heard)
        try:
            while True:
                try:
                    await asyncio.to_thread(self._tend)
                except (*AWAY, OSError) as error:  # the database is being restarted, the disk is full
                    logging.getLogger("racecraft.serve").error("Jobs cannot be tended: %s", str(error).splitlines()[0])
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._awake.wait(), POLL)
                self._awake.clear()
        finally:
            self._loop.remove_reader(self._standby.bell)

    def _heard(self) -> None:
        with suppress(BlockingIOError):
            os.read(self._standby.bell, 1 << 10)
        self._awake.set()

    async def stop(self) -> None:
        """Let the children save themselves; what they were doing is queued again for the next server."""
        self._is_stopping = True
        self._standby.close()
        for child in list(self._children.values()):
            child.terminate()
        deadline = asyncio.get_running_loop().time() + GRACE
        while any(child.poll() is None for child in self._children.values()):
            if asyncio.get_running_loop().time() > deadline:
                for child in self._children.values():
                    child.kill()
            await asyncio.sleep(0.05)
        for owner, child in self._children.items():
            self._office.hand_back(owner)
            _pipe(child).close()
        self._children.clear()

    def _tend(self) -> None:
        self._reap()
        self._bury()
        self._office.take_back_expired()
        places: dict[Slot, int] = {"training": self._settings.training_slots, "other": self._settings.other_slots}
        for slot, count in places.items():
            while not self._is_stopping and self._start(slot, count):
                pass
        is_calm = time.monotonic() - self._started > CALM
        if self._is_expecting and is_calm and not self._is_stopping:
            self._standby.prepare()

    def _doable(self, kinds: tuple[str, ...]) -> tuple[str, ...]:
        """Those for which everything is installed; at home all, so that somebody says what is missing."""
        return kinds if self._is_home else tuple(kind for kind in kinds if _is_installed(KINDS[kind].needs))

    def _start(self, slot: Slot, places: int) -> bool:
        """Start the next job for such a place; False when there is none, or no place is free."""
        owner, kinds = self._standby.name(), self._doable(kinds_of(slot))
        job = self._office.take(
            slot, kinds, owner=owner, machine=self._settings.machine, places=places, is_home=self._is_home
        )
        if job is None:
            return False
        self._children[owner] = self._standby.start(job.id)
        if KINDS[job.kind].stays:
            self._staying.add(owner)
        self._started = time.monotonic()
        return True

    def _reap(self) -> None:
        """Take note of children that ended, and of those whose job has ended and that wait for another."""
        for owner, child in list(self._children.items()):
            if child.poll() is not None:
                self._office.release(owner)
                (self._workers / owner).unlink(missing_ok=True)
                _pipe(child).close()
                del self._children[owner]
                self._staying.discard(owner)
            elif owner in self._staying and self._office.held(owner) is None:
                self._staying.discard(owner)
                if not self._is_stopping and self._standby.take(owner, child):
                    del self._children[owner]
                else:
                    _pipe(child).close()  # one waits already: this one goes home

    def _bury(self) -> None:
        """Take note of children of earlier servers that are dead."""
        for path in self._workers.iterdir():
            if path.name not in self._children:
                with suppress(RunError), exclusive_lock(path):  # a living one holds it
                    self._office.release(path.name, has_company=True)
                    path.unlink(missing_ok=True)


class Standby:
    """Starts workers, at most one of them before there is something to do.

    That one is given a job in a line on its standard input, which the system closes with the server, however that ends:
    nobody waits in vain. Its lock is taken before it exists and inherited, so that no other server takes it for dead
    while it loads.

    Args:
        runs: Folder of the runs.
        workers: Folder of the locks: a file for each worker by its name, held as long as it lives.
        access: The way to their jobs.
        log: File for what workers print.
    """

    def __init__(self, runs: Path, *, workers: Path, access: Access, log: Path) -> None:
        # -P: a random.py in the user's folder is not to be taken for Python's
        self._command = [sys.executable, "-P", "-m", "racecraft.serve.jobs", str(runs)]
        self._environment = {**os.environ, **access.environment()}
        self._workers, self._log = workers, log
        self._name = ""  # of the one that waits
        self._waiting: subprocess.Popen[bytes] | None = None
        self.bell, self._rope = os.pipe()
        """A pipe of which a byte comes out whenever a job has ended."""
        self._ends = [self.bell, self._rope]
        for end in self._ends:
            os.set_blocking(end, False)

    def prepare(self) -> None:
        """Have a worker wait."""
        self.name()
        if self._waiting is None:
            self._waiting = self._launch()

    def name(self) -> str:
        """Of the worker that is next, under which its job is claimed."""
        if self._waiting is not None and self._waiting.poll() is not None:  # it died
            self._forget()
        if self._waiting is None:
            self._name = secrets.token_hex(8)
        return self._name

    def start(self, job_id: str) -> subprocess.Popen[bytes]:
        """Have the worker that is next do a job, claimed under its name: the one that waits, or a new one."""
        worker, self._waiting = self._waiting or self._launch(), None
        with suppress(BrokenPipeError):  # one that has just died is noticed like any other
            _pipe(worker).write(f"{job_id} {self._name}\n".encode())
            _pipe(worker).flush()
        return worker

    def take(self, name: str, worker: subprocess.Popen[bytes]) -> bool:
        """Have a worker wait that has done its job; False where one does already."""
        if self._waiting is not None and self._waiting.poll() is None:
            return False
        if self._waiting is not None:
            self._forget()
        self._waiting, self._name = worker, name
        return True

    def close(self) -> None:
        """Send the waiting one home."""
        if self._waiting is not None:
            self._waiting.terminate()
            self._waiting.wait()
            self._forget()
        while self._ends:
            os.close(self._ends.pop())

    def _forget(self) -> None:
        assert self._waiting is not None
        _pipe(self._waiting).close()
        (self._workers / self._name).unlink(missing_ok=True)
        self._waiting = None

    def _launch(self) -> subprocess.Popen[bytes]:
        with self._log.open("ab") as log, (self._workers / self._name).open("wb") as lock:
            system.lock(lock.fileno())  # of the open file, which the worker inherits
            return subprocess.Popen(
                [*self._command, str(lock.fileno()), str(self._rope)],
                env=self._environment,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                **system.apart(lock.fileno(), self._rope),  # Ctrl-C in the server's terminal is not for it
            )


@cache
def _is_installed(module: str) -> bool:
    return not module or find_spec(module) is not None


def _pipe(worker: subprocess.Popen[bytes]) -> IO[bytes]:
    assert worker.stdin is not None
    return worker.stdin
