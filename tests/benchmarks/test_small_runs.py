"""Benchmarks that no other test runs, in miniature: they work, and end in the figures that they are for."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from racecraft import _native
from racecraft.run.checkpoint import header_of

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

pytestmark = [pytest.mark.slow, pytest.mark.costly]


def run(script: str, *arguments: str | Path, allowed: tuple[int, ...] = (0,)) -> str:
    """What a script printed; 1 means that a bar was missed, which a busy machine may do."""
    command = [sys.executable, BENCHMARKS / f"{script}.py", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode in allowed, done.stderr
    return done.stdout


def last_object(printed: str) -> Any:
    return json.loads(printed.splitlines()[-1])


def test_the_learners_instruction_sets_compute_the_same_bits() -> None:
    found = last_object(run("learner_instruction_sets", "--rounds", "1"))
    assert found["same_bits"] is True
    assert list(found["seconds_per_step"]) == list(_native.available_isas())
    assert min(found["seconds_per_step"].values()) > 0.0


def test_a_learners_step_is_held_against_what_the_machine_could() -> None:
    found = last_object(run("learner_layers", "--minibatch-size", "32"))
    parts = found["limit_seconds"]
    assert found["share_of_limit"] == pytest.approx(max(parts.values()) / found["step_cpu_seconds"], rel=1e-6)
    assert 0.0 < found["share_of_limit"] < 1.5


def test_copies_drive_alike_and_others_do_not(tmp_path: Path) -> None:
    small = ("--seeds", "2", "--tracks", "oval", "--steps", "512", "--runs", tmp_path, "--json")
    likeness = last_object(run("near_copies", *small))["likeness"]
    strangers, copies = likeness["trained for themselves"], likeness["weights with 3 % noise"]
    assert strangers["looked_at"] == 0
    assert copies["most"] > strangers["most"]


def test_a_starter_is_written_and_named_by_its_digest_twice_to_the_same_bits(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        small = ("--until", "512 steps", "--num-threads", "1", "-o", folder)
        made = last_object(run("starters", "steady", *small))["steady"]
    (weights,) = second.rglob(made["file"])
    assert hashlib.sha256(weights.read_bytes()).hexdigest() == made["sha256"]
    assert {kind for kind, _ in header_of(weights)[1].values()} == {"F16"}
    files = [path.relative_to(first) for path in first.rglob("*") if path.is_file()]
    assert len(files) >= 6
    assert all((first / path).read_bytes() == (second / path).read_bytes() for path in files)


def test_a_roads_limit_is_driven_nearly_as_fast_as_it_is_computed() -> None:
    printed = run("track_limits", "oval", "--direction", "forward", "--vehicle", "v5")
    (row,) = [line.split(",") for line in printed.splitlines() if line.count(",") == 5 and "oval" in line]
    ideal, driven = float(row[4]), float(row[5])
    assert ideal < driven < 1.1 * ideal


def test_a_board_of_ten_thousand_entries_is_timed() -> None:
    pytest.importorskip("fastapi")
    found = last_object(run("league", "--only", "board", "--json", allowed=(0, 1)))["board"]
    assert found["sqlite"]["value"] > 0.0
    assert found["is_met"] is (found["sqlite"]["is_met"] and found.get("postgresql", found["sqlite"])["is_met"])


def test_the_consoles_first_page_is_weighed() -> None:
    pytest.importorskip("fastapi")
    if not (BENCHMARKS.parent / "src/racecraft/serve/pages/index.html").exists():
        pytest.skip("the console's pages are not built: make pages")
    (figure,) = json.loads(run("console", "--only", "size", "--json"))
    assert figure["is_met"] is True
