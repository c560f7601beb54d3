"""`racecraft sweep`."""

from __future__ import annotations

from pathlib import Path

from command_line import Run

FILE = "seeds = [1]\n[all]\ntrack = 'oval'\nuntil = '256 steps'\nnum_envs = 8\n"


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
