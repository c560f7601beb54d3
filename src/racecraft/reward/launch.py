"""Starts the reward worker process: the one place that decides what it inherits.

It gets a bare interpreter, an environment of its own (so no secrets and no PYTHONPATH), the root folder as
working folder, three pipes and one piece of shared memory. A sandbox goes here, around the same command.
"""

from __future__ import annotations

import fcntl
import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from racecraft.reward.worker_process import PACKAGES

PROGRAM = Path(__file__).with_name("worker_process.py")

# No user or site packages, no folder of the script, no bytecode files: the packages below are added by path.
INTERPRETER_OPTIONS = ("-s", "-S", "-P", "-B", "-X", "utf8")


def start_process(shared_memory: int) -> subprocess.Popen[bytes]:
    """Start the worker process.

    Args:
        shared_memory: File descriptor that the process inherits under the same number.

    Returns:
        The process: requests go to its stdin, replies come from its stdout, crash reports from its stderr.
    """
    return subprocess.Popen(
        [sys.executable, *INTERPRETER_OPTIONS, str(PROGRAM)],
        bufsize=0,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        pass_fds=(shared_memory,),
        cwd="/",
        env=_environment(),
        start_new_session=True,  # Ctrl-C is the trainer's affair, and one kill ends the whole group
    )


def _environment() -> dict[str, str]:
    """Fixed hash seed, so that sets iterate alike in every run; one thread, as a worker gets one core."""
    environment = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment |= {"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"}
    # Some interpreters do not start without the first two; by the others a user chooses how NumPy multiplies.
    for name in ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "OPENBLAS_CORETYPE", "MKL_CBWR", "NPY_DISABLE_CPU_FEATURES"):
        if name in os.environ:
            environment[name] = os.environ[name]
    return environment


def package_paths(*more: str) -> list[str]:
    """The folders that hold the packages a reward function may import, and more."""
    paths = []
    for name in (*PACKAGES, *more):
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            path = str(Path(spec.origin).parent.parent)
            if path not in paths:
                paths.append(path)
    return paths


def create_shared_memory(size: int) -> int:
    """A file descriptor of ``size`` zero bytes that lives in memory and has no name."""
    if sys.platform == "linux":
        descriptor = os.memfd_create("racecraft-reward", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(descriptor, size)
        # A process that shrank the memory could crash the trainer at its next access.
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
        return descriptor
    with tempfile.TemporaryFile() as file:
        os.ftruncate(file.fileno(), size)
        return os.dup(file.fileno())
