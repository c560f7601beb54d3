"""A worker that has loaded what jobs need and waits for one, so that a click is followed by driving and not by imports.

It is given a job in one line on its standard input, which the system closes with the server, however that ends:
nobody waits in vain.
"""

from __future__ import annotations

import os
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
        database: The database's URL.
        artifacts: Where runs are copied to, or empty.
        log: File for what workers print.
    """

    def __init__(self, runs: Path, *, database: str, artifacts: str, log: Path) -> None:
        self._command = [sys.executable, "-P", "-m", "racecraft.serve.work", str(runs)]
        self._environment = {**os.environ, DATABASE: database, ARTIFACTS: artifacts}
        self._log = log
        self._waiting: subprocess.Popen[bytes] | None = None

    def prepare(self) -> None:
        """Have a worker wait."""
        if self._waiting is not None and self._waiting.poll() is not None:
            _pipe(self._waiting).close()
            self._waiting = None
        if self._waiting is None:
            self._waiting = self._launch()

    def start(self, job_id: str, *, owner: str) -> subprocess.Popen[bytes]:
        """A worker that does a job: the one that waits, or a new one."""
        self.prepare()
        assert self._waiting is not None
        worker, self._waiting = self._waiting, None
        with suppress(BrokenPipeError), _pipe(worker) as pipe:  # one that has just died is noticed like any other
            pipe.write(f"{job_id} {owner}\n".encode())
        return worker

    def close(self) -> None:
        """Send the waiting one home."""
        if self._waiting is not None:
            self._waiting.terminate()
            self._waiting.wait()
            _pipe(self._waiting).close()
            self._waiting = None

    def _launch(self) -> subprocess.Popen[bytes]:
        with self._log.open("ab") as log:
            return subprocess.Popen(
                self._command,  # -P: a random.py in the user's folder is not to be taken for Python's
                env=self._environment,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                start_new_session=True,  # Ctrl-C in the server's terminal is not for it
            )


def _pipe(worker: subprocess.Popen[bytes]) -> IO[bytes]:
    assert worker.stdin is not None
    return worker.stdin
