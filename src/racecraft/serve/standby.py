"""A worker that has loaded what jobs need and waits for one, so that a click is followed by driving and not by imports.

It is given a job in one line on its standard input, which the system closes with the server, however that ends:
nobody waits in vain. Its lock is taken before it exists and inherited, so that no other server takes it for dead while
it loads.
"""

from __future__ import annotations

import fcntl
import os
import secrets
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO

from racecraft.serve.settings import ARTIFACTS, DATABASE


class Standby:
    """Starts workers, at most one of them before there is something to do.

    Args:
        runs: Folder of the runs.
        workers: Folder of the locks: a file for each worker by its name, held as long as it lives.
        database: The database's URL.
        artifacts: Where runs are copied to, or empty.
        log: File for what workers print.
    """

    def __init__(self, runs: Path, *, workers: Path, database: str, artifacts: str, log: Path) -> None:
        # -P: a random.py in the user's folder is not to be taken for Python's
        self._command = [sys.executable, "-P", "-m", "racecraft.serve.work", str(runs)]
        self._environment = {**os.environ, DATABASE: database, ARTIFACTS: artifacts}
        self._workers, self._log = workers, log
        self._name = ""  # of the one that waits
        self._waiting: subprocess.Popen[bytes] | None = None

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
        with suppress(BrokenPipeError), _pipe(worker) as pipe:  # one that has just died is noticed like any other
            pipe.write(f"{job_id} {self._name}\n".encode())
        return worker

    def close(self) -> None:
        """Send the waiting one home."""
        if self._waiting is not None:
            self._waiting.terminate()
            self._waiting.wait()
            self._forget()

    def _forget(self) -> None:
        assert self._waiting is not None
        _pipe(self._waiting).close()
        (self._workers / self._name).unlink(missing_ok=True)
        self._waiting = None

    def _launch(self) -> subprocess.Popen[bytes]:
        with self._log.open("ab") as log, (self._workers / self._name).open("wb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # of the open file, which the worker inherits
            return subprocess.Popen(
                [*self._command, str(lock.fileno())],
                env=self._environment,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                pass_fds=[lock.fileno()],
                start_new_session=True,  # Ctrl-C in the server's terminal is not for it
            )


def _pipe(worker: subprocess.Popen[bytes]) -> IO[bytes]:
    assert worker.stdin is not None
    return worker.stdin
