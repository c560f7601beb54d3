"""`racecraft tune`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run

from racecraft.cli.tune_text import say_tuned
from racecraft.tuning import Outcome, Parameter, TrialOutcome

SMALL = ("-t", "oval", "--search", "learning_rate", "--trial-steps", "64", "--num-threads", "1")
ONE = ("--trials", "1", "--processes", "1", "-m", "1")


@pytest.mark.costly
def test_notes_on_the_files_are_in_the_json_or_on_stderr(racecraft: Run) -> None:
    pytest.importorskip("optuna")
    Path("h.json").write_text(json.dumps({"num_epoch": 3, "batch_size": 32}))
    note = "h.json: unknown field 'num_epoch' has no effect. Did you mean 'num_epochs'?"
    told = racecraft("tune", *SMALL, *ONE, "--hyperparameters", "h.json", "--name", "a", "--json")
    assert (told.status, told.err) == (0, "")
    assert told.document["notes"] == [note]
    said = racecraft("tune", *SMALL, *ONE, "--hyperparameters", "h.json", "--name", "b")
    assert note in " ".join(said.err.split())
    assert "no effect" not in said.out
    again = racecraft("tune", "--resume", "tuning/a", *ONE, "--json")
    assert again.document["notes"] == []


def say_one_trial(params: dict[str, float], value: float, folder: Path) -> None:
    """The table of a search that tried these numbers alone."""
    space = tuple(
        Parameter(name=name, kind="constant", low=0.0, high=1.0, is_log=False, is_whole=False, default=default)
        for name, default in params.items()
    )
    trial = TrialOutcome(
        number=0, state="complete", value=value, params=params, run="r", completion=1.0,
        best_lap_seconds=None, steps=64, seconds=1.0, error="",
    )  # fmt: skip
    say_tuned(Outcome(folder=folder, goal="laps", space=space, trials=(trial,), importances={}, is_interrupted=False))


def test_no_number_of_the_table_is_folded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ("OFF_TRACK_PENALTY", "BORDER_LOSS", "learning_rate", "gamma", "ent_coef")
    params = dict(zip(names, (-0.00057961, 0.1714, 0.00020281, 0.99969, 123456.0), strict=True))
    say_one_trial(params, 1.0, tmp_path)
    told = capsys.readouterr().out
    assert "\n1 trial: 1 complete.\n" in told
    row = next(line for line in told.splitlines() if "(now)" in line)
    assert row.split()[-5:] == ["-0.00058", "0.1714", "0.000203", "0.9997", "1.23e+05"]


def test_every_number_is_in_the_table_on_a_narrow_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    params = {f"CONSTANT_NUMBER_{place}": 0.125 + place for place in range(11)}  # as many as are searched of themselves
    say_one_trial(params, 64.0, tmp_path)
    row = next(line for line in capsys.readouterr().out.splitlines() if "64 steps" in line)
    assert row.split()[-11:] == [f"{value:.4g}" for value in params.values()]


@pytest.mark.parametrize("limit", [("--minutes", "nan"), ("--trials", "-1"), ("--processes", "5000")])
def test_a_limit_that_is_not_allowed_leaves_no_search(racecraft: Run, limit: tuple[str, str]) -> None:
    pytest.importorskip("optuna")
    told = racecraft("tune", *SMALL, *limit)
    assert told.status == 1
    assert f"{limit[0][2:]} is {limit[1]}; allowed is" in told.err
    assert not Path("tuning").exists()
