"""Somebody else's reward function is marked in its run, keeps the mark wherever it goes, and runs in walls only."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import models
import numpy as np
import pytest

from racecraft import resume, train
from racecraft.errors import RewardError, RunError, SourceError, TrackNotFound
from racecraft.importing import import_run
from racecraft.importing.own import read_own
from racecraft.importing.source import open_source
from racecraft.learn import PPOConfig
from racecraft.reward.sandbox import Confinement, find_confinement
from racecraft.run import RunFolder
from racecraft.run.archive import archive_chunks
from racecraft.track import load_track
from racecraft.training.plan import make_plan
from racecraft.tuning import Tuning, make_tuning, plan_of

TINY = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)

complete = pytest.mark.skipif(not find_confinement().is_complete, reason=f"no {find_confinement().missing} here")


def is_foreign(run: Path) -> bool:
    return RunFolder.open(run).read_info().foreign


@pytest.fixture
def imported(tmp_path: Path) -> Path:
    """A run whose reward function would leave a trace outside of its walls."""
    marker = tmp_path / "marker"
    files = {
        **models.MODEL,
        "reward_function.py": f"import re\nMARKER = {str(marker)!r}\n"
        "try: re.enum.sys.modules['os'].mkdir(MARKER)\nexcept OSError: pass\n" + models.REWARD,
    }
    return import_run(models.as_tar(files, tmp_path / "model.tar.gz"), name="imported").run


@pytest.fixture
def _no_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel without Landlock."""
    for place in ("reward.worker", "importing.importer"):
        monkeypatch.setattr(f"racecraft.{place}.find_confinement", lambda: Confinement(syscalls="x86_64"))


def test_an_imported_run_is_marked_unless_the_reward_is_ones_own(tmp_path: Path, imported: Path) -> None:
    assert is_foreign(imported)
    assert json.loads((imported / "run.json").read_text())["foreign"] is True
    archive = models.as_tar(models.MODEL, tmp_path / "again.tar.gz")
    assert not is_foreign(import_run(archive, reward="racing", name="ours").run)
    assert is_foreign(import_run(models.as_folder(models.DRFC, tmp_path / "drfc"), name="drfc").run)
    (tmp_path / "mine.py").write_text(models.REWARD)
    assert is_foreign(import_run(tmp_path / "mine.py", name="file").run)


def test_an_archive_of_racecrafts_own_is_foreign_too(tmp_path: Path) -> None:
    settings = {"ppo": TINY, "evaluate_every": 64, "evaluation_trials": 1, "num_threads": 1}
    mine = train("oval", until="64 steps", root=tmp_path, name="mine", **settings).run
    assert not is_foreign(mine)
    archive = tmp_path / "mine.tar.gz"
    archive.write_bytes(b"".join(archive_chunks(RunFolder.open(mine))))
    assert is_foreign(import_run(archive, root=tmp_path / "theirs", name="mine").run)


@pytest.mark.costly
def test_a_run_on_a_drawn_road_goes_on_where_that_road_comes_with_it(tmp_path: Path) -> None:
    oval = load_track("oval")
    road = tmp_path / "mine.npy"
    np.save(road, np.concatenate((oval.centerline * 1.1, oval.inner * 1.1, oval.outer * 1.1), axis=1))
    fast = replace(TINY, learning_rate=0.0015)  # more than AWS's file may say
    settings = {"ppo": fast, "evaluate_every": 64, "evaluation_trials": 1, "num_threads": 1}
    mine = train(str(road), until="64 steps", root=tmp_path, name="mine", **settings).run
    archive = tmp_path / "mine.tar.gz"
    archive.write_bytes(b"".join(archive_chunks(RunFolder.open(mine))))
    with pytest.raises(TrackNotFound, match="not among Racecraft's tracks"):
        import_run(archive, root=tmp_path / "theirs", name="alone")
    with_road = import_run(archive, root=tmp_path / "theirs", name="with-road", track=str(road)).run
    assert RunFolder.open(with_road).checkpoints.load("last").step == RunFolder.open(mine).checkpoints.load("last").step
    with open_source(archive) as source:
        assert read_own(source, "mine/", track="oval") is None
    anew = import_run(archive, root=tmp_path / "theirs", name="elsewhere", track="oval")
    began = RunFolder.open(anew.run)
    assert (began.read_info().track, began.checkpoints.last) == ("oval", None)
    assert began.read_hyperparameters() is None  # what was left for AWS's tools is not what it learned with
    assert any("Racecraft's own settings" in note for note in anew.notes)
    assert any("What the run has learned was left out" in note for note in anew.notes)
    for checkpoint, step in (("last", 64), ("none", None)):
        chosen = import_run(archive, root=tmp_path / "theirs", name=checkpoint, track=str(road), checkpoint=checkpoint)
        last = RunFolder.open(chosen.run).checkpoints.last
        assert (last and last.step) == step
    with pytest.raises(SourceError, match=r"--checkpoint is '64', and allowed are best, last and none"):
        import_run(archive, root=tmp_path / "theirs", name="one", track=str(road), checkpoint="64")


@pytest.mark.costly
@pytest.mark.usefixtures("_no_walls")
def test_without_walls_it_is_refused_before_a_line_of_it_runs(tmp_path: Path, imported: Path) -> None:
    with pytest.raises(RewardError, match="somebody else") as caught:
        resume(imported, until="1 steps")
    assert "lack of Landlock" in str(caught.value)
    assert "racecraft train --reward" in caught.value.hint
    assert not (tmp_path / "marker").exists()
    report = import_run(models.as_tar(models.MODEL, tmp_path / "other.tar.gz"), name="other")
    assert any("cannot lock in somebody else's reward function (no Landlock)" in note for note in report.notes)


@pytest.mark.costly
@complete
def test_within_walls_it_trains_and_leaves_no_trace(tmp_path: Path, imported: Path) -> None:
    assert resume(imported, until="1 steps").steps > 0
    assert not (tmp_path / "marker").exists()


@pytest.mark.costly
@pytest.mark.usefixtures("_no_walls")
def test_the_mark_goes_with_the_reward_and_not_with_the_weights(imported: Path, tmp_path: Path) -> None:
    folder = RunFolder.open(imported)
    plan = plan_of(folder)
    assert plan.foreign
    with pytest.raises(RewardError, match="somebody else"):
        plan.start(root=tmp_path)
    search = make_tuning(plan, search=["learning_rate"], root=tmp_path, name="search")
    with pytest.raises(RewardError, match="somebody else"):
        Tuning(search).run(minutes=1, max_trials=1)


@pytest.mark.costly
@complete
def test_a_run_that_begins_from_it_has_the_mark_where_it_has_the_reward(imported: Path, tmp_path: Path) -> None:
    resume(imported, until="1 steps")
    assert make_plan(parent=imported).foreign
    assert is_foreign(make_plan(parent=imported).start(root=tmp_path, name="child").path)
    assert not is_foreign(make_plan(parent=imported, reward="racing").start(root=tmp_path, name="own").path)
    assert not is_foreign(make_plan(parent=imported, reward=imported / "reward_function.py").start(root=tmp_path).path)


def test_a_mark_that_is_none_is_a_damaged_run(imported: Path) -> None:
    path = imported / "run.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "foreign": "no"}))
    with pytest.raises(RunError, match="foreign"):
        RunFolder.open(imported).read_info()
    document = json.loads(path.read_text())
    del document["foreign"]  # a run of an older version is the user's own
    path.write_text(json.dumps(document))
    assert not is_foreign(imported)
