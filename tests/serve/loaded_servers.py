"""Servers and workers that need not load what they consist of: forks of a process that has, one for a process of tests.

It also forks those that do their jobs: `loaded_jobs.py`.

A server's start is 1.3 s of CPU, 1.15 of it imports; a worker's 0.9. What is forked here is a process like any other,
with its own id, folder, environment and files, killed and ended as one; only what `/proc` says of its command and its
environment is its parent's.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TextIO

from forked_processes import LONGEST, ForkedProcess
from loaded_jobs import do_jobs, fork_jobs

CAN_FORK = sys.platform == "linux"
_PARTS = (
    "racecraft.serve.app",
    "racecraft.serve.station",
    "racecraft.serve.submissions.walls",
    "sqlalchemy.dialects.sqlite.pysqlite",
    "uvicorn.lifespan.on",
    "uvicorn.loops.auto",
    "uvicorn.protocols.http.auto",
    "uvicorn.protocols.websockets.auto",
)
"""What a server has imported once it answers."""


class Forked(ForkedProcess):
    """A server's process."""

    def __init__(self, words: Sequence[str], environment: Mapping[str, str]) -> None:
        told = {"words": words, "folder": os.getcwd(), "environment": dict(environment)}
        reading, writing = os.pipe()
        super().__init__(_nursery(), told, writing, 2)
        os.close(writing)
        self.stdout: TextIO = os.fdopen(reading)


def typed(*words: str, **shared: str) -> subprocess.Popen[str]:
    """The process of a command, with these variables besides ours in its environment."""
    command, environment = [sys.executable, "-m", "racecraft", *words], os.environ | shared
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def started(*words: str, **shared: str) -> subprocess.Popen[str] | Forked:
    """The same, loaded where the system can fork it."""
    return Forked(words, os.environ | shared) if CAN_FORK else typed(*words, **shared)


@cache
def _nursery() -> socket.socket:
    """The way to the process that forks them, which ends with this one."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    command = [sys.executable, __file__, str(its.fileno())]
    with its:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, pass_fds=[its.fileno()])

    def end() -> None:
        ours.close()
        process.wait()

    atexit.register(end)
    return ours


def _load() -> None:
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # as whoever types the command does first
    from racecraft.serve.quick import loading

    with loading():
        from racecraft.cli.entry import every_verb

        every_verb()
        for module in _PARTS:
            import_module(module)
        from racecraft.serve.jobs import worker

        worker.load()


def _bury(*_: Any) -> None:
    while True:
        try:
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                return
        except ChildProcessError:
            return


def _nurse(tests: socket.socket, servers: socket.socket) -> tuple[dict[str, Any], list[int]] | None:
    """Fork a process for each message; comes back in each with what it was told and given, and with None at the end."""
    while True:
        asking = tests if tests in select.select([tests, servers], [], [])[0] else servers
        message, files, _, _ = socket.recv_fds(asking, LONGEST, 5)
        if not message:
            return None
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGCHLD])  # or its id may be another's before it is looked up
        if child := os.fork():
            life = os.pidfd_open(child)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGCHLD])
            with socket.socket(fileno=files.pop(0)) as answer, suppress(OSError):  # a server may be killed meanwhile
                socket.send_fds(answer, [str(child).encode()], [life])
            for file in (life, *files):
                os.close(file)
            continue
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGCHLD])
        tests.close()
        servers.close()
        os.close(files.pop(0))
        return json.loads(message), files


def _main() -> int | None:
    _load()
    gc.freeze()  # or every server that looks for garbage gets pages of its own
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the tests, with which this ends
    signal.signal(signal.SIGCHLD, _bury)
    heard, way = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    asked = _nurse(socket.socket(fileno=int(sys.argv[1])), heard)
    if asked is None:
        return None
    told, files = asked
    os.environ.clear()
    os.environ.update(told["environment"])
    os.chdir(told["folder"])
    if "runs" in told:
        way.close()
        del sys.path[0]
        return do_jobs(told["runs"], files)
    for file, place in zip(files, (1, 2), strict=True):
        os.dup2(file, place)
        os.close(file)
    fork_jobs(way)
    from racecraft import __main__ as command

    sys.path[0] = told["folder"]
    sys.argv = [str(Path(command.__file__)), *told["words"]]
    command.main()
    return None


if __name__ == "__main__":
    sys.exit(_main())
