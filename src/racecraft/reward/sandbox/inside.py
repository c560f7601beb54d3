"""Locks a process in, from the inside and before the first byte of a stranger's.

The reward worker's program loads this file by its path, without the rest of Racecraft; a league's judge imports it.
Both call `enter`. From then on the process may read what importing modules takes, and what else its plan names; the
function that `enter` returns takes that from the reward worker, too.
Numbers are those of the kernel's ``include/uapi/linux`` headers.
"""

from __future__ import annotations

import os
import resource
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

PR_SET_DUMPABLE, PR_SET_NO_NEW_PRIVS = 4, 38
LANDLOCK_CREATE_RULESET, LANDLOCK_ADD_RULE, LANDLOCK_RESTRICT_SELF = 444, 445, 446
LANDLOCK_RULE_PATH_BENEATH = 1
READ_FILE, READ_DIR = 1 << 2, 1 << 3
FILE_RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}  # how many there are, by version; none was added since
NET_SINCE, SCOPES_SINCE = 4, 6
NET_RIGHTS = 0b11  # bind and connect TCP
SCOPES = 0b11  # abstract sockets, signals
SECCOMP_SET_MODE_FILTER = 1
CAPABILITY_VERSION_3 = 0x20080522
CAP_DAC_READ_SEARCH = 1 << 2
SYSCALLS = {
    "x86_64": {"capget": 125, "capset": 126, "seccomp": 317},
    "aarch64": {"capget": 90, "capset": 91, "seccomp": 277},
}


def enter(plan: dict[str, Any], descriptors: tuple[int, ...]) -> Callable[[], None]:
    """Put up the walls around this process, and leave it these file descriptors.

    Returns:
        What takes the rest away, where the plan has more filters: after it no path can be opened, or even looked at.

    Raises:
        OSError: The kernel refuses a wall; the process must not go on.
    """
    if plan["memory_limit"]:
        close_all_but(*descriptors)
        limit(plan["memory_limit"], written=plan["written"], has_threads=plan["has_threads"])
    first, others = plan["filters"][:1], plan["filters"][1:]
    if not plan["landlock"] and not first:
        return lambda: None
    kernel = Kernel()
    kernel.require("prctl", kernel.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
    kernel.require("prctl", kernel.prctl(PR_SET_DUMPABLE, 0, 0, 0, 0))  # nobody of the same user looks inside, either
    kernel.drop_capabilities()
    if plan["landlock"]:
        kernel.restrict_paths(plan["landlock"], plan["readable"], plan["listed"])
    for program in first:
        kernel.filter_calls(program)

    def finish() -> None:
        for program in others:
            kernel.filter_calls(program)

    return finish


def close_all_but(*kept: int) -> None:
    """Close every file descriptor that was inherited by mistake."""
    first = 0
    for descriptor in (*sorted(kept), os.sysconf("SC_OPEN_MAX")):
        if first < descriptor:  # an empty range would close everything
            os.closerange(first, descriptor)
        first = descriptor + 1


def limit(memory: int, *, written: int, has_threads: bool) -> None:
    """Set limits that cannot be raised again, in bytes of memory and of a written file; and no process is started.

    A process that has threads has no limit of processes: the system counts those as well, of all that the user runs.
    """
    for kind, most in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_FSIZE, written),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_NOFILE, 64),
        *(() if has_threads else ((resource.RLIMIT_NPROC, 0),)),
    ):
        hard = resource.getrlimit(kind)[1]
        value = most if hard == resource.RLIM_INFINITY else min(most, hard)
        try:
            resource.setrlimit(kind, (value, value))
        except (OSError, ValueError):  # macOS does not let RLIMIT_AS be lowered
            if sys.platform == "linux":
                raise


class Kernel:
    """The few calls that Python has no function for."""

    def __init__(self) -> None:
        import ctypes

        self._ctypes = ctypes
        library = ctypes.CDLL(None, use_errno=True)
        self._call = library.syscall
        self._call.restype = ctypes.c_long
        self.prctl = library.prctl
        self.prctl.argtypes = (ctypes.c_int, *(ctypes.c_ulong,) * 4)
        self._numbers = SYSCALLS[os.uname().machine]

    def require(self, what: str, result: int) -> int:
        """The result of a call.

        Raises:
            OSError: It is none.
        """
        if result < 0:
            error = self._ctypes.get_errno()
            raise OSError(error, f"{what}: {os.strerror(error)}")
        return result

    def call(self, number: int, *arguments: object) -> int:
        """A system call; whole numbers are passed as 64 bits."""
        wide = [self._ctypes.c_long(value) if isinstance(value, int) else value for value in arguments]
        return int(self._call(self._ctypes.c_long(number), *wide))

    def drop_capabilities(self) -> None:
        """Take from root what makes it root; but it may still read others' folders, where the packages may be."""
        words = self._ctypes.c_uint32
        header = (words * 2)(CAPABILITY_VERSION_3, 0)
        held = (words * 6)()  # effective, permitted, inheritable, of the lower 32, then of the upper 32
        self.require("capget", self.call(self._numbers["capget"], header, held))
        kept = (words * 6)(held[0] & CAP_DAC_READ_SEARCH, held[1] & CAP_DAC_READ_SEARCH)
        header[0] = CAPABILITY_VERSION_3
        self.require("capset", self.call(self._numbers["capset"], header, kept))

    def restrict_paths(self, version: int, readable: list[str], listed: list[str]) -> None:
        """Landlock: read these, list those; nothing to write, run, send to or signal."""
        import struct

        files = (1 << FILE_RIGHTS[min(version, max(FILE_RIGHTS))]) - 1
        net = NET_RIGHTS if version >= NET_SINCE else 0
        scopes = SCOPES if version >= SCOPES_SINCE else 0
        attributes = struct.pack("<QQQ", files, net, scopes)
        rules = self.require("landlock_create_ruleset", self.call(LANDLOCK_CREATE_RULESET, attributes, 24, 0))
        for paths, rights in ((readable, READ_FILE | READ_DIR), (listed, READ_DIR)):
            for path in paths:
                place = os.open(path, os.O_PATH | os.O_CLOEXEC)
                allowed = rights if os.path.isdir(path) else rights & READ_FILE
                beneath = struct.pack("<Qi", allowed, place)
                added = self.call(LANDLOCK_ADD_RULE, rules, LANDLOCK_RULE_PATH_BENEATH, beneath, 0)
                self.require(f"landlock_add_rule for {path}", added)
                os.close(place)
        self.require("landlock_restrict_self", self.call(LANDLOCK_RESTRICT_SELF, rules, 0))
        os.close(rules)

    def filter_calls(self, program: bytes) -> None:
        """Seccomp: no system calls but those that the program lets through, on top of the filters there are."""
        import struct

        instructions = self._ctypes.create_string_buffer(program, len(program))
        found = struct.pack("@HP", len(program) // 8, self._ctypes.addressof(instructions))  # struct sock_fprog
        self.require("seccomp", self.call(self._numbers["seccomp"], SECCOMP_SET_MODE_FILTER, 0, found))
