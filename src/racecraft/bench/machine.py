"""What this machine is and what it can do at most: the yardstick for every figure."""

from __future__ import annotations

import os
import platform
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from racecraft import __version__
from racecraft.sim import core_build, instruction_set
from racecraft.system import num_cores

COPY_BYTES = 1 << 27  # far beyond every cache


def describe_machine() -> dict[str, Any]:
    """Processor, cores, memory, versions; no names of hosts or people."""
    return {
        "processor": _processor(),
        "cores": num_cores(),
        "memory_gib": _memory_gib(),
        "instruction_set": instruction_set(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "racecraft": __version__,
    }


def describe_build() -> dict[str, Any]:
    """Version, commit where it is known, compiler, and the instruction sets that this build and this machine have."""
    build = core_build()
    return {"version": __version__, **build, "commit": build["commit"] or _commit_of_checkout()}


def copy_bandwidth() -> float:
    """Bytes per second that one thread writes when it copies memory; best of 5, as a limit should be."""
    source = np.ones(COPY_BYTES, np.uint8)
    target = np.empty_like(source)
    np.copyto(target, source)
    seconds = []
    for _ in range(5):
        begun = time.perf_counter()
        np.copyto(target, source)
        seconds.append(time.perf_counter() - begun)
    return COPY_BYTES / min(seconds)


def matrix_flops() -> float:
    """Floating-point operations per second of a large float32 matrix product on all cores; best of 5."""
    side = 1536
    left, right = np.ones((side, side), np.float32), np.ones((side, side), np.float32)
    product = left @ right
    seconds = []
    for _ in range(5):
        begun = time.perf_counter()
        np.matmul(left, right, out=product)
        seconds.append(time.perf_counter() - begun)
    return 2.0 * side**3 / min(seconds)


def _commit_of_checkout() -> str | None:
    root = Path(__file__).parents[3]
    if not (root / "pyproject.toml").exists():
        return None
    try:
        found = subprocess.run(["git", "-C", root, "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return found.stdout.strip() or None


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _memory_gib() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, OSError, ValueError):
        return None
