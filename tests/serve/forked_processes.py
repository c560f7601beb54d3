"""A process that another one was asked to fork, with what of `subprocess.Popen` its users take."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
from threading import Lock
from typing import Any

LONGEST = 1 << 20  # bytes of a message: a process's words, folder and environment


class ForkedProcess:
    """Asks for it.

    Args:
        way: To who forks it.
        told: What it is to do.
        files: What it has open for that.
    """

    def __init__(self, way: socket.socket, told: dict[str, Any], *files: int) -> None:
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with ours:
            with its:
                socket.send_fds(way, [json.dumps(told).encode()], [its.fileno(), *files])
            answer, (self._life,), _, _ = socket.recv_fds(ours, LONGEST, 1)
        self.pid = int(answer)
        self._lock = Lock()

    def _has_ended_within(self, seconds: float | None) -> bool:
        with self._lock:
            if self._life != -1 and select.select([self._life], [], [], seconds)[0]:
                os.close(self._life)
                self._life = -1
            return self._life == -1

    def poll(self) -> int | None:
        """None while it runs."""
        return 0 if self._has_ended_within(0) else None

    def wait(self, timeout: float | None = None) -> None:
        """Until it has ended."""
        if not self._has_ended_within(timeout):
            raise subprocess.TimeoutExpired("racecraft", timeout or 0.0)

    def _tell(self, what: signal.Signals) -> None:
        if self.poll() is None:
            os.kill(self.pid, what)

    def terminate(self) -> None:
        """Ask it to stop."""
        self._tell(signal.SIGTERM)

    def kill(self) -> None:
        """Stop it."""
        self._tell(signal.SIGKILL)
