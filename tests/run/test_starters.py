"""Starters: runs that ship with the package, put where runs lie, and drive where they have never been."""

from __future__ import annotations

import runpy
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft import evaluate, generalize, load_tracks
from racecraft.errors import RunError
from racecraft.learn.learner import below
from racecraft.race.policy import load_driver, load_policy
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.run.checkpoint import header_of
from racecraft.run.starters import FOLDER, starter_names, unpack_starter
from racecraft.sim import Objects
from racecraft.training.parent import open_parent
from racecraft.training.plan import make_plan
from racecraft.training.recipes import TRAFFIC
from racecraft.training.stop import Until
from racecraft.training.taught import TEACHERS, taught

UNSEEN = "generated:500..503,radius=0.6"
MOST_BYTES = 2 << 20
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


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


@pytest.mark.costly
@pytest.mark.parametrize("name", ["steady", "quick"])
def test_a_starter_gets_nowhere_without_what_it_sees(name: str, here: Path) -> None:
    controls = runpy.run_path(str(BENCHMARKS / "controls.py"))
    policy, options = load_driver(f"starter:{name}"), Namespace(num_threads=1)
    found = {
        told: controls["alone"](driver, policy, load_tracks("generated:500,radius=0.6"), options)
        for told, driver in controls["drivers"](policy)
        if told != "as it is"
    }
    assert found.keys() == {"blind", "shuffled"}
    assert max(row["completion"] for row in found.values()) < 0.5, found


@pytest.mark.parametrize("name", starter_names())
def test_its_weights_lie_there_as_they_are_told_and_are_read_as_float32(name: str, here: Path) -> None:
    run = RunFolder.open(f"starter:{name}")
    saved = run.checkpoints.find()
    stored = {kind for kind, _ in header_of(saved.path)[1].values()}
    assert (stored, {kind for kind, _ in saved.kinds.values()}) == ({"F32" if name == "dodger" else "F16"}, {"F32"})
    read, driving = open_parent(f"starter:{name}").weights, load_policy(run, num_threads=1)[1].learner.weights()
    assert {array.dtype for array in read.values()} == {np.dtype(np.float32)}
    for weight in (weight for weight in driving if weight.startswith("policy.")):
        assert driving[weight].tobytes() == read[weight].tobytes(), weight


def test_what_begins_from_one_is_whole(here: Path) -> None:
    plan = make_plan("oval", parent="starter:steady", until="64 steps", num_threads=1)
    child = plan.start(root=here / "children", name="child").parent_checkpoint
    read = open_parent("starter:steady").weights
    assert {kind for kind, _ in header_of(child.find().path)[1].values()} == {"F32"}
    assert {name: array.tobytes() for name, array in below("weights/", child.load().arrays).items()} == {
        name: array.tobytes() for name, array in read.items()
    }


@pytest.mark.parametrize(
    ("track", "critic"), [("hairpin", "privileged"), (None, "privileged"), ("grand_circuit", "lap")]
)
def test_who_goes_on_with_the_quick_one_is_to_be_fast_on_that_road(track: str | None, critic: str, here: Path) -> None:
    """By the road's own defaults, paid by the metre, and taught by what comes with it."""
    plan = make_plan(track, parent="starter:quick")
    anew = make_plan(track, algorithm="distill", actions="continuous", reward="lap_time")
    assert plan.settings == replace(anew.settings, distill=taught(anew.settings.distill))
    assert (plan.settings.critic, plan.settings.until) == (critic, Until.parse("no better lap or 10 minutes"))
    assert plan.reward == load_preset("lap_time")
    brought = below(TEACHERS, plan.start(root=here / "children").parent_checkpoint.load().arrays)
    assert brought["weights/policy.head.weight"].shape == (2, 64)
    assert all(array.any() for array in brought.values())


@pytest.mark.parametrize("value", [np.nan, -np.inf, 65_520.0])
def test_what_no_half_can_say_is_not_written(value: float) -> None:
    halves = runpy.run_path(str(BENCHMARKS / "starters.py"))["halves"]
    assert halves("policy", np.float32([65_519.0, 1 / 3])).tolist() == [65_504.0, 0.333251953125]
    with pytest.raises(ValueError, match=r"policy has weights that are no finite numbers of 16 bits"):
        halves("policy", np.float32([0.0, value]))


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
