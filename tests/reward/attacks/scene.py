"""What an attack is aimed at: files, sockets, processes and memory that the test itself makes, and takes away again."""

from __future__ import annotations

import contextlib
import ctypes
import os
import secrets
import signal
import socket
import subprocess
import tempfile
from pathlib import Path

PR_SET_PTRACER, ANYBODY = 0x59616D61, ctypes.c_ulong(-1)

libc = ctypes.CDLL(None, use_errno=True)


class NotHere(Exception):
    """Why an attack cannot be tried on this machine at all."""


class Scene:
    """Targets in a folder of their own; a context manager."""

    def __init__(self) -> None:
        self._stack = contextlib.ExitStack()
        self.folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="racecraft-attack-")))
        self.number = secrets.randbelow(90_000) + 1_000
        """What an attacker must not learn."""
        self.leaked: list[int] = []
        """File descriptors that the worker inherits by mistake."""

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def file(self, name: str = "target", text: str | None = None) -> Path:
        """A file that holds the number, or a text; only its owner may read it."""
        path = self.folder / name
        path.write_text(str(self.number) if text is None else text)
        path.chmod(0o600)
        return path

    def victim(self) -> int:
        """Another process of the same user, which allows everybody of that user to look inside it."""
        allow = lambda: libc.prctl(PR_SET_PTRACER, ANYBODY, 0, 0, 0)  # noqa: E731
        process = subprocess.Popen(["sleep", "30"], preexec_fn=allow, stdin=subprocess.DEVNULL)
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        self._victim = process
        return process.pid

    @property
    def victim_is_dead(self) -> bool:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._victim.wait(0.2)
        return self._victim.returncode is not None

    def listener(self, family: int, kind: int, address: object) -> socket.socket:
        """A socket of the trainer's."""
        listening = self._stack.enter_context(socket.socket(family, kind))
        listening.settimeout(0.1)
        listening.bind(address)  # type: ignore[arg-type]
        if kind == socket.SOCK_STREAM:
            listening.listen(1)
        return listening

    def ours(self) -> ctypes.c_uint64:
        """A number in the memory of the trainer."""
        self._memory = ctypes.c_uint64(self.number)
        libc.prctl(PR_SET_PTRACER, ANYBODY, 0, 0, 0)
        return self._memory

    def keep(self, descriptor: int) -> int:
        """Close it at the end."""
        self._stack.callback(lambda: os.close(descriptor))
        return descriptor

    def catch(self, number: int) -> list[int]:
        """The signals of this number that the trainer gets."""
        found: list[int] = []
        before = signal.signal(number, lambda *_: found.append(1))
        self._stack.callback(lambda: signal.signal(number, before))
        return found

    def at_end(self, action: object, *arguments: object) -> None:
        """Do this when all is over."""
        self._stack.callback(action, *arguments)  # type: ignore[arg-type]


def received(listening: socket.socket) -> bool:
    """Whether anything came."""
    try:
        if listening.type == socket.SOCK_STREAM:
            listening.accept()[0].close()
        else:
            listening.recv(100)
    except TimeoutError:
        return False
    return True
