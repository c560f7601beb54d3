"""Where a car was at every step, out of AWS's file of steps; such files are read as a stranger's."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from racecraft.race.recording import REFERENCE_AHEAD
from racecraft.run.simtrace import short_lines

MAX_ROWS: Final = 60_000


@dataclass(kw_only=True)
class Lap:
    """An episode of a file of steps."""

    trace: list[list[int]] = field(default_factory=list)
    """x, y, heading of the car's origin at every step, whole mm and mrad."""
    seconds: float = 0.0
    is_complete: bool = False


def read_laps(path: Path) -> list[Lap]:
    """The laps in a file of steps, in the order driven; as far as it can be read."""
    laps: list[Lap] = []
    episode, began = None, 0.0
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for number, row in enumerate(csv.DictReader(short_lines(file))):
                if number >= MAX_ROWS:
                    break
                now = float(row["tstamp"])
                if row["episode"] != episode:
                    episode, began = row["episode"], now
                    laps.append(Lap())
                laps[-1].trace.append(_pose(row))
                laps[-1].seconds = now - began
                laps[-1].is_complete |= row["episode_status"] == "lap_complete"
    except (OSError, KeyError, TypeError, ValueError, OverflowError, csv.Error):
        return [lap for lap in laps if lap.is_complete]
    return laps


def read_start(path: Path) -> list[int]:
    """Where the first lap in a file of steps began: x, y, heading in mm and mrad; empty where it cannot be read."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return _pose(next(csv.DictReader(short_lines(file))))
    except (OSError, StopIteration, KeyError, TypeError, ValueError, OverflowError, csv.Error):
        return []


def _pose(row: dict[str, str]) -> list[int]:
    """Of the car's origin."""
    heading = math.radians(float(row["yaw"]))
    x = float(row["X"]) - REFERENCE_AHEAD * math.cos(heading)
    y = float(row["Y"]) - REFERENCE_AHEAD * math.sin(heading)
    return [round(1000 * value) for value in (x, y, heading)]
