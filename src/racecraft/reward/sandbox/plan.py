"""A confinement as what the worker process enters it with: paths it may read, and filters of system calls."""

from __future__ import annotations

import functools
import importlib.util
import os
import struct
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from racecraft.reward.sandbox.confinement import FILTERS, Confinement

LIBRARIES: Final = ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/nix/store", "/etc/ld.so.cache")
PROCESSOR: Final = ("/proc/cpuinfo", "/sys/devices/system/cpu")  # by which some libraries choose their instructions


def make_plan(
    confinement: Confinement,
    *,
    packages: Sequence[str],
    files: Sequence[str],
    memory_limit: int,
    stages: Sequence[str] = ("loading", "serving"),
    written: int = 0,
) -> dict[str, Any]:
    """What `inside.enter` is called with.

    Args:
        confinement: The walls.
        packages: Names of packages that may be imported, beside the standard library.
        files: Paths that may be read, too.
        memory_limit: Address space, bytes.
        stages: Of the filters of system calls, one after the other; ``judging`` lets a process have threads.
        written: Bytes of the largest file that may be written, of those that it already has open.
    """
    folders, listed = readable(packages)
    machine = confinement.syscalls
    return {
        "memory_limit": memory_limit if confinement.limits else 0,
        "landlock": confinement.landlock,
        "readable": [*folders, *files],
        "listed": listed,
        "filters": [read_filter(machine, stage) for stage in stages] if machine else [],
        "written": written,
        "has_threads": "judging" in stages,
    }


def readable(packages: Sequence[str]) -> tuple[list[str], list[str]]:
    """Folders and files that importing reads, and folders that it lists; those that exist, links resolved."""
    found = [*LIBRARIES, *PROCESSOR, os.path.join(sys.base_prefix, "lib")]
    found += [sysconfig.get_path(name) for name in ("stdlib", "platstdlib")]
    found += [path for path in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if os.path.isabs(path)]
    listed = []
    for name in packages:
        folder = package_folder(name)
        if folder is not None:
            found += [str(folder), str(folder.with_name(f"{name}.libs"))]
            listed.append(str(folder.parent))
    return _existing(found), _existing(listed)


@functools.cache
def package_folder(name: str) -> Path | None:
    """Where a package is installed, links resolved, or None."""
    spec = importlib.util.find_spec(name)
    return Path(spec.origin).resolve().parent if spec is not None and spec.origin is not None else None


def read_filter(machine: str, stage: str) -> bytes:
    """A filter as the kernel takes it: eight bytes an instruction, in the processor's order, which is little-endian."""
    text = (FILTERS / f"{machine}-{stage}.txt").read_text(encoding="utf-8")
    return b"".join(struct.pack("<HBBI", *(int(part, 16) for part in line.split()[:4])) for line in text.splitlines())


def _existing(paths: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(os.path.realpath(path) for path in paths if os.path.exists(path)))
