"""The benchmark among objects in miniature."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from racecraft.agent import action_space
from racecraft.run import RunFolder

SENSORS = "STEREO_CAMERAS+LIDAR"
SCRIPT = Path(__file__).parents[2] / "benchmarks" / "among_objects.py"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments, "--num-threads", "1"]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.costly
def test_the_script_writes_a_row_for_every_seed_and_route(tmp_path: Path) -> None:
    table = tmp_path / "table.json"
    small = ("--only", "oval", "--laps", "3", "--until", "64 steps", "--no-minimum", "--race", "head-to-bot")
    kept = ("--runs", str(tmp_path / "runs"), "-o", str(table))
    done = run("--routes", "library", *small, "--seeds", "1,2", "--actions", "fast", "--sensors", SENSORS, *kept)
    assert done.returncode == 0, done.stderr
    last, rows = json.loads(done.stdout.splitlines()[-1]), json.loads(table.read_text())
    assert [(row["seed"], row["route"], row["of"]) for row in rows] == [(1, "oval", 3), (2, "oval", 3)]
    assert last["clean_share"] == last["lap_share"] == last["worst_route"] == [row["clean"] / 3 for row in rows]
    assert last["over_minimum"] == [None, None]
    assert (last["actions"], last["sensors"]) == ("fast", SENSORS)
    for seed in (1, 2):
        kept_run = RunFolder(tmp_path / "runs" / f"head-to-bot-oval-{seed}")
        metadata = kept_run.read_model_metadata()
        assert (metadata.action_space, "+".join(metadata.sensors)) == (action_space("fast"), SENSORS)


@pytest.mark.costly
def test_one_policy_is_judged_on_the_routes_that_are_wide_enough() -> None:
    done = run("--routes", "generated:0..3", "--laps", "2", "--run", "starter:dodger", "--race", "object-avoidance")
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    assert last["routes"] == 2  # of four, two are 0.9 to 1.1 m wide
    assert last["clean_share"][0] >= 0.5
    assert last["over_minimum"][0] > 1.5


@pytest.mark.costly
def test_a_route_that_is_not_there_is_said() -> None:
    done = run("--routes", "library", "--only", "nowhere")
    assert done.returncode == 2
    assert "there is no such route" in done.stderr
