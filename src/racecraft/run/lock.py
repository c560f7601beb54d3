"""One trainer per run, one server per league: a lock of the operating system on a file, which dies with its process."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from racecraft import system
from racecraft.errors import InUse, RunError


@contextmanager
def exclusive_lock(path: Path, *, of: str = "") -> Iterator[None]:
    """Hold a lock file while the block runs; it names the holder for whoever comes second.

    The system drops the lock with the process, however it ends, so a file of a dead process does not count.

    Args:
        path: The lock file.
        of: What it is for; by default the folder that it lies in.

    Raises:
        InUse: Another process, or another part of this one, holds it.
        RunError: It cannot be opened.
    """
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise RunError(f"{path} cannot be opened: {error.strerror or error}.") from error
    try:
        try:
            system.lock(descriptor)
        except OSError as error:
            raise InUse(
                f"{of or path.parent} is in use by process {_holder(descriptor)}.",
                hint="Wait for it, stop it, or give the new run another name.",
            ) from error
        os.ftruncate(descriptor, 0)
        os.write(descriptor, json.dumps({"pid": os.getpid(), "since": time.time()}).encode())
        yield
        os.ftruncate(descriptor, 0)
    finally:
        os.close(descriptor)


def _holder(descriptor: int) -> str:
    with suppress(OSError, ValueError, KeyError, TypeError):
        os.lseek(descriptor, 0, os.SEEK_SET)
        return str(int(json.loads(os.read(descriptor, 200))["pid"]))
    return "unknown"
