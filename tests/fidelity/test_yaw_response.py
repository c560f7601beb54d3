"""How soon the original's cars turn when they steer, from its own logs: what tells version 4 from version 5."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

SHARED = Path(__file__).parents[3] / "shared"
OLDER = SHARED / "traces" / "console_2022.csv.gz"
NEWER = [SHARED / "traces" / f"console_{number:02d}.csv.gz" for number in range(1, 10)]
COLUMNS = ("episode", "steer", "X", "Y", "yaw", "tstamp")
ROWS = 12  # of 1/15 s, in which a command shows
AHEAD = 0.14  # m that x and y lie before the car's origin
SLOW, FAST = (0.8, 1.3), (1.8, 2.3)  # m/s

pytestmark = pytest.mark.skipif(not OLDER.is_file(), reason="the logs of AWS's console are not beside this repository")


def response(files: Sequence[Path], speeds: tuple[float, float]) -> float:
    """Seconds until the yaw rate is 63 % of what a step of the steering ends in.

    The yaw rate is taken for a sum of the last commands, each times the speed and a weight; least squares finds the
    weights, and their sums are the response to a step.
    """
    seen, turned = [], []
    for file in files:
        with gzip.open(file, "rt") as lines:
            rows = [[float(row[key]) for key in COLUMNS] for row in csv.DictReader(lines)]
        episode, steer, x, y, yaw, time = np.array(rows).T
        steer, yaw = np.radians(steer), np.radians(yaw)
        took = np.diff(time)
        regular = (took > 0.03) & (took < 0.12)
        took = np.where(regular, took, 1.0)
        speed = np.hypot(np.diff(x - AHEAD * np.cos(yaw)), np.diff(y - AHEAD * np.sin(yaw))) / took
        rate = ((np.diff(yaw) + np.pi) % (2 * np.pi) - np.pi) / took
        at = np.arange(ROWS, len(rate))
        at = at[
            (episode[at - ROWS] == episode[at + 1]) & regular[at] & (speeds[0] < speed[at]) & (speed[at] < speeds[1])
        ]
        before = steer[at[:, None] - np.arange(ROWS)] * speed[at, None]
        seen.append(np.column_stack([before, np.ones(len(at))]))
        turned.append(rate[at])
    weights = np.linalg.lstsq(np.concatenate(seen), np.concatenate(turned), rcond=None)[0]
    step = np.cumsum(weights[:ROWS])
    step /= step[-1]
    first = int(np.argmax(step >= 0.63))
    before_it = step[first - 1] if first else 0.0
    return float((first + (0.63 - before_it) / (step[first] - before_it)) / 15)


@pytest.mark.costly
@pytest.mark.parametrize("speeds", [SLOW, FAST])
def test_version_4_turns_twice_as_late_as_version_5(speeds: tuple[float, float]) -> None:
    older, newer = response([OLDER], speeds), response(NEWER, speeds)
    assert 0.36 < older < 0.43
    assert 0.10 < newer < 0.20
