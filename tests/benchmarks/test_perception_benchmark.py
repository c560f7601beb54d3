"""The benchmark of perception in miniature: how well it sees, and that it drives."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "perception.py"


def run(script: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(script), *arguments], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.costly
def test_it_tells_how_well_roads_are_seen_and_driven() -> None:
    small = ["--looks", "4", "--routes", "oval", "--randomize", "none", "--speeds", "1.5", "--starters"]
    done = run(SCRIPT, *small)
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    (seen, watched), (driven, alone) = last["sight"], last["driving"]
    assert [(row["driven"], row["pictures"]) for row in (seen, watched)] == [("badly", 30), ("by sight, 1.5 m/s", 30)]
    assert 0.7 < seen["middle_in_sight"] <= 1.0
    for name, most in {"offset_cm": 2.0, "heading_deg": 4.0, "heading_ahead_deg": 4.0, "middle_px": 3.0}.items():
        assert 0.0 < seen[name]["median"] < min(most, seen[name]["90 %"]), name
    assert seen["offset_cm"]["in sight"]["90 %"] <= seen["offset_cm"]["90 %"]
    for name in ("offset_cm", "heading_deg", "heading_ahead_deg"):
        for row, after in itertools.product((seen, watched), ("remembering", "told commands")):
            late = row[f"{after} {name}"]["from the 8th on"]
            assert 0.0 < late["median"] < late["90 %"], (name, after, row["driven"])
    for after in ("remembering", "told commands"):
        assert seen[f"{after} heading_deg"]["from the 8th on"]["90 %"] < 0.8 * seen["heading_deg"]["90 %"]
    assert seen["told commands heading_deg"] != seen["remembering heading_deg"]
    for row, name in ((driven, "perception, 1.5 m/s"), (alone, "perception alone, 1.5 m/s")):
        assert (row["driver"], row["laps"], row["trials"]) == (name, 2, 2)


@pytest.mark.costly
def test_what_the_best_of_eyes_could_tell_is_learned_and_told() -> None:
    pytest.importorskip("torch")
    small = ["--looks", "2", "--steps", "60", "--randomize", "none", "--known", "oval", "--routes", "hairpin"]
    script = SCRIPT.with_name("perception_limit.py")
    done = run(script, *small)
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout.splitlines()[-1])
    assert 15.0 < found["first_sight_cm"] < 20.0
    assert found["middle_in_sight"] > 0.8
    for name in ("offset", "heading", "heading_ahead"):
        assert 0.0 < found[name]["median"] < found[name]["90 %"] < 10.0, name
