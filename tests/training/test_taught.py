"""A teacher that has taught before: whose child begins with it, with how much of it, and what is refused."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder, Train, weights

from racecraft.errors import CheckpointError
from racecraft.learn import DistillConfig
from racecraft.learn.learner import below
from racecraft.learn.native_state_learner import NativeStateLearner
from racecraft.run import RunFolder
from racecraft.sim import Objects
from racecraft.sim.objects import Obstacles
from racecraft.training import resume, train
from racecraft.training.opponents import Opponents
from racecraft.training.parent import open_parent
from racecraft.training.plan import make_plan
from racecraft.training.regimes import FAST_DISTILL, FAST_STEPS
from racecraft.training.taught import RATE, TEACHERS, taught

SHORT = DistillConfig(num_envs=8, num_steps=8, teacher_steps=8192, student_steps=64, minibatch_size=32)
LESSONS: dict[str, Any] = {"algorithm": "distill", "distill": SHORT}


@pytest.fixture(scope="module")
def parent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """It has had its lessons, and goes on with PPO."""
    settings: dict[str, Any] = {"until": "128 steps", "evaluate_every": 64, "evaluation_trials": 2, "num_threads": 1}
    root = tmp_path_factory.mktemp("parents")
    return train("oval", actions="continuous", reward="centerline", root=root, **settings, **LESSONS).run


def brought(run: RunFolder) -> dict[str, Any]:
    return below(TEACHERS, run.parent_checkpoint.load().arrays)


def test_on_another_road_a_taught_models_child_is_taught_by_who_knows_something(parent: Path, tmp_path: Path) -> None:
    plan = make_plan("hairpin", parent=parent, until="10 minutes")
    assert plan.settings.algorithm == "distill"
    assert plan.settings.distill == taught(FAST_DISTILL.distill or SHORT)
    assert (plan.settings.distill.teacher_steps, plan.settings.distill.teacher_rate) == (1_000_000, RATE)
    theirs = below(f"{TEACHERS}average/", RunFolder.open(parent).checkpoints.load("best").arrays)
    assert theirs
    kept = brought(plan.start(root=tmp_path / "children"))
    assert kept.keys() == {*(f"weights/{name}" for name in theirs), "ppo/return_scale"}
    for name, array in theirs.items():
        np.testing.assert_array_equal(kept[f"weights/{name}"], array, err_msg=name)


def test_it_learns_on_from_what_that_knew(tiny: Train, parent: Path) -> None:
    """A rollout of Adam's steps moves no weight far; two teachers of random weights are far apart."""
    recorder = Recorder()
    short = {"distill": replace(taught(SHORT), teacher_steps=1), "algorithm": "distill"}
    child = tiny("hairpin", parent=parent, until="64 steps", evaluate_every=64, seed=6, reporter=recorder, **short).run
    assert any("It begins with what an earlier one knew." in note for note in recorder.notes)
    before, after = brought(RunFolder.open(child)), below(TEACHERS, weights(child))
    name = "weights/policy.dense2.weight"
    spec = make_plan(parent=parent).settings.network_spec(RunFolder.open(parent).read_model_metadata())
    fresh = NativeStateLearner(spec, seed=6).weights()[name.removeprefix("weights/")]
    moved = np.abs(after[name] - before[name]).max()
    assert 0 < moved < 0.1 < np.abs(fresh - before[name]).max()


@pytest.mark.costly
def test_killed_before_its_first_checkpoint_it_begins_with_the_same(tiny: Train, parent: Path, tmp_path: Path) -> None:
    short = {"distill": replace(taught(SHORT), teacher_steps=1), "algorithm": "distill"}
    settings: dict[str, Any] = {"parent": parent, "until": "64 steps", "evaluate_every": 64, "num_threads": 1, **short}
    whole = tiny("hairpin", name="whole", reward="centerline", ppo=None, evaluation_trials=2, **settings).run
    gone = tmp_path / "gone"
    shutil.copytree(parent, gone)
    killed = make_plan("hairpin", reward="centerline", evaluation_trials=2, **{**settings, "parent": gone}).start(
        root=tmp_path / "killed"
    )
    shutil.rmtree(gone)
    resume(killed.path)
    for name, array in below(TEACHERS, weights(whole)).items():
        np.testing.assert_array_equal(below(TEACHERS, weights(killed.path))[name], array, err_msg=name)


@pytest.mark.costly
def test_what_it_is_told_beyond_that_begins_with_no_weight(tiny: Train, parent: Path, tmp_path: Path) -> None:
    """On a long road a teacher knows where it is; one of a short road is of use there, too."""
    plan = make_plan("grand_circuit", parent=parent, until="2 minutes")
    assert plan.settings.critic == "lap"
    assert plan.settings.distill.teacher_rate == RATE
    assert (plan.settings.distill.teacher_steps, plan.settings.distill.student_steps) == (1_500_000, 150_000)
    known = brought(plan.start(root=tmp_path / "children"))["weights/policy.dense1.weight"]
    short = {"distill": replace(SHORT, teacher_steps=1, teacher_rate=1e-9), "algorithm": "distill", "critic": "lap"}
    child = tiny("grand_circuit", parent=parent, until="64 steps", evaluate_every=64, **short).run
    rows = below(TEACHERS, weights(child))["weights/policy.dense1.weight"]
    assert rows.shape[1] == known.shape[1] + plan.settings.lap_view.size
    np.testing.assert_allclose(rows[:, : known.shape[1]], known, atol=1e-5)
    assert np.abs(rows[:, known.shape[1] :]).max() < 1e-5


@pytest.mark.parametrize(
    "asked",
    [
        {"actions": "default", "algorithm": "distill"},
        {"algorithm": "ppo"},
        {"objects": Objects(obstacles=Obstacles(count=2))},
        {"opponents": Opponents()},
    ],
)
def test_who_is_to_be_something_else_begins_without(parent: Path, tmp_path: Path, asked: dict[str, Any]) -> None:
    plan = make_plan("hairpin", parent=parent, until="10 minutes", **asked)
    assert plan.settings.distill.teacher_rate == DistillConfig.teacher_rate
    assert brought(plan.start(root=tmp_path / "children")) == {}


def test_on_its_own_road_and_without_a_teacher_in_the_parent_nothing_is_taught_anew(
    tiny: Train, parent: Path, tmp_path: Path
) -> None:
    assert make_plan(parent=parent, until="10 minutes").settings.algorithm == "ppo"
    alone = tiny(name="alone", actions="continuous", until="64 steps", evaluate_every=64).run
    assert make_plan("hairpin", parent=alone, until="10 minutes").settings.algorithm == "ppo"
    plan = make_plan("hairpin", parent=alone, until="10 minutes", algorithm="distill")
    assert plan.settings.distill == FAST_DISTILL.distill
    assert brought(plan.start(root=tmp_path / "children")) == {}


def test_how_long_a_teacher_learns_hangs_on_the_time_there_is(parent: Path) -> None:
    anew = make_plan("hairpin", algorithm="distill", actions="continuous", until="20 seconds").settings.distill
    assert anew == replace(FAST_DISTILL.distill or SHORT, teacher_steps=20 * FAST_STEPS)
    knows = make_plan("hairpin", parent=parent, until="20 seconds or no better lap").settings.distill
    assert knows.teacher_steps == 10 * FAST_STEPS
    asked = make_plan("hairpin", parent=parent, until="20 seconds", **LESSONS).settings.distill
    assert asked == SHORT


def test_a_child_takes_as_many_threads_as_its_own_machine_has(parent: Path) -> None:
    assert make_plan(parent=parent).settings.num_threads == 0


@pytest.mark.parametrize("name", ["weights/policy.dense2.weight", "ppo/return_scale"])
def test_a_number_that_is_none_teaches_nobody(parent: Path, tmp_path: Path, name: str) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(parent, broken)
    store = RunFolder.open(broken).checkpoints
    saved = store.load("last")
    theirs = {f"{TEACHERS}{name}", f"{TEACHERS}{name.replace('weights/', 'average/')}"}
    for one in theirs:
        saved.arrays[one] = np.full_like(saved.arrays[one], np.nan)
    store.save(saved.step + 1, saved.arrays, metadata=saved.metadata)
    match = rf"has weights that are NaN or infinite: {TEACHERS}{name}\.$"
    with pytest.raises(CheckpointError, match=match):
        make_plan("hairpin", parent=f"{broken}@last", until="10 minutes")
    child = make_plan("hairpin", parent=parent, until="64 steps").start(root=tmp_path / "children")
    copied = child.parent_checkpoint.load()
    copied.arrays[f"{TEACHERS}{name}"] = np.full_like(copied.arrays[f"{TEACHERS}{name}"], np.inf)
    child.parent_checkpoint.save(copied.step, copied.arrays, metadata=copied.metadata)
    with pytest.raises(CheckpointError, match=match):
        resume(child.path)


def test_a_copy_of_another_teacher_is_refused(parent: Path, tmp_path: Path) -> None:
    child = make_plan("hairpin", parent=parent, until="64 steps").start(root=tmp_path / "children")
    copied = child.parent_checkpoint.load()
    del copied.arrays[f"{TEACHERS}ppo/return_scale"]
    child.parent_checkpoint.save(copied.step, copied.arrays, metadata=copied.metadata)
    with pytest.raises(CheckpointError, match="its teacher is of other actions or another state"):
        resume(child.path)


def test_an_archives_teacher_of_another_shape_is_left_where_it_is(parent: Path, tmp_path: Path) -> None:
    odd = tmp_path / "odd"
    shutil.copytree(parent, odd)
    store = RunFolder.open(odd).checkpoints
    saved = store.load("last")
    for part in ("weights", "average"):
        saved.arrays[f"{TEACHERS}{part}/policy.dense1.weight"] = np.zeros((64, 99), np.float32)
    store.save(saved.step + 1, saved.arrays, metadata=saved.metadata)
    plan = make_plan("hairpin", parent=f"{odd}@last", until="10 minutes")
    assert plan.settings.distill == FAST_DISTILL.distill
    assert brought(plan.start(root=tmp_path / "children")) == {}
    assert open_parent(f"{odd}@last").saved.step == saved.step + 1


@pytest.mark.costly
@pytest.mark.parametrize(("algorithm", "log_std"), [("distill", -1.0), ("ppo", -2.5)])
def test_who_has_lessons_begins_as_unsure_as_from_nothing(
    tiny: Train, parent: Path, tmp_path: Path, algorithm: str, log_std: float
) -> None:
    sure = tmp_path / "sure"
    shutil.copytree(parent, sure)
    store = RunFolder.open(sure).checkpoints
    saved = store.load("last")
    saved.arrays["weights/policy.log_std"] = np.float32([-2.5, -2.5])
    store.save(saved.step + 1, saved.arrays, metadata=saved.metadata)
    asked = {"algorithm": algorithm, "distill": replace(SHORT, teacher_steps=1)}
    child = tiny("hairpin", parent=f"{sure}@last", until="64 steps", evaluate_every=64, **asked).run
    np.testing.assert_allclose(weights(child)["weights/policy.log_std"], log_std, atol=0.1)
