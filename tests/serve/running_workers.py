"""Real workers in processes of their own, as on other machines: a folder each, and only database and store shared."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from running_consoles import end


@dataclass
class RunningWorker:
    """A worker's process."""

    process: subprocess.Popen[str]
    machine: str
    runs: Path

    def children(self) -> list[int]:
        """The processes that do its jobs."""
        return processes_on(self.runs)

    def kill(self) -> None:
        """As a machine that is switched off: the worker and what it started, at once."""
        for process in (self.process.pid, *processes_on(self.runs)):
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.process.wait()


@contextmanager
def running_worker(
    runs: Path, *options: str, database: str = "", artifacts: str = "", trusted: Path | None = None
) -> Iterator[RunningWorker]:
    command = [sys.executable, "-m", "racecraft", "worker", "--json", "--runs", str(runs), "--machine", runs.name]
    shared = {"RACECRAFT_DATABASE": database, "RACECRAFT_ARTIFACTS": artifacts} if database else {}
    shared |= {} if trusted is None else {"SSL_CERT_FILE": str(trusted)}
    with subprocess.Popen(
        [*command, *options], env={**os.environ, **shared}, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            yield RunningWorker(process, json.loads(process.stdout.readline())["machine"], runs)
        finally:
            end(process)


def processes_on(runs: Path) -> list[int]:
    """The processes that do jobs in a folder of runs."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            command = (entry / "cmdline").read_bytes().split(b"\0") if entry.name.isdigit() else []
            if b"racecraft.serve.jobs" in command and os.fsencode(runs) in command:
                found.append(int(entry.name))
    return found
