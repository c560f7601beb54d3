"""What the kernel of this machine offers to keep code in, and whose code may run with how much of it."""

from __future__ import annotations

import ctypes
import functools
import platform
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from racecraft.errors import RewardError
from racecraft.reward.sandbox.bubblewrap import find_bubblewrap

FILTERS: Final = Path(__file__).with_name("filters")

_LANDLOCK_CREATE_RULESET: Final = 444  # the same number on every architecture
_LANDLOCK_CREATE_RULESET_VERSION: Final = 1
_SECCOMP: Final = {"x86_64": 317, "aarch64": 277}
_SECCOMP_GET_ACTION_AVAIL: Final = 2
_SECCOMP_RET_KILL_PROCESS: Final = 0x80000000


@dataclass(frozen=True, kw_only=True)
class Confinement:
    """The walls around one worker process."""

    landlock: int = 0
    """Version of Landlock's interface, which decides what paths can be opened; 0 without."""
    syscalls: str = ""
    """Processor whose filter of system calls is used, ``x86_64`` or ``aarch64``; empty without."""
    bubblewrap: str = ""
    """Path of ``bwrap``, which hides the file system and the network, too; empty without. It is an addition."""
    limits: bool = True
    """Hard limits on memory, files and processes."""

    @property
    def is_complete(self) -> bool:
        """Whether foreign code may run in it."""
        return bool(self.landlock and self.syscalls and self.limits)

    @property
    def missing(self) -> str:
        """What the kernel lacks, for a sentence; empty where it is complete."""
        lacks = [
            name
            for name, is_there in (("Landlock", self.landlock), ("a filter of system calls (seccomp)", self.syscalls))
            if not is_there
        ]
        return " and ".join(lacks)

    def __str__(self) -> str:
        parts = [f"Landlock {self.landlock}"] if self.landlock else []
        parts += ["filtered system calls"] if self.syscalls else []
        parts += ["hard limits"] if self.limits else []
        parts += ["bubblewrap"] if self.bubblewrap else []
        return ", ".join(parts) or "nothing"

    def require(self) -> None:
        """Refuse foreign code where it could get out.

        Raises:
            RewardError: The confinement is not complete.
        """
        if not self.is_complete:
            raise RewardError(
                "This reward function comes from somebody else and is not run here: the system cannot lock it in, "
                f"for lack of {self.missing or 'limits'}.",
                hint="Linux 5.13 or newer with Landlock can. If you have read the function and trust it, start a run "
                "of your own with it (New model, or racecraft train --reward FILE).",
            )


UNCONFINED: Final = Confinement(limits=False)
"""No walls at all: what benchmarks and tests compare with."""


@functools.cache
def find_confinement() -> Confinement:
    """All that this machine offers."""
    machine = platform.machine()
    if sys.platform != "linux" or sys.maxsize < 2**32 or machine not in _SECCOMP:
        return Confinement()
    call = ctypes.CDLL(None, use_errno=True).syscall
    call.restype = ctypes.c_long
    version = call(_LANDLOCK_CREATE_RULESET, None, ctypes.c_size_t(0), _LANDLOCK_CREATE_RULESET_VERSION)
    kills = ctypes.c_uint32(_SECCOMP_RET_KILL_PROCESS)
    can_filter = call(_SECCOMP[machine], _SECCOMP_GET_ACTION_AVAIL, 0, ctypes.byref(kills)) == 0
    return Confinement(
        landlock=max(int(version), 0),
        syscalls=machine if can_filter else "",
        bubblewrap=find_bubblewrap(),
    )
