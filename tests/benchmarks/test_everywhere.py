"""The benchmark of unseen roads in miniature, and what it rests on: a car drives where it never was."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from racecraft import generalize, train
from racecraft.training.regimes import MANY_TRACKS

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "everywhere.py"
TRACKS = ["library", "generated:0..7,radius=0.5"]
UNSEEN = "generated:500..507,radius=0.6"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.costly
def test_the_script_writes_its_table(tmp_path: Path) -> None:
    table = tmp_path / "table.json"
    small = ("--recipe", "steady", "--tracks", "oval", "--tracks", "kidney", "--until", "1024 steps")
    done = run(
        *small, "--num-threads", "1", "--no-minimum", "--routes", "generated:900", "--seeds", "0,1", "-o", str(table)
    )
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    written = json.loads(table.read_text())
    assert [run["seed"] for run in written["runs"]] == [0, 1]
    assert [run["strong"]["lap_share"] for run in written["runs"]] == last["lap_share_strong"]
    assert [run["as_it_is"]["lap_share"] for run in written["runs"]] == last["lap_share"]
    assert last["over_minimum"] == [None, None]
    assert [row["direction"] for row in written["runs"][0]["as_it_is"]["results"]] == ["forward", "reverse"]


def test_the_script_refuses_to_judge_on_what_it_trains_on() -> None:
    done = run("--tracks", "oval", "--routes", "library", "--until", "1024 steps")
    assert done.returncode == 2
    assert "one of those to train on" in done.stderr


@pytest.mark.slow
def test_a_policy_drives_tracks_it_never_saw(tmp_path: Path) -> None:
    recipe = {
        "reward": "centerline",
        "direction": "alternate",
        "randomize": "light",
        "actions": "safe",
        "root": tmp_path,
    }
    learned = train(TRACKS, **recipe, until="24000 steps", evaluate_every=24_000, seed=3)
    ignorant = train(TRACKS, **recipe, until="512 steps", ppo=replace(MANY_TRACKS.ppo, learning_rate=0.0))
    found = {
        (name, conditions): generalize(run, tracks=UNSEEN, randomize=conditions, checkpoint="last").generalization
        for name, run in (("learned", learned.run), ("ignorant", ignorant.run))
        for conditions in ("none", "light")
    }
    assert found["ignorant", "none"].laps == found["ignorant", "light"].laps == 0
    assert found["learned", "none"].lap_share >= 0.4
    assert found["learned", "light"].lap_share >= 0.2
