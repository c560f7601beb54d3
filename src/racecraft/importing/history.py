"""What came of a model before it was imported: metrics, sim-traces and logs, kept when their form is right."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from racecraft.checks import is_number
from racecraft.errors import RacecraftError, RunError
from racecraft.fidelity.logs import Faults, read_logs
from racecraft.importing.layout import Role, is_plain, role
from racecraft.importing.source import MAX_BYTES, SourceFile
from racecraft.run import read_metrics

HISTORY: Final[tuple[Role, ...]] = ("metrics", "trace", "log")
_NUMBERS: Final = ("metric_time", "start_time", "elapsed_time_in_milliseconds", "completion_percentage", "trial")


@dataclass
class History:
    """What was kept."""

    files: list[str] = field(default_factory=list)
    """Names below the folder of the original."""
    rows: int = 0
    """Steps in the sim-traces."""
    episodes: int = 0
    """Lines in the metrics."""
    refused: dict[str, str] = field(default_factory=dict)
    """Files that were left out, and why."""


def keep_history(files: Iterable[SourceFile], root: str, folder: Path) -> History:
    """Copy what is well-formed, under its path below the model's root.

    Args:
        files: All files of the model.
        root: Its folder, empty or with a slash at its end.
        folder: Where the copies go; made when there is one.
    """
    history = History()
    for file in sorted(files, key=lambda file: file.name):
        kind = role(file.name)
        if kind not in HISTORY:
            continue
        name = file.name.removeprefix(root)
        try:
            _keep(file, kind, name, folder, history)
        except (RacecraftError, OSError) as error:
            history.refused[name] = str(error).replace(str(folder / name), name).removesuffix(".")
    return history


def _keep(file: SourceFile, kind: Role, name: str, folder: Path, history: History) -> None:
    if not is_plain(name):
        raise RunError("its name has odd characters.")
    if file.path is None or file.size > MAX_BYTES[kind]:
        raise RunError(f"it has {file.size:,} bytes, more than {MAX_BYTES[kind]:,}.")
    copy = folder / name
    copy.parent.mkdir(parents=True, exist_ok=True)
    with file.path.open("rb") as source, copy.open("xb") as target:
        shutil.copyfileobj(source, target)
    try:
        if kind == "metrics":
            history.episodes += _count_metrics(copy)
        else:
            history.rows += _count_rows(copy)
    except BaseException:
        copy.unlink()
        raise
    history.files.append(name)


def _count_metrics(path: Path) -> int:
    lines: list[dict[str, Any]] = read_metrics(path)["metrics"]
    for number, line in enumerate(lines, 1):
        for key in _NUMBERS:
            value = line.get(key)
            if not is_number(value):
                raise RunError(f"{key} of trial {number} is not a number.")
        if not isinstance(line.get("episode_status"), str):
            raise RunError(f"trial {number} has no episode_status.")
    return len(lines)


def _count_rows(path: Path) -> int:
    with path.open("rb") as file:
        if file.read(2) == b"\x1f\x8b":
            raise RunError("it is packed once more.")
    faults = Faults()
    rows = sum(len(log) for log in read_logs([path], faults))
    if faults.count:
        raise RunError(f"{faults.count:,} rows are broken: {faults.notes[0]}.")
    return rows
