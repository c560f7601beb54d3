"""Starters: runs that ship with the package, put where runs lie, and drive where they have never been."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from racecraft import evaluate, generalize
from racecraft.errors import RunError
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER, starter_names, unpack_starter
from racecraft.sim import Objects
from racecraft.training.parent import open_parent
from racecraft.training.recipes import TRAFFIC

UNSEEN = "generated:500..503,radius=0.6"
MOST_BYTES = 2 << 20


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.costly
@pytest.mark.parametrize("name", starter_names())
def test_a_starter_is_a_small_run_that_drives_where_it_never_was(name: str, here: Path) -> None:
    shipped = files(FOLDER / name)
    assert sum(map(len, shipped.values())) <= MOST_BYTES
    found = generalize(f"starter:{name}", tracks=UNSEEN, num_threads=1)
    assert found.run == Path("runs") / f"starter-{name}"
    assert found.generalization.laps >= 7
    assert files(FOLDER / name) == shipped  # what is driven is written beside the run's copy
    assert open_parent(f"starter:{name}").weights.keys() >= {"policy.head.weight", "policy.head.bias"}


def test_all_are_there() -> None:
    assert starter_names() == ["dodger", "quick", "steady"]


@pytest.mark.costly
@pytest.mark.parametrize("objects", [TRAFFIC, None])
def test_the_dodger_gets_by(objects: Objects | None, here: Path) -> None:
    """On a road it never saw, without a scratch in most laps; by itself among the boxes that it says."""
    settings: dict[str, Any] = {"laps": 1, "max_resets": 0, "video": False, "num_threads": 1}
    found = evaluate(
        "starter:dodger", track="generated:700,width=1,radius=0.6", objects=objects, num_trials=10, **settings
    )
    assert found.evaluation.laps_clean >= 6


def test_it_is_unpacked_once_and_then_a_run_like_any_other(here: Path) -> None:
    first = RunFolder.open("starter:quick")
    assert files(first.path) == files(FOLDER / "quick")
    (first.path / "notes.txt").write_text("mine")
    assert unpack_starter("quick", "runs") == first.path
    assert (first.path / "notes.txt").read_text() == "mine"
    assert [path.name for path in Path("runs").iterdir()] == ["starter-quick"]  # and no half of one
    first.path.rename("runs/renamed")
    assert RunFolder.open("runs/renamed").read_info().track == "reinvent_2018"


@pytest.mark.parametrize(
    ("name", "hint"),
    [("quik", "Did you mean 'quick'"), ("", "starter:quick"), ("../quick", "starter:quick"), ("x" * 300, "starter:")],
)
def test_one_that_does_not_exist(name: str, hint: str, here: Path) -> None:
    with pytest.raises(RunError, match="There is no starter") as caught:
        RunFolder.open(f"starter:{name}")
    assert hint in caught.value.hint or "quick" in caught.value.hint
    assert not Path("runs").exists()


def test_a_folder_that_cannot_be_made(here: Path) -> None:
    Path("runs").write_text("a file")
    with pytest.raises(RunError, match="runs/starter-quick cannot be made"):
        RunFolder.open("starter:quick")
