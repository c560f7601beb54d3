"""What a console runs on: folders, storage, devices, and how strangers' reward code is kept in."""

from __future__ import annotations

import os
import platform
import shutil
from pathlib import Path
from typing import Final, Literal

from racecraft.reward.sandbox import find_confinement
from racecraft.serve.schemas import Message
from racecraft.serve.settings import ServeSettings
from racecraft.sim import instruction_set
from racecraft.system import memory_bytes, num_cores

MAX_FILES: Final = 50_000  # that are looked at to say how large a folder is
NVIDIA: Final = Path("/proc/driver/nvidia/gpus")

Sandbox = Literal["kernel", "process"]
"""``kernel``: reward code is locked in by Landlock, a filter of system calls and hard limits, somebody else's, too.
``process``: the system lacks one of them: one's own runs in a process with limits, somebody else's not at all."""


class Console(Message):
    """What this console is."""

    version: str
    runs: str
    cores: int
    user: str


class Machine(Message):
    """Where a console's work is done and kept."""

    runs: str
    """Folder of the runs."""
    tracks: str
    """Folder of the user's own tracks."""
    database: Literal["SQLite", "PostgreSQL"]
    used_bytes: int
    """By the runs folder, as far as `MAX_FILES` files."""
    is_used_complete: bool
    """Whether all files were counted."""
    free_bytes: int
    total_bytes: int
    sandbox: Sandbox
    processor: str
    cores: int
    instruction_set: str
    memory_bytes: int | None
    gpus: list[str]
    system: str
    python: str
    training_slots: int
    other_slots: int


def describe_machine(settings: ServeSettings) -> Machine:
    """Look at the machine; takes milliseconds, and longer only for very many files."""
    used, is_complete = _size(settings.runs)
    disk = shutil.disk_usage(settings.runs)
    return Machine(
        runs=str(settings.runs),
        tracks=str(settings.tracks),
        database="SQLite" if settings.database_url.startswith("sqlite") else "PostgreSQL",
        used_bytes=used,
        is_used_complete=is_complete,
        free_bytes=disk.free,
        total_bytes=disk.total,
        sandbox="kernel" if find_confinement().is_complete else "process",
        processor=_processor(),
        cores=num_cores(),
        instruction_set=instruction_set(),
        memory_bytes=memory_bytes(),
        gpus=_gpus(),
        system=f"{platform.system()} {platform.machine()}",
        python=platform.python_version(),
        training_slots=settings.training_slots,
        other_slots=settings.other_slots,
    )


def _size(folder: Path) -> tuple[int, bool]:
    total, seen, waiting = 0, 0, [str(folder)]
    while waiting:
        try:
            with os.scandir(waiting.pop()) as found:
                for item in found:
                    seen += 1
                    if seen > MAX_FILES:
                        return total, False
                    if item.is_dir(follow_symlinks=False):
                        waiting.append(item.path)
                    elif item.is_file(follow_symlinks=False):
                        total += item.stat(follow_symlinks=False).st_size
        except OSError:  # it was deleted meanwhile
            continue
    return total, True


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.processor()
    )


def _gpus() -> list[str]:
    names = []
    try:
        for path in sorted(NVIDIA.glob("*/information"))[:16]:
            lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
            names += [line.partition(":")[2].strip() for line in lines if line.startswith("Model")]
    except OSError:
        pass
    return names
