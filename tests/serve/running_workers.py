"""Real workers in processes of their own, as on other machines: a folder each, and only database and store shared."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from loaded_jobs import name_of
from loaded_servers import Forked, started, typed
from running_consoles import end


@dataclass
class RunningWorker:
    """A worker's process."""

    process: subprocess.Popen[str] | Forked
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
    runs: Path,
    *options: str,
    database: str = "",
    artifacts: str = "",
    trusted: Path | None = None,
    is_forked: bool = False,
) -> Iterator[RunningWorker]:
    """A worker until the block ends.

    Args:
        runs: Its folder, whose name is the machine's.
        options: Further words of its command.
        database: The URL of the console's, and `artifacts` that of its store; nothing for who comes with a token.
        trusted: File of the authority that it trusts.
        is_forked: Whether it and its jobs are spared their loading, as who reaches the database always is. Of a fork
            nothing can be seen of its environment and of how it ended.
    """
    words = ["worker", "--json", "--runs", str(runs), "--machine", runs.name, *options]
    shared = {"RACECRAFT_DATABASE": database, "RACECRAFT_ARTIFACTS": artifacts} if database else {}
    shared |= {} if trusted is None else {"SSL_CERT_FILE": str(trusted)}
    process = (started if database or is_forked else typed)(*words, **shared)
    try:
        assert process.stdout is not None
        yield RunningWorker(process, json.loads(process.stdout.readline())["machine"], runs)
    finally:
        end(process)


def processes_on(runs: Path) -> list[int]:
    """The processes that do jobs in a folder of runs."""
    found, forked = [], name_of(runs)
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if not entry.name.isdigit():
                continue
            command = (entry / "cmdline").read_bytes().split(b"\0")
            is_typed = b"racecraft.serve.jobs" in command and os.fsencode(runs) in command
            if is_typed or (entry / "comm").read_text().strip() == forked:
                found.append(int(entry.name))
    return found
