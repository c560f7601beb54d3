"""What differs between operating systems, so that nothing else asks which one it is.

Cores, priorities, locks of files, processes with all that they started, memory that two processes share. Each works on
Linux and macOS; on Windows what there is of it, and the rest says that it is missing where it is asked for. The walls
around strangers' code are elsewhere (`racecraft.reward.sandbox`): they are made of what a single system has.
"""

from __future__ import annotations

import os
import select
import signal
import tempfile
from contextlib import suppress
from typing import Any, Final

from racecraft.errors import RacecraftError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

STOPS: Final = (signal.SIGINT, signal.SIGTERM)
"""Signals by which somebody asks a process to end."""
TRACE: Final[int] = int(getattr(signal, "SIGUSR1", 0))
"""Signal by which a process is asked where it is; 0 where there is none to spare."""
_KILL: Final = int(getattr(signal, "SIGKILL", signal.SIGTERM))  # Windows ends a process by either
_BEHIND_TEXT: Final = 1000
"""Byte that is locked where a lock keeps others from reading, too."""


def num_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def lower_priority(niceness: int) -> None:
    """Leave the processor to others, where the system knows of that."""
    if hasattr(os, "nice"):
        os.nice(niceness)


def memory_bytes() -> int | None:
    """Of the machine; None where it does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None


# ---- locks


def lock(descriptor: int, *, waits: bool = False) -> None:
    """Lock an open file for as long as the process has it open; the system drops it with the process.

    Args:
        descriptor: Of the file.
        waits: Until nobody else has locked it, on Windows for ten seconds.

    Raises:
        OSError: Somebody else has locked it.
    """
    if fcntl is not None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        return
    import msvcrt

    os.lseek(descriptor, _BEHIND_TEXT, os.SEEK_SET)
    msvcrt.locking(descriptor, msvcrt.LK_LOCK if waits else msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
    os.lseek(descriptor, 0, os.SEEK_SET)


# ---- processes


def apart(*inherited: int) -> dict[str, Any]:
    """Arguments of `subprocess.Popen`: what Ctrl-C in this terminal does not end, and which open files it has.

    Args:
        inherited: File descriptors that it has under the same numbers.

    Raises:
        RacecraftError: The system hands no open files on.
    """
    if os.name != "nt":
        return {"start_new_session": True, "pass_fds": inherited}
    if inherited:
        raise RacecraftError("Windows hands no open files to another process.", hint="Use WSL.")
    return {"creationflags": 0x200}  # CREATE_NEW_PROCESS_GROUP


def end(process: int, *, with_group: bool = False) -> None:
    """End a process at once, with all that it started where it was made by `apart`; one that is gone is none.

    Args:
        process: Its number.
        with_group: Whether what it started ends, too, where the system knows what that is.
    """
    with suppress(ProcessLookupError, PermissionError):
        if with_group and hasattr(os, "killpg"):
            os.killpg(process, _KILL)
        else:
            os.kill(process, _KILL)


def ask_where(process: int) -> None:
    """Have a process that waits for `TRACE` say where it is; one that is gone says nothing."""
    if TRACE:
        with suppress(ProcessLookupError):
            os.kill(process, TRACE)


def end_of(status: int) -> str:
    """Name of the signal that ended a process; empty for one that ended by itself."""
    if status >= 0:
        return ""
    return next((known.name for known in signal.Signals if known == -status), f"signal {-status}")


def limit(*, seconds: int, written: int, memory: int | None = None) -> None:
    """Have the system end this process, and what it starts, beyond hard limits; and leave no image of it behind.

    Limits that are lower already, as those of a service, stay.

    Args:
        seconds: Of a core.
        written: Bytes of any file.
        memory: Bytes of its address space; None for as many as there are.

    Raises:
        RacecraftError: This system limits nothing.
    """
    try:
        import resource
    except ImportError:
        raise RacecraftError("This system limits no process.", hint="Use WSL.") from None
    limits = {resource.RLIMIT_CPU: seconds, resource.RLIMIT_FSIZE: written, resource.RLIMIT_CORE: 0}
    if memory is not None:
        limits[resource.RLIMIT_AS] = memory
    for kind, most in limits.items():
        hard = resource.getrlimit(kind)[1]
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least))


def can_be_read(descriptor: int, seconds: float) -> bool:
    """Whether there is something to read, or the other end is closed, before so many seconds are over.

    Unlike `select.select` it takes every number: a server has more than 1,024 files open when somebody sees to it.
    """
    if not hasattr(select, "poll"):  # Windows
        return bool(select.select([descriptor], [], [], max(seconds, 0.0))[0])
    looking = select.poll()
    looking.register(descriptor, select.POLLIN)
    return bool(looking.poll(max(seconds, 0.0) * 1000))


# ---- memory


def unnamed_memory(size: int) -> int:
    """A file descriptor of so many zero bytes that has no name; where the system can, nobody makes it smaller."""
    if hasattr(os, "memfd_create") and fcntl is not None:
        descriptor = os.memfd_create("racecraft", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(descriptor, size)
        # A process that shrank the memory could crash this one at its next access.
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
        return descriptor
    with tempfile.TemporaryFile() as file:
        os.ftruncate(file.fileno(), size)
        return os.dup(file.fileno())
