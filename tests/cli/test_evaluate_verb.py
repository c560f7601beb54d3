"""`racecraft evaluate`: its table, its files and its wrong options."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run

from racecraft.run import read_metrics, read_simtrace


@pytest.mark.costly
def test_evaluate(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("evaluate", str(trained), "--laps", "1", "--trials", "2", "--no-video", "--max-resets", "2")
    assert outcome.status == 0
    assert "laps clean" in outcome.out
    for what in ("metrics", "sim-trace", "racing line"):
        assert what in outcome.out
    (driven,) = (line for line in outcome.out.splitlines() if line.startswith("Driven "))
    assert "max_resets 2 instead of 100, otherwise drfc) with the standard car v5 on oval" in driven
    table = [line for line in outcome.out.splitlines() if str(trained) not in line and line != driven]
    assert all(len(line) <= 80 for line in table)


@pytest.mark.costly
def test_evaluate_as_json_names_files_that_can_be_read(racecraft: Run, trained: Path) -> None:
    arguments = ["--track", "oval", "--laps", "1", "--trials", "2", "--max-resets", "1", "--json"]
    document = racecraft("evaluate", str(trained), *arguments).document
    assert document["run"] == str(trained)
    assert document["trials"] == 2
    assert {"laps_completed", "best_lap_seconds", "mean_completion", "completion_interval", "off_track_count"} <= (
        document.keys()
    )
    assert document["official_races"] == []  # our own tracks have none
    assert document["limit"]["ideal_seconds"] < document["limit"]["medals"]["author"]
    files = {name: Path(path) for name, path in document["files"].items()}
    assert len(read_metrics(files["metrics"])["metrics"]) >= 2
    assert len(read_simtrace(files["sim-trace"])["steps"]) > 2
    assert files["racing line"].read_bytes().startswith(b"\x89PNG")
    assert files["video"].read_bytes()[4:8] == b"ftyp"
    assert document["files"]["video"].endswith("mp4/camera-pip/0-video.mp4")
    json.loads(files["summary"].read_text())


@pytest.mark.parametrize(
    ("option", "says"),
    [
        (["--rules", "dfrc"], "Did you mean 'drfc'?"),
        (["--checkpoint", "bets"], "best"),
        (["--checkpoint", "77"], "77"),
        (["--checkpoint", "²"], "allowed is 'last', 'best' or a step"),
        (["--checkpoint", "²", "--tracks", "oval"], "allowed is 'last', 'best' or a step"),
        (["--checkpoint", "9" * 5000], "allowed is 'last', 'best' or a step"),
        (["--laps", "0"], "laps"),
        (["--trials", "0"], "num_trials"),
        (["--direction", "up"], "direction"),
        (["--track", "ovla"], "Did you mean 'oval'?"),
        (["--offtrack-penalty", "-1"], "offtrack_penalty"),
        (["--seed", "-1"], "seed"),
    ],
)
def test_a_wrong_option_of_evaluate_writes_nothing(racecraft: Run, trained: Path, option: list[str], says: str) -> None:
    before = set(trained.rglob("*"))
    outcome = racecraft("evaluate", str(trained), *option)
    assert outcome.status == 1, outcome.err
    assert says in outcome.err
    assert set(trained.rglob("*")) == before


@pytest.mark.parametrize(
    ("at", "options", "status", "says"),
    [
        ("@best", ["--laps", "0"], 1, "laps is 0"),
        ("@last", ["--tracks", "ovla"], 1, "Did you mean 'oval'?"),
        ("@77", [], 1, "has no checkpoint of step 77"),
        ("@bets", [], 1, "Checkpoint 'bets' of"),
        ("@last", ["--checkpoint", "last"], 2, "and so does --checkpoint last; give one of them."),
    ],
)
def test_a_checkpoint_may_be_named_as_for_races(
    racecraft: Run, trained: Path, at: str, options: list[str], status: int, says: str
) -> None:
    outcome = racecraft("evaluate", f"{trained}{at}", *options, "--json")
    assert outcome.status == status
    assert says in outcome.document["error"]["message"] + outcome.document["error"]["hint"]


@pytest.mark.costly
def test_many_tracks_have_no_film_which_may_be_said(racecraft: Run, trained: Path) -> None:
    arguments = ("evaluate", str(trained), "--tracks", "oval", "--trials", "1")
    assert racecraft(*arguments, "--no-video").status == 0
    refused = racecraft(*arguments, "--video")
    assert refused.status == 2
    assert "--video does not go with --tracks" in refused.err
