"""The benchmark of the fastest lap in miniature."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "fastest_lap.py"


@pytest.mark.slow
def test_the_script_tells_of_every_track_and_seed_how_near_the_limit_it_is(tmp_path: Path) -> None:
    table = tmp_path / "table.json"
    small = ("--tracks", "oval", "--until", "1 laps or 40000 steps", "--seeds", "3", "--num-threads", "1")
    command = [sys.executable, str(SCRIPT), *small, "-o", str(table)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    (row,) = json.loads(table.read_text())
    assert (row["track"], row["seed"]) == ("oval", 3)
    assert row["ideal_seconds"] < row["driven_seconds"]
    assert last["above_limit"] == {"oval": row["above_limit"]}
    best = row["best_clean_lap_seconds"]
    assert (best is None) == (row["laps_clean"] == 0)
    assert row["wall_seconds"] > 0
    assert row["cpu_seconds"] > 0
