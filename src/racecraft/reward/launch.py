"""Starts the reward worker process: the one place that decides what it inherits.

It gets a bare interpreter, an environment of its own (so no secrets and no PYTHONPATH), the root folder as
working folder, four pipes and one piece of shared memory. Where bubblewrap works it stands around the same command.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from racecraft import system
from racecraft.errors import RewardError
from racecraft.reward.sandbox.bubblewrap import around
from racecraft.reward.sandbox.plan import package_folder

PROGRAM = Path(__file__).resolve().with_name("worker_process.py")

# No user or site packages, no folder of the script, no bytecode files: the packages below are added by path.
INTERPRETER_OPTIONS = ("-s", "-S", "-P", "-B", "-X", "utf8")


@dataclass(frozen=True, eq=False)
class WorkerProcess:
    """A worker that was started."""

    popen: subprocess.Popen[bytes]
    """Requests go to its stdin, replies come from its stdout, crash reports from its stderr."""
    interpreter: int
    """Number of the process that runs the reward function; inside bubblewrap, which is a process too, another one."""
    lifeline: int
    """File descriptor; the kernel ends the worker when no process holds it any more."""

    def kill(self, owner: int) -> None:
        """Kill it and all that it may have started, and close the pipes; only in the process ``owner``, its parent."""
        if os.getpid() != owner:  # a forked copy of the trainer: the worker is not its child
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if self.popen.poll() is None and self.interpreter != self.popen.pid:
                system.end(self.interpreter)
                self.ending(timeout_s=1.0)  # bubblewrap ends when what it ran has ended
            system.end(self.popen.pid, with_group=True)
        self.popen.wait()
        for pipe in (self.popen.stdin, self.popen.stdout, self.popen.stderr):
            if pipe is not None:
                pipe.close()
        with contextlib.suppress(OSError):
            os.close(self.lifeline)

    def seconds(self) -> float:
        """Of a core that it has used so far; where that cannot be known, those of the wall."""
        if sys.platform == "linux":
            with contextlib.suppress(OSError):
                return time.clock_gettime(~self.interpreter << 3 | 2)  # its clock, as clock_getcpuclockid(3) has it
        return time.monotonic()

    def ending(self, timeout_s: float) -> tuple[str, int] | None:
        """How it ended: a signal's name, or an empty text and the exit status; None if it has not within the time."""
        try:
            status = self.popen.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None
        number = -status
        if self.interpreter != self.popen.pid and status > 128:
            number = status - 128  # how bubblewrap reports that what it ran was ended by a signal
        if number <= 0:
            return "", status
        return system.end_of(-number), status


def start_process(
    shared_memory: int, *, bubblewrap: str = "", readable: Sequence[str] = ()
) -> tuple[WorkerProcess, int]:
    """Start the worker process.

    Args:
        shared_memory: File descriptor that the process inherits under the same number.
        bubblewrap: Path of the program that stands around it, if any.
        readable: What there is inside bubblewrap.

    Returns:
        The process, and the number under which it finds the other end of its lifeline.

    Raises:
        RewardError: Bubblewrap did not start it.
    """
    interpreter = sys.executable if not bubblewrap else os.path.realpath(sys.executable)
    command = [interpreter, *INTERPRETER_OPTIONS, str(PROGRAM)]
    end, lifeline = os.pipe()
    told, tells = os.pipe()
    try:
        if bubblewrap:
            command = [*around(bubblewrap, [*readable, interpreter, str(PROGRAM.parent)], info=tells), *command]
        popen = subprocess.Popen(
            command,
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd="/",
            env=bare_environment(),
            # Ctrl-C is the trainer's affair, and one kill ends the whole group
            **system.apart(shared_memory, end, *([tells] if bubblewrap else [])),
        )
    except BaseException:
        os.close(lifeline)
        os.close(told)
        raise
    finally:
        os.close(end)
        os.close(tells)
    worker = WorkerProcess(popen, popen.pid, lifeline)
    try:
        return (worker if not bubblewrap else replace(worker, interpreter=_told(told))), end
    except BaseException:
        worker.kill(os.getpid())
        raise
    finally:
        os.close(told)


def _told(descriptor: int) -> int:
    """The process number that bubblewrap tells."""
    text, deadline = b"", time.monotonic() + 10.0
    while system.can_be_read(descriptor, deadline - time.monotonic()):
        part = os.read(descriptor, 4096)
        if not part:
            break
        text += part
    try:
        return int(json.loads(text)["child-pid"])
    except (ValueError, KeyError, TypeError):
        raise RewardError(
            "bubblewrap did not start the reward worker.", hint="Try it: bwrap --ro-bind / / true"
        ) from None


def bare_environment() -> dict[str, str]:
    """Fixed hash seed, so that sets iterate alike in every run; one thread, as a worker gets one core."""
    environment = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment |= {"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"}
    # Some interpreters do not start without the first two; by the others a user chooses how NumPy multiplies.
    for name in ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "OPENBLAS_CORETYPE", "MKL_CBWR", "NPY_DISABLE_CPU_FEATURES"):
        if name in os.environ:
            environment[name] = os.environ[name]
    return environment


def package_paths(packages: Sequence[str]) -> list[str]:
    """The folders that hold packages which a reward function may import."""
    folders = [package_folder(name) for name in packages]
    return list(dict.fromkeys(str(folder.parent) for folder in folders if folder is not None))
