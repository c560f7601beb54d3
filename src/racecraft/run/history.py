"""The curves of a training, a line of JSON for every point, so that a viewer can follow the file as it grows.

    {"kind": "iteration", "step": 4096, "seconds": 0.61, "reward": 31.2, "completion": 0.44, ...}
    {"kind": "iteration", "step": 0, "seconds": 0.35, ..., "lesson": 0.02}  of a teacher: how much it has learned
    {"kind": "evaluation", "step": 4096, "seconds": 0.70, "completions": [1.0, ...], "lap_times": [9.1], ...}
    {"kind": "note", "step": 4096, "seconds": 0.70, "text": "..."}

What is not known yet is null. A byte offset into the file names a point for good: lines are only ever added, but for
those that a killed run wrote after its last checkpoint, which its successor writes again.
"""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path
from typing import Any, Final

from racecraft.errors import RunError
from racecraft.json_file import parse_json_line
from racecraft.run.closing import Closing

SPACING: Final = 0.25  # s between two iterations that are written, at least: an hour is 3 MB
MAX_LINE: Final = 64 * 1024  # bytes; a longer one is not ours


class HistoryWriter(Closing):
    """Appends points to a run's history; a context manager.

    Args:
        path: The file, made when missing.
        step: Points of later steps are dropped first, as a resumed run does from its checkpoint on; 0 starts anew.
    """

    def __init__(self, path: Path, *, step: int = 0) -> None:
        self.path = path
        self._next = 0.0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            keep = _offset_after(path, step) if step and path.exists() else 0
            self._file = path.open("ab")
            os.truncate(path, keep)
        except OSError as error:
            raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error

    def add_iteration(self, point: dict[str, Any]) -> None:
        """An iteration's figures; left out when the last one is less than a quarter of a second old."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + SPACING
            self._write("iteration", point)

    def add(self, kind: str, point: dict[str, Any]) -> None:
        """Any other point; every one is written."""
        self._write(kind, point)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, kind: str, point: dict[str, Any]) -> None:
        plain = {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in point.items()}
        line = json.dumps({"kind": kind, **plain}, allow_nan=False) + "\n"
        try:
            self._file.write(line.encode())
            self._file.flush()
        except OSError as error:
            raise RunError(f"{self.path} cannot be written: {error.strerror or error}.") from error


def read_history(path: Path, *, offset: int = 0, max_bytes: int = 1 << 20) -> tuple[list[dict[str, Any]], int]:
    """The points after a byte offset, and the offset to go on from.

    A line that is still being written is left for the next call; one that is damaged is passed over. Where the file is
    shorter than the offset, it was written anew, and is read from its start.

    Args:
        path: The file; a missing one has no points.
        offset: As the call before gave it.
        max_bytes: How much to read at most.
    """
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            offset = offset if 0 <= offset <= size else 0
            file.seek(offset)
            data = file.read(max_bytes)
    except OSError:
        return [], 0
    end = data.rfind(b"\n") + 1
    if end == 0 and len(data) > MAX_LINE:
        end = len(data)  # no line of ours is so long
    points = map(parse_json_line, data[:end].splitlines())
    return [point for point in points if point is not None], offset + end


def _offset_after(path: Path, step: int) -> int:
    """Where the points up to a step end."""
    offset = 0
    with path.open("rb") as file:
        for line in file:
            point = parse_json_line(line) if line.endswith(b"\n") else None
            behind = None if point is None else point.get("step")
            if not isinstance(behind, int) or behind > step:
                break
            offset += len(line)
    return offset
