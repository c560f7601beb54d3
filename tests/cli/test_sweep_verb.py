"""`racecraft sweep`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run

from racecraft.sweeping import Sweep

FILE = "seeds = [1]\n[all]\ntrack = 'oval'\nuntil = '256 steps'\nnum_envs = 8\n"
ACTIONS = [{"steering_angle": angle, "speed": 1.0} for angle in (-20, 0, 20)]


def test_a_sweep_is_trained_and_its_board_shown(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "sweep.toml").write_text(FILE)
    trained = racecraft("sweep", "sweep.toml", "--name", "s", "--processes", "1")
    assert trained.status == 0, trained.err
    assert "s-plain-1  " in trained.err
    assert "racecraft sweep --resume s" in trained.out
    shown = racecraft("sweep", "--resume", "s", "--board", "--json")
    assert [(row["setting"], row["seeds"]) for row in shown.document["places"]] == [("plain", 1)]
    again = racecraft("sweep", "sweep.toml", "--name", "s", "--json")
    assert again.status == 1
    assert "a sweep 's' already" in again.err
    assert racecraft("sweep").status == 2
    assert racecraft("sweep", "--resume", "s", "--name", "t").status == 2


@pytest.mark.costly
def test_notes_on_the_files_are_in_the_json_or_on_stderr(racecraft: Run) -> None:
    Path("all.json").write_text(json.dumps({"num_epoch": 3, "num_epochs": 3, "num_episodes_between_training": 1}))
    Path("one.json").write_text(
        json.dumps({"action_space": ACTIONS, "neural_network": "RACECRAFT_SMALL", "preview": 1})
    )
    settings = "hyperparameters = 'all.json'\n[settings.plain]\n[settings.seen]\nmodel_metadata = 'one.json'\n"
    Path("sweep.toml").write_text(FILE.replace("256 steps", "1 steps") + settings)
    notes = [
        "all.json: unknown field 'num_epoch' has no effect. Did you mean 'num_epochs'?",
        "Setting 'seen': one.json: unknown field 'preview' has no effect.",
    ]
    told = racecraft("sweep", "sweep.toml", "--name", "s", "--processes", "1", "--json")
    assert told.status == 0, told.err
    assert told.document["notes"] == notes
    assert Sweep("runs", "s").notes == tuple(notes)  # the console tells them, too
    said = racecraft("sweep", "sweep.toml", "--name", "t", "--processes", "1")
    assert [note in " ".join(said.err.split()) for note in notes] == [True, True]
    assert "has no effect" not in said.out
    assert racecraft("sweep", "--resume", "s", "--board", "--json").document["notes"] == []


def test_what_cannot_train_leaves_no_sweep(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("sweep.toml").write_text(FILE)
    assert racecraft("sweep", "sweep.toml", "--processes", "-1").status == 2
    shown = racecraft("sweep", "sweep.toml", "--board")
    assert shown.status == 2
    assert "--board shows a sweep that there is" in " ".join(shown.err.split())
    monkeypatch.setattr("racecraft.extras.importlib.util.find_spec", lambda _: None)
    told = racecraft("sweep", "sweep.toml", "--cluster", "auto")
    assert told.status == 1
    assert "--cluster needs ray, which is not installed." in told.err
    assert not Path("runs").exists()
