"""The filters of system calls: the committed data is what the script makes, and lets through what it says, on both
processors."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest
from bpf import ALLOW, EPERM, KILL, Call, run

from racecraft.reward.sandbox.plan import read_filter

ROOT = Path(__file__).parents[3]
SCRIPT = ROOT / "tools" / "syscall_filter.py"
HEADERS = {
    "x86_64": Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h"),
    "aarch64": Path("/usr/include/asm-generic/unistd.h"),
}


def load_script():
    spec = importlib.util.spec_from_file_location("syscall_filter", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


maker = load_script()
MACHINES = tuple(maker.NUMBERS)
O_RDONLY, O_WRONLY, O_RDWR, O_CREAT, O_TRUNC, O_APPEND, O_PATH = 0, 1, 2, 0o100, 0o1000, 0o2000, 0o10000000
O_CLOEXEC, O_TMPFILE = 0o2000000, 0o20000000


def answer(machine: str, stage: str, name: str, *arguments: int) -> int:
    return number_answer(machine, stage, maker.NUMBERS[machine][name], *arguments)


def number_answer(machine: str, stage: str, number: int, *arguments: int) -> int:
    call = Call(number, arguments, maker.AUDIT_ARCH[machine])
    return run(read_filter(machine, stage), call)


def test_the_committed_filters_are_what_the_script_makes():
    for name, text in maker.files().items():
        assert (maker.FOLDER / name).read_text(encoding="utf-8") == text, f"{name}: run python tools/syscall_filter.py"
    assert {path.name for path in maker.FOLDER.iterdir()} == set(maker.files())
    assert subprocess.run([sys.executable, str(SCRIPT), "--check"], check=False).returncode == 0


@pytest.mark.parametrize("machine", MACHINES)
def test_the_numbers_are_those_of_the_kernels_headers(machine):
    if not HEADERS[machine].exists():
        pytest.skip(f"no headers of Linux at {HEADERS[machine]}")
    text = HEADERS[machine].read_text(encoding="utf-8")
    theirs = {name: int(number) for name, number in re.findall(r"#define __NR(?:3264)?_(\w+)\s+(\d+)", text)}
    theirs["newfstatat"] = theirs.get("newfstatat", theirs.get("fstatat"))
    for name, number in maker.NUMBERS[machine].items():
        assert theirs[name] == number, name


@pytest.mark.costly
@pytest.mark.parametrize("machine", MACHINES)
def test_user_code_may_compute_and_nothing_else(machine):
    """Every number there is, with arguments of zero: what serving lets through is a list of harmless names."""
    names = {number: name for name, number in maker.NUMBERS[machine].items()}
    allowed = {names[n] for n in range(1024) if number_answer(machine, "serving", n) == ALLOW}
    harmless = {
        *("read", "write", "mmap", "munmap", "mremap", "mprotect", "madvise", "brk", "clock_nanosleep", "nanosleep"),
        *("clock_gettime", "clock_getres", "gettimeofday", "time", "getrandom", "futex", "sched_yield", "getpid"),
        *("gettid", "rt_sigreturn", "restart_syscall", "exit", "exit_group"),
    }
    assert allowed == harmless & set(maker.NUMBERS[machine])  # rt_sigaction of signal 0 is refused
    killed = {names[n] for n in range(1024) if number_answer(machine, "serving", n) == KILL}
    assert killed == set(maker.DEADLY) & set(maker.NUMBERS[machine])
    assert {"ptrace", "process_vm_writev", "bpf", "io_uring_setup", "userfaultfd", "unshare", "mount"} <= killed
    assert {"keyctl", "pidfd_open", "pidfd_getfd", "perf_event_open", "setns"} <= killed


@pytest.mark.parametrize("stage", maker.STAGES)
@pytest.mark.parametrize("machine", MACHINES)
def test_calls_by_other_ways_end_the_process(machine, stage):
    program = read_filter(machine, stage)
    for architecture in (0x40000003, 0x40000028, 0xC00000B7, 0xC000003E, 0):  # i386, arm, aarch64, x86_64, none
        if architecture != maker.AUDIT_ARCH[machine]:
            assert run(program, Call(0, architecture=architecture)) == KILL
    if machine == "x86_64":
        for number in (0x40000000, 0x40000000 | 257, 0x40000000 | 520, -1):
            assert number_answer(machine, stage, number) == KILL


@pytest.mark.parametrize("machine", MACHINES)
def test_files_are_opened_for_reading_alone_and_only_while_loading(machine):
    folders = {"x86_64": 0o200000, "aarch64": 0o40000}[machine]  # O_DIRECTORY
    for flags in (O_RDONLY, O_CLOEXEC, O_CLOEXEC | folders):
        assert answer(machine, "loading", "openat", -100, 0, flags) == ALLOW
        assert answer(machine, "serving", "openat", -100, 0, flags) == EPERM
    for flags in (O_WRONLY, O_RDWR, O_CREAT, O_TRUNC, O_APPEND, O_PATH, O_TMPFILE, O_RDONLY | O_CREAT, 3):
        assert answer(machine, "loading", "openat", -100, 0, flags | O_CLOEXEC) == EPERM
    for name in ("newfstatat", "statx", "readlinkat", "faccessat", "getcwd", "getdents64", "seccomp", "close"):
        assert answer(machine, "loading", name) == ALLOW
        assert answer(machine, "serving", name) == EPERM
    if machine == "x86_64":
        assert answer(machine, "loading", "open", 0, O_WRONLY) == EPERM
        assert answer(machine, "loading", "open", 0, O_RDONLY) == ALLOW


@pytest.mark.costly
@pytest.mark.parametrize("machine", MACHINES)
def test_a_judge_may_read_and_have_threads_and_nothing_else(machine):
    names = {number: name for name, number in maker.NUMBERS[machine].items()}
    allowed = {
        stage: {names[n] for n in range(1024) if number_answer(machine, stage, n) == ALLOW} for stage in maker.STAGES
    }
    assert allowed["judging"] == allowed["loading"] | {"set_robust_list", "rseq"}
    thread, process, namespace = 0x3D0F00, 0x1200011, 0x10000000  # of pthread_create, of fork, a user's own
    assert answer(machine, "judging", "clone", thread) == ALLOW
    for flags in (process, namespace, 0, 0x4100):  # the last of vfork
        assert answer(machine, "judging", "clone", flags) == EPERM
    assert answer(machine, "judging", "clone3", 4096, 88) == 0x00050000 | 38  # ENOSYS: clone is asked instead
    for stage in ("loading", "serving"):
        assert answer(machine, stage, "clone", thread) == answer(machine, stage, "clone3", 4096, 88) == EPERM
    for flags in (O_WRONLY, O_RDWR, O_CREAT, O_TRUNC, O_APPEND, O_TMPFILE):
        assert answer(machine, "judging", "openat", -100, 0, flags) == EPERM


@pytest.mark.parametrize("machine", MACHINES)
def test_arguments_decide(machine):
    for stage in maker.STAGES:
        assert answer(machine, stage, "clock_gettime", 1) == ALLOW
        assert answer(machine, stage, "clock_gettime", -6) == EPERM  # another process's clock
        assert answer(machine, stage, "clock_nanosleep", 0xFFFFFFFF00000000) == ALLOW  # the kernel looks at 32 bits
        for operation in (0, 1, 128, 129, 9 | 128 | 256):
            assert answer(machine, stage, "futex", 0, operation) == ALLOW
        for operation in (3, 4, 6, 7, 11, 12, 13):  # requeue and priority inheritance
            assert answer(machine, stage, "futex", 0, operation) == EPERM
        for signal in (4, 6, 7, 8, 11):
            assert answer(machine, stage, "rt_sigaction", signal) == ALLOW
        for signal in (2, 9, 10, 15, 24, 29):
            assert answer(machine, stage, "rt_sigaction", signal) == EPERM
    assert answer(machine, "loading", "prlimit64", 0, 7, 0, 4096) == ALLOW
    assert answer(machine, "loading", "prlimit64", 0, 7, 4096, 0) == EPERM
    assert answer(machine, "loading", "prlimit64", 0, 7, 1 << 40, 0) == EPERM
    assert answer(machine, "loading", "prlimit64", 1, 7, 0, 4096) == EPERM
    assert answer(machine, "serving", "prlimit64", 0, 7, 0, 4096) == EPERM
    assert answer(machine, "loading", "ioctl", 0, 0x5401) == ALLOW
    assert answer(machine, "loading", "ioctl", 0, 0x5412) == EPERM  # TIOCSTI types into a terminal
    assert answer(machine, "loading", "fcntl", 0, 4) == EPERM  # F_SETFL
