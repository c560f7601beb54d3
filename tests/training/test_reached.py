"""Whether going on would train nothing is told from the files as the training itself finds it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tiny_runs import Recorder, Train

from racecraft.run import RunFolder, change_reward
from racecraft.training import Until
from racecraft.training.job import Training
from racecraft.training.reached import is_reached

OTHER = "def reward_function(params):\n    return params['speed']\n"


@pytest.fixture
def driven(tiny: Train) -> RunFolder:
    """512 steps, whose last evaluation is said to have been five laps of 9 s, and the best for long."""
    folder = RunFolder.open(tiny().run)
    saved = folder.checkpoints.load("last")
    judged = saved.metadata["evaluator"]
    judged["last"] |= {"completions": [1.0] * 5, "lap_times": [9.0] * 5}
    judged |= {"best_score": [1.0, -9.0], "best_lap": 9.0, "gained_at": -200_000}
    folder.checkpoints.save(saved.step, saved.arrays, metadata=saved.metadata, score=(1.0, -9.0))
    return folder


def trains(folder: RunFolder, until: Until) -> bool:
    recorder = Recorder(lambda _: training.stop())
    training = Training(folder, until=until, reporter=recorder)
    training.run()
    return bool(recorder.iterations)


@pytest.mark.costly
def test_files_tell_what_the_training_would(driven: RunFolder, tmp_path: Path) -> None:
    changed = RunFolder.open(shutil.copytree(driven.path, tmp_path / "changed"))
    change_reward(changed, OTHER)
    for text, before, after_a_change in (
        ("512 steps", True, True),
        ("513 steps", False, False),
        ("0.000001 s", True, True),
        ("5 laps", True, False),
        ("6 laps", False, False),
        ("9 s lap", True, False),
        ("8.9 s lap", False, False),
        ("no better lap", True, False),
        ("6 laps or 8 s lap or 1 hour", False, False),
        ("6 laps or 8 s lap or 100 steps", True, True),
    ):
        until = Until.parse(text)
        assert is_reached(driven, until, is_changed=False) is before, text
        assert is_reached(driven, until, is_changed=True) is after_a_change, text
        assert is_reached(changed, until, is_changed=False) is after_a_change, text
        for folder, ends in ((driven, before), (changed, after_a_change))[: 1 + (before is not after_a_change)]:
            shutil.rmtree(copy := tmp_path / "copy", ignore_errors=True)
            assert trains(RunFolder.open(shutil.copytree(folder.path, copy)), until) is not ends, text


def test_what_cannot_be_read_is_left_to_the_training(driven: RunFolder, tmp_path: Path) -> None:
    assert not is_reached(RunFolder(tmp_path / "nothing"), Until(steps=1), is_changed=False)
    for path in driven.checkpoints.folder.glob("*.safetensors"):
        path.write_bytes(b"nothing")
    assert not is_reached(driven, Until(steps=1), is_changed=False)
