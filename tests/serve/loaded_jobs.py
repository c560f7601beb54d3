"""Processes of jobs that need not load what they consist of: forked as servers are, by whom those are forked.

The start of one is 0.75 s of CPU, nearly all of it imports. What is done and how it ends is the same, and so is what
happens when it or its server is killed; `test_standby` and workers that come with a token start them as users do.
"""

from __future__ import annotations

import hashlib
import os
import random
import socket
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

from forked_processes import ForkedProcess


def name_of(runs: str | Path) -> str:
    """What the system calls a forked process of jobs on this folder, where others have a command."""
    return f"jobs {hashlib.sha256(os.fsencode(runs)).hexdigest()[:10]}"


class ForkedJob(ForkedProcess):
    """Stands for `subprocess.Popen` in a server."""

    def __init__(
        self, way: socket.socket, command: Sequence[str], *, env: Mapping[str, str], stdout: IO[bytes], **apart: Any
    ) -> None:
        python, *flags, runs, lock, bell = command
        assert (python, flags) == (sys.executable, ["-P", "-m", "racecraft.serve.jobs"])
        assert apart["start_new_session"]
        assert apart["pass_fds"] == (int(lock), int(bell))
        told = {"runs": runs, "folder": os.getcwd(), "environment": dict(env)}
        reading, writing = os.pipe()
        super().__init__(way, told, reading, stdout.fileno(), int(lock), int(bell))
        os.close(reading)
        self.stdin = os.fdopen(writing, "wb")


def fork_jobs(way: socket.socket) -> None:
    """In a server: have its jobs done by forks."""
    from racecraft.serve.jobs import supervisor

    vars(supervisor)["subprocess"] = SimpleNamespace(Popen=partial(ForkedJob, way), PIPE=-1)


def do_jobs(runs: str, files: Sequence[int]) -> int:
    """In a fork: what the command does."""
    from racecraft.serve.jobs.__main__ import main

    os.setsid()
    heard, log, lock, bell = files
    for file, place in ((heard, 0), (log, 1), (log, 2)):
        os.dup2(file, place)
    os.close(heard)
    os.close(log)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115  # as long as the process
    Path("/proc/self/comm").write_text(name_of(runs))
    random.seed()
    return main(runs, str(lock), str(bell))
