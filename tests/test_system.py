"""What differs between systems: as it is here, and as it would be where this one's modules are missing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from racecraft import system
from racecraft.errors import RacecraftError

SOURCE = Path(system.__file__).parent
ELSEWHERE = """
import builtins, importlib, os, pkgutil, signal, subprocess, sys, types
{before}
for module in ("fcntl", "resource", "termios", "pwd", "grp", "pty"):
    sys.modules[module] = None  # importing it fails
for function in ("memfd_create", "sched_getaffinity", "sched_setaffinity", "nice", "killpg", "sysconf", "fork"):
    delattr(os, function)
for name in ("SIGUSR1", "SIGKILL", "SIGALRM"):
    delattr(signal, name)
locked = []
windows = types.ModuleType("msvcrt")
windows.LK_NBLCK = 2
windows.locking = lambda descriptor, mode, count: locked.append((os.lseek(descriptor, 0, os.SEEK_CUR), mode, count))
sys.modules["msvcrt"] = windows
import racecraft
{after}
"""


def elsewhere(after: str, *, before: str = "") -> str:
    """What a program prints where there is nothing of POSIX but its files."""
    program = ELSEWHERE.format(before=before, after=after)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.costly
def test_every_verb_and_all_but_the_walls_load_without_posix() -> None:
    heavy = ("torch", "cuda", "casadi")  # libraries that ask the system themselves
    printed = elsewhere(
        f"""
import racecraft.cli.entry
racecraft.cli.entry.every_verb()
for found in pkgutil.walk_packages(racecraft.__path__, "racecraft."):
    name = found.name
    if any(word in name for word in {heavy!r}) or ".presets." in name or "migrations" in name or ".starters" in name:
        continue
    if name.startswith(("racecraft.reward.sandbox.inside", "racecraft.learn.sb3", "racecraft.serve.jobs.__main__")):
        continue
    if name.endswith("__main__") or name.startswith("racecraft.gpu"):
        continue
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name in ("fcntl", "resource", "termios", "pwd", "grp", "pty"):
            print(name, error)
"""
    )
    assert printed == ""


def test_what_there_is_elsewhere_is_used_and_the_rest_refused(tmp_path: Path) -> None:
    printed = elsewhere(
        f"""
from racecraft import system
from racecraft.errors import RacecraftError
from racecraft.run.lock import exclusive_lock
print(system.num_cores() == (os.cpu_count() or 1), system.memory_bytes(), system.TRACE)
system.lower_priority(15)
system.ask_where(os.getpid())
with exclusive_lock(__import__("pathlib").Path({str(tmp_path / "a.lock")!r})):
    print(locked)
descriptor = system.unnamed_memory(64)
print(os.fstat(descriptor).st_size)
child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
system.end(child.pid, with_group=True)
print(child.wait() != 0)
os.name = "nt"
print(system.apart())
try:
    system.apart(3)
except RacecraftError as error:
    print(error)
try:
    system.limit(seconds=1, written=1)
except RacecraftError as error:
    print(error)
""",
    )
    assert printed.splitlines() == [
        "True None 0",
        "[(1000, 2, 1)]",
        "64",
        "True",
        "{'creationflags': 512}",
        "Windows hands no open files to another process.",
        "This system limits no process.",
    ]


@pytest.mark.skipif(os.name != "posix", reason="limits of processes")
def test_limits_are_set_and_those_that_are_lower_already_stay() -> None:
    program = """
import resource, sys
from racecraft import system
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, int(sys.argv[1])))
system.limit(seconds=60, written=5000)
print(*(resource.getrlimit(kind) for kind in (resource.RLIMIT_CPU, resource.RLIMIT_FSIZE, resource.RLIMIT_CORE)))
"""
    for hard, written in (("-1", 5000), ("9000", 5000), ("3000", 3000)):
        done = subprocess.run([sys.executable, "-c", program, hard], capture_output=True, text=True, check=True)
        assert done.stdout.split() == f"(60, 60) ({written}, {written}) (0, 0)".split()


@pytest.mark.costly
@pytest.mark.skipif(os.name != "posix", reason="groups of processes")
def test_a_process_ends_with_all_that_it_started() -> None:
    program = "import subprocess, sys; print(subprocess.Popen(['sleep', '60']).pid, flush=True); input()"
    popen = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **system.apart()
    )
    assert popen.stdin is not None
    assert popen.stdout is not None
    child = int(popen.stdout.readline())
    assert os.getpgid(popen.pid) == popen.pid != os.getpgid(0)
    system.end(popen.pid, with_group=True)
    assert system.end_of(popen.wait()) == "SIGKILL"
    deadline = time.monotonic() + 50  # by itself it would end after sixty
    while Path(f"/proc/{child}").exists() and "Z" not in Path(f"/proc/{child}/stat").read_text().rsplit(")", 1)[1][:3]:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    popen.stdin.close()
    popen.stdout.close()
    system.end(popen.pid)  # gone already: nothing
    assert system.end_of(3) == ""
    assert system.end_of(-int(signal.SIGTERM)) == "SIGTERM"
    assert system.end_of(-63) == "signal 63"


@pytest.mark.skipif(sys.platform != "linux", reason="sealed memory")
def test_memory_that_is_shared_cannot_be_made_smaller() -> None:
    descriptor = system.unnamed_memory(4096)
    with pytest.raises(PermissionError):
        os.ftruncate(descriptor, 0)
    os.close(descriptor)


def test_two_open_files_do_not_lock_the_same(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    first, second = (os.open(path, os.O_RDWR | os.O_CREAT) for _ in range(2))
    system.lock(first)
    with pytest.raises(OSError):
        system.lock(second)
    os.close(first)
    system.lock(second)
    os.close(second)


def test_nothing_else_asks_what_system_it_is_on() -> None:
    """So that the next system is one file's affair."""
    words = (
        "import fcntl",
        "import resource",
        "import msvcrt",
        "sched_getaffinity",
        "killpg(",
        "start_new_session",
        "signal.SIGKILL",
        "os.nice(",
    )
    allowed = ("system.py", "reward/sandbox/", "reward/worker_process.py")
    found = [
        f"{path.relative_to(SOURCE)}: {word}"
        for path in sorted(SOURCE.rglob("*.py"))
        for word in words
        if word in path.read_text(encoding="utf-8") and not str(path.relative_to(SOURCE)).startswith(allowed)
    ]
    assert found == []
    assert issubclass(RacecraftError, Exception)
