"""Write the sandbox's filters of system calls: classic BPF programs as data, so that nothing is compiled to run.

    python tools/syscall_filter.py          # rewrites src/racecraft/reward/sandbox/filters/
    python tools/syscall_filter.py --check  # fails where they are not what this script makes

There are three for each processor. While *loading*, the reward worker still imports modules that are known and good: it
may read files. While *serving*, user code runs: it may compute, wait, and use the pipes and memory it already has, and
can no longer name any path. The kernel keeps both, so that the second only takes away. While *judging*, a league drives
by weights of a stranger: it may read as while loading, and have threads.

A call that is not listed fails with EPERM, which Python turns into a PermissionError with a line. Calls that have no
business in any Python program of this kind end the process, as does every call by the 32-bit or x32 way.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parents[1] / "src" / "racecraft" / "reward" / "sandbox" / "filters"
STAGES: Final = ("loading", "serving", "judging")

# Numbers from the kernel's arch/x86/entry/syscalls/syscall_64.tbl and include/uapi/asm-generic/unistd.h, which never
# change; a test compares them with the headers of the machine it runs on. aarch64 has only the newer of similar calls.
NUMBERS: Final[Mapping[str, Mapping[str, int]]] = {
    "x86_64": {
        **{"read": 0, "write": 1, "open": 2, "close": 3, "stat": 4, "fstat": 5, "lstat": 6, "lseek": 8, "mmap": 9},
        **{"mprotect": 10, "munmap": 11, "brk": 12, "rt_sigaction": 13, "rt_sigprocmask": 14, "rt_sigreturn": 15},
        **{"ioctl": 16, "pread64": 17, "access": 21, "sched_yield": 24, "mremap": 25, "madvise": 28, "dup": 32},
        **{"nanosleep": 35, "getpid": 39, "exit": 60, "uname": 63, "fcntl": 72, "getcwd": 79, "readlink": 89},
        **{"gettimeofday": 96, "getrusage": 98, "sysinfo": 99, "getuid": 102, "getgid": 104, "geteuid": 107},
        **{"getegid": 108, "getppid": 110, "sigaltstack": 131, "statfs": 137, "fstatfs": 138, "gettid": 186},
        **{"time": 201, "futex": 202, "sched_getaffinity": 204, "getdents64": 217, "restart_syscall": 219},
        **{"clock_gettime": 228, "clock_getres": 229, "clock_nanosleep": 230, "exit_group": 231, "openat": 257},
        **{"newfstatat": 262, "readlinkat": 267, "faccessat": 269, "prlimit64": 302, "seccomp": 317},
        **{"getrandom": 318, "statx": 332, "faccessat2": 439},
        **{"clone": 56, "clone3": 435, "set_robust_list": 273, "rseq": 334},
        **{"ptrace": 101, "process_vm_readv": 310, "process_vm_writev": 311, "process_madvise": 440, "kcmp": 312},
        **{"bpf": 321, "perf_event_open": 298, "userfaultfd": 323, "io_uring_setup": 425, "io_uring_enter": 426},
        **{"io_uring_register": 427, "unshare": 272, "setns": 308, "mount": 165, "umount2": 166, "pivot_root": 155},
        **{"chroot": 161, "open_tree": 428, "move_mount": 429, "fsopen": 430, "fsconfig": 431, "fsmount": 432},
        **{"fspick": 433, "mount_setattr": 442, "add_key": 248, "request_key": 249, "keyctl": 250},
        **{"pidfd_send_signal": 424, "pidfd_open": 434, "pidfd_getfd": 438, "open_by_handle_at": 304},
        **{"name_to_handle_at": 303, "init_module": 175, "finit_module": 313, "delete_module": 176},
        **{"kexec_load": 246, "kexec_file_load": 320, "reboot": 169, "swapon": 167, "swapoff": 168, "iopl": 172},
        **{"ioperm": 173, "modify_ldt": 154},
    },
    "aarch64": {
        **{"getcwd": 17, "dup": 23, "fcntl": 25, "ioctl": 29, "statfs": 43, "fstatfs": 44, "faccessat": 48},
        **{"openat": 56, "close": 57, "getdents64": 61, "lseek": 62, "read": 63, "write": 64, "pread64": 67},
        **{"readlinkat": 78, "newfstatat": 79, "fstat": 80, "exit": 93, "exit_group": 94, "futex": 98},
        **{"nanosleep": 101, "clock_gettime": 113, "clock_getres": 114, "clock_nanosleep": 115},
        **{"sched_getaffinity": 123, "sched_yield": 124, "restart_syscall": 128, "sigaltstack": 132},
        **{"rt_sigaction": 134, "rt_sigprocmask": 135, "rt_sigreturn": 139, "uname": 160, "getrusage": 165},
        **{"gettimeofday": 169, "getpid": 172, "getppid": 173, "getuid": 174, "geteuid": 175, "getgid": 176},
        **{"getegid": 177, "gettid": 178, "sysinfo": 179, "brk": 214, "munmap": 215, "mremap": 216, "mmap": 222},
        **{"mprotect": 226, "madvise": 233, "prlimit64": 261, "seccomp": 277, "getrandom": 278, "statx": 291},
        **{"faccessat2": 439, "clone": 220, "clone3": 435, "set_robust_list": 99, "rseq": 293},
        **{"ptrace": 117, "process_vm_readv": 270, "process_vm_writev": 271, "process_madvise": 440, "kcmp": 272},
        **{"bpf": 280, "perf_event_open": 241, "userfaultfd": 282, "io_uring_setup": 425, "io_uring_enter": 426},
        **{"io_uring_register": 427, "unshare": 97, "setns": 268, "mount": 40, "umount2": 39, "pivot_root": 41},
        **{"chroot": 51, "open_tree": 428, "move_mount": 429, "fsopen": 430, "fsconfig": 431, "fsmount": 432},
        **{"fspick": 433, "mount_setattr": 442, "add_key": 217, "request_key": 218, "keyctl": 219},
        **{"pidfd_send_signal": 424, "pidfd_open": 434, "pidfd_getfd": 438, "open_by_handle_at": 265},
        **{"name_to_handle_at": 264, "init_module": 105, "finit_module": 273, "delete_module": 106},
        **{"kexec_load": 104, "kexec_file_load": 294, "reboot": 142, "swapon": 224, "swapoff": 225},
    },
}
AUDIT_ARCH: Final = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}  # linux/audit.h
X32_BIT: Final = 0x40000000  # of a call's number, on x86_64 alone

# --- what is allowed

COMPUTING: Final = (  # most frequent first
    *("read", "write", "mmap", "munmap", "mremap", "mprotect", "madvise", "brk", "clock_nanosleep", "nanosleep"),
    *("clock_gettime", "clock_getres", "gettimeofday", "time", "getrandom", "futex", "sched_yield", "getpid"),
    *("gettid", "rt_sigreturn", "rt_sigaction", "restart_syscall", "exit", "exit_group"),
)
READING: Final = (  # what importing a module takes, and installing the second filter
    *("openat", "open", "close", "newfstatat", "fstat", "stat", "lstat", "statx", "lseek", "pread64", "getdents64"),
    *("readlink", "readlinkat", "access", "faccessat", "faccessat2", "getcwd", "statfs", "fstatfs", "dup", "fcntl"),
    *("ioctl", "uname", "sysinfo", "sched_getaffinity", "getrusage", "prlimit64", "getuid", "geteuid", "getgid"),
    *("getegid", "getppid", "rt_sigprocmask", "sigaltstack", "seccomp"),
)
THREADING: Final = ("clone", "clone3", "set_robust_list", "rseq")
ALLOWED: Final = {
    "loading": (*COMPUTING, *READING),
    "serving": COMPUTING,
    "judging": (*COMPUTING, *THREADING, *READING),
}
DEADLY: Final = (
    *("ptrace", "process_vm_readv", "process_vm_writev", "process_madvise", "kcmp", "bpf", "perf_event_open"),
    *("userfaultfd", "io_uring_setup", "io_uring_enter", "io_uring_register", "unshare", "setns", "mount", "umount2"),
    *("pivot_root", "chroot", "open_tree", "move_mount", "fsopen", "fsconfig", "fsmount", "fspick", "mount_setattr"),
    *("add_key", "request_key", "keyctl", "pidfd_send_signal", "pidfd_open", "pidfd_getfd", "open_by_handle_at"),
    *("name_to_handle_at", "init_module", "finit_module", "delete_module", "kexec_load", "kexec_file_load"),
    *("reboot", "swapon", "swapoff", "iopl", "ioperm", "modify_ldt"),
)

# Of an open for reading: O_NOCTTY, O_NONBLOCK, O_LARGEFILE, O_DIRECTORY, O_NOFOLLOW, O_CLOEXEC; three of them have
# other values on aarch64. O_RDONLY is 0; nothing that writes, creates, truncates or only names a file is among them.
OPEN_FLAGS: Final = {
    "x86_64": 0o400 | 0o4000 | 0o100000 | 0o200000 | 0o400000 | 0o2000000,
    "aarch64": 0o400 | 0o4000 | 0o400000 | 0o40000 | 0o100000 | 0o2000000,
}
FUTEX_MODIFIERS: Final = 128 | 256  # FUTEX_PRIVATE_FLAG, FUTEX_CLOCK_REALTIME
FUTEX_OPERATIONS: Final = (0, 1, 9, 10)  # WAIT, WAKE, WAIT_BITSET, WAKE_BITSET
THREAD: Final = 0x10000  # CLONE_THREAD
LAST_CLOCK: Final = 11  # CLOCK_TAI; larger and negative numbers are the clocks of processes and devices
CRASHES: Final = (4, 6, 7, 8, 11)  # SIGILL, SIGABRT, SIGBUS, SIGFPE, SIGSEGV: their handler takes itself away, to end
FCNTL_COMMANDS: Final = (0, 1, 2, 3, 1030)  # F_DUPFD, F_GETFD, F_SETFD, F_GETFL, F_DUPFD_CLOEXEC
IOCTL_COMMANDS: Final = (0x5401, 0x5413, 0x5451)  # TCGETS, TIOCGWINSZ, FIOCLEX: what opening a file asks

# --- the program

LOAD, JUMP, EQUAL, GREATER, AT_LEAST, AND, RETURN = 0x20, 0x05, 0x15, 0x25, 0x35, 0x54, 0x06  # linux/bpf_common.h
NUMBER, ARCHITECTURE, ARGUMENTS = 0, 4, 16  # offsets in struct seccomp_data
ALLOW, REFUSE, KILL = "allow", "refuse", "kill"
ACTIONS: Final = {ALLOW: 0x7FFF0000, REFUSE: 0x00050000 | 1, KILL: 0x80000000}  # RET_ALLOW, ERRNO | EPERM, KILL_PROCESS
NOT_THERE: Final = 0x00050000 | 38  # ERRNO | ENOSYS

Line = tuple[str, int, str, str, int, str]  # label, code, label if true, label if not ("" the next line), value, remark


def argument(index: int, *, high: bool = False) -> int:
    """Offset of an argument's lower or upper half; both processors are little-endian."""
    return ARGUMENTS + 8 * index + (4 if high else 0)


def lines(machine: str, stage: str) -> Iterator[Line]:
    """The program as lines that jump to labels."""
    numbers = NUMBERS[machine]
    yield "", LOAD, "", "", ARCHITECTURE, "the architecture of the call"
    yield "", EQUAL, "", KILL, AUDIT_ARCH[machine], machine
    yield "", LOAD, "", "", NUMBER, "the number of the call"
    if machine == "x86_64":
        yield "", AT_LEAST, KILL, "", X32_BIT, "x32"
    allowed = ALLOWED[stage]
    blocks = {name: block for name, block in checks(machine).items() if name in allowed and name in numbers}
    for name in allowed:
        if name in numbers:
            yield "", EQUAL, name if name in blocks else ALLOW, "", numbers[name], name
    for name in DEADLY:
        if name in numbers:
            yield "", EQUAL, KILL, "", numbers[name], name
    yield "", RETURN, "", "", ACTIONS[REFUSE], "anything else: EPERM"
    for name, block in blocks.items():
        (_, *first), *others = block
        yield (name, *first)
        yield from others
    yield KILL, RETURN, "", "", ACTIONS[KILL], "end the process"
    yield REFUSE, RETURN, "", "", ACTIONS[REFUSE], "EPERM"
    yield ALLOW, RETURN, "", "", ACTIONS[ALLOW], "allow"


def checks(machine: str) -> dict[str, list[Line]]:
    """Calls that are allowed with some arguments alone."""
    return {
        **{name: only_flags(index, OPEN_FLAGS[machine]) for name, index in (("openat", 2), ("open", 1))},
        **{name: system_clock() for name in ("clock_gettime", "clock_getres", "clock_nanosleep")},
        "futex": [
            ("", LOAD, "", "", argument(1), "the operation"),
            ("", AND, "", "", 0xFFFFFFFF ^ FUTEX_MODIFIERS, "without its modifiers"),
            *one_of(FUTEX_OPERATIONS),
        ],
        "rt_sigaction": [("", LOAD, "", "", argument(0), "the signal"), *one_of(CRASHES)],
        "clone": [
            ("", LOAD, "", "", argument(0), "the flags"),
            ("", AND, "", "", THREAD, "a thread of this process"),
            ("", EQUAL, ALLOW, REFUSE, THREAD, "and no process"),
        ],
        # whose flags lie in memory, where no filter sees them: the C library then takes the other one
        "clone3": [("", RETURN, "", "", NOT_THERE, "ENOSYS")],
        "fcntl": [("", LOAD, "", "", argument(1), "the command"), *one_of(FCNTL_COMMANDS)],
        "ioctl": [("", LOAD, "", "", argument(1), "the request"), *one_of(IOCTL_COMMANDS)],
        "prlimit64": [
            ("", LOAD, "", "", argument(0), "whose limit"),
            ("", EQUAL, "", REFUSE, 0, "one's own"),
            ("", LOAD, "", "", argument(2), "address of the new limit"),
            ("", EQUAL, "", REFUSE, 0, "none"),
            ("", LOAD, "", "", argument(2, high=True), "its upper half"),
            ("", EQUAL, ALLOW, REFUSE, 0, "none"),
        ],
    }


def only_flags(index: int, flags: int) -> list[Line]:
    """An argument that may have these bits and no other."""
    return [
        ("", LOAD, "", "", argument(index), "the flags"),
        ("", AND, "", "", 0xFFFFFFFF ^ flags, "but those of reading"),
        ("", EQUAL, ALLOW, REFUSE, 0, "none"),
    ]


def system_clock() -> list[Line]:
    """A first argument that names a clock of the whole system."""
    return [
        ("", LOAD, "", "", argument(0), "the clock"),
        ("", GREATER, REFUSE, ALLOW, LAST_CLOCK, "one of the system's"),
    ]


def one_of(values: tuple[int, ...]) -> Iterator[Line]:
    """Go on to the end where what is loaded is one of these."""
    for value in values[:-1]:
        yield "", EQUAL, ALLOW, "", value, "allowed"
    yield "", EQUAL, ALLOW, REFUSE, values[-1], "allowed"


def assemble(program: list[Line]) -> str:
    """The listing: an instruction a line as code, jump if true, jump if not, value, in hexadecimal; and its meaning."""
    places = {label: place for place, (label, *_) in enumerate(program) if label}
    text = []
    for place, (label, code, if_true, if_false, value, remark) in enumerate(program):
        jumps = [places[to] - place - 1 if to else 0 for to in (if_true, if_false)]
        if not all(0 <= jump <= 255 for jump in jumps):
            raise ValueError(f"line {place} ({remark}) jumps too far: {jumps}")
        head = f"{label}: " if label else ""
        targets = f" -> {if_true or 'next'} or {if_false or 'next'}" if if_true or if_false else ""
        text.append(f"{code:02x} {jumps[0]:02x} {jumps[1]:02x} {value:08x}  {head}{remark}{targets}")
    return "\n".join(text) + "\n"


def files() -> dict[str, str]:
    """Every filter by its file's name."""
    return {f"{machine}-{stage}.txt": assemble(list(lines(machine, stage))) for machine in NUMBERS for stage in STAGES}


def main() -> None:
    """Write the files, or look whether they are right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing; fail where a file differs")
    stale = []
    is_check = parser.parse_args().check
    for name, text in files().items():
        path = FOLDER / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if not is_check:
                path.write_text(text, encoding="utf-8")
    print(f"{'differ' if is_check else 'written'}: {', '.join(stale) or 'none'}")
    sys.exit(bool(is_check and stale))


if __name__ == "__main__":
    main()
