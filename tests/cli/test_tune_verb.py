"""`racecraft tune`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run

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
