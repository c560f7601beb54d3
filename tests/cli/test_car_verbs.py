"""`racecraft export`: what it prints, and its wrong options."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run


def test_export(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("export", str(trained), "--to", "car", "--output", "floor.tar.gz")
    assert outcome.status == 0, outcome.err
    assert "note: Only relative speed counts on a car: 1 m/s, 50 %" in outcome.out
    assert "For the car: floor.tar.gz  RACECRAFT_SMALL, step" in outcome.out
    assert Path("floor.tar.gz").read_bytes().startswith(b"\x1f\x8b")


def test_export_as_json(racecraft: Run, trained: Path) -> None:
    document = racecraft("export", str(trained), "-o", "floor.tar.gz", "--json").document
    assert document["archive"] == "floor.tar.gz"
    assert document["size"] == Path("floor.tar.gz").stat().st_size
    assert document["run"] == str(trained)
    assert len(document["notes"]) == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--to", "cra"], "Did you mean 'car'?"),
        (["--checkpoint", "77"], "77"),
        (["-o", "floor.zip"], "end in .tar.gz"),
        (["-o", "the.floor.tar.gz"], "cuts names"),
    ],
)
def test_a_wrong_option_writes_nothing(racecraft: Run, trained: Path, arguments: list[str], says: str) -> None:
    before = set(trained.rglob("*"))
    outcome = racecraft("export", str(trained), *arguments)
    assert outcome.status == 1, outcome.err
    assert says in outcome.err
    assert set(trained.rglob("*")) == before
    assert not list(Path().iterdir())
