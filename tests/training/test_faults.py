"""What may go wrong in the middle of a training: one clear error, and a checkpoint that is good."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder, Train, assert_same

from racecraft.errors import CheckpointError, RacecraftError, RewardError, RunError, TrainingError
from racecraft.learn import UpdateStats, make_learner
from racecraft.race import seeing
from racecraft.reward import RewardWorker
from racecraft.run import RunFolder, checkpoint, folder, metrics, simtrace
from racecraft.training import resume, session

# Never true in the dry run, whose only situation off the track has 95 steps.
LATE = """\
def reward_function(params):
    if params['is_offtrack'] and params['steps'] != 95:
        {fault}
    return 1.0
"""
# Fails in the 20th call for a car: after the dry run, which makes 14.
LATER = """\
calls = 0
def reward_function(params):
    global calls
    calls += 1
    if calls == 20:
        return None
    return 1.0
"""
FAULTS = {
    "exception": ("return 1 / (params['steps'] - params['steps'])", "ZeroDivisionError"),
    "key": ("return params['objects_distance'][9]", "IndexError"),
    "nan": ("return float('nan')", "nan"),
    "infinity": ("return -float('inf')", "inf"),
    "none": ("return None", "None"),
    "nothing": ("return", "None"),
    "text": ("return str(params['steps'])", "text"),
    "huge": ("return 1e6", "1000000"),
    "hang": ("while True: pass", "within 0.3 s"),
    "exit": ("raise SystemExit(3)", "exit"),
}


@pytest.mark.costly
@pytest.mark.parametrize("fault", FAULTS)
def test_a_reward_that_fails_late_stops_with_line_and_params(
    tiny: Train, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    code, says = FAULTS[fault]
    source = tmp_path / "reward_function.py"
    source.write_text(LATE.format(fault=code))
    monkeypatch.setattr(session, "RewardWorker", partial(RewardWorker, timeout_s=0.3))
    with pytest.raises(RewardError) as caught:
        tiny(reward=source, name="mine", until="2048 steps", evaluate_every=64)
    error = caught.value
    assert says in str(error)
    assert (error.line, error.params is not None) == (3, True)
    assert "line 3" in str(error)
    assert code.split("\n")[0] in str(error)
    assert "params = {" in str(error)
    run = tmp_path / "runs" / "mine"
    assert "last checkpoint is good" in error.hint
    assert f"--resume {run}" in error.hint
    saved = RunFolder.open(run).checkpoints.load("last").step
    assert saved >= 64

    (run / "reward_function.py").write_text("def reward_function(params):\n    return 1.0\n")
    assert resume(run, until=f"{saved + 64} steps").steps == saved + 64


def test_a_reward_that_fails_before_the_first_checkpoint_says_how_to_go_on(tiny: Train, tmp_path: Path) -> None:
    source = tmp_path / "reward_function.py"
    source.write_text(LATER)
    with pytest.raises(RewardError, match="returned None") as caught:
        tiny(reward=source, name="mine", evaluate_every=512)
    assert "Correct" in caught.value.hint
    assert "checkpoint is good" not in caught.value.hint
    (tmp_path / "runs" / "mine" / "reward_function.py").write_text(LATER.replace("20", "-1"))
    assert resume(tmp_path / "runs" / "mine").steps == 512


FAULTY_ARRAYS: dict[str, tuple[str, Any, str]] = {
    "int8": ("optimizer/moment1/policy.head.bias", lambda array: array.astype(np.int8), "is int8 instead of float32"),
    "float64": ("weights/policy.head.bias", lambda array: array.astype(np.float64), "is float64 instead of float32"),
    "the mean": ("average/policy.head.bias", lambda array: array.astype(np.int8), "averaged weights"),
    "NaN": ("weights/policy.head.bias", lambda array: array * np.float32(np.nan), "holds NaN or infinity"),
    "infinity": ("ppo/episode_returns", lambda array: array + np.inf, "holds NaN or infinity"),
    "counters": ("ppo/counters", lambda array: array.astype(np.float64), "is float64 instead of int64"),
}


@pytest.mark.parametrize("fault", FAULTY_ARRAYS)
def test_a_checkpoint_of_other_types_or_without_numbers_is_not_gone_on_with(tiny: Train, fault: str) -> None:
    name, change, says = FAULTY_ARRAYS[fault]
    run = RunFolder.open(tiny(until="256 steps", evaluate_every=128).run)
    store = run.checkpoints
    saved = store.load("last")
    arrays = {**saved.arrays, name: change(saved.arrays[name])}
    store.save(saved.step, arrays, metadata=saved.metadata, metrics={}, score=saved.score)
    with pytest.raises(CheckpointError, match=says):
        resume(run.path, until="512 steps")


PRINTS = """\
count = 0
print("loaded")
def reward_function(params):
    global count
    count += 1
    print("call", count, "of step", params["steps"])
    return 1.0 if count != {last} else "no number"
"""


@pytest.mark.costly
def test_prints_are_kept_up_to_the_one_before_the_error(tiny: Train, tmp_path: Path) -> None:
    source, recorder = tmp_path / "reward_function.py", Recorder()
    source.write_text(PRINTS.format(last=40))
    with pytest.raises(RewardError, match="no number") as caught:
        tiny(reward=source, name="mine", until="2048 steps", evaluate_every=64)
    assert "It printed last:" in str(caught.value)
    assert "call 40 of step" in str(caught.value)
    run = tmp_path / "runs" / "mine"
    lines = RunFolder.open(run).reward_log.read_text().splitlines()
    assert lines[:8] == ["loaded"] * 8  # once for each car, which has its own memory
    assert lines[8:16] == ["call 1 of step 2.0"] * 8
    assert lines[-1].startswith("call 40 of step")

    (run / "reward_function.py").write_text(PRINTS.format(last=-1))
    resume(run, until="512 steps", reporter=recorder)
    assert recorder.notes[0] == "From here on with other reward."
    assert "what the reward function remembered begins anew" in recorder.notes[1]
    more = RunFolder.open(run).reward_log.read_text().splitlines()
    assert more[: len(lines)] == lines
    assert more[len(lines) : len(lines) + 9] == ["loaded"] * 8 + [more[len(lines) + 8]]
    assert "call 1 of step" in more[len(lines) + 8]


def test_a_reward_edited_badly_is_refused_on_resume(tiny: Train) -> None:
    run = tiny(until="128 steps").run
    (run / "reward_function.py").write_text("def reward_function(params):\n    return params['sped']\n")
    with pytest.raises(RewardError, match="sped"):
        resume(run, until="256 steps")


def _no_space(*_: Any, **__: Any) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_at_the_beginning_leaves_the_name_free(
    tiny: Train, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder, "write_json", _no_space)
    with pytest.raises(RunError, match="No space"):
        tiny(name="mine")
    assert not (tmp_path / "runs" / "mine").exists()


def test_a_full_disk_at_a_checkpoint_leaves_the_ones_before(
    tiny: Train, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(step: int) -> None:
        if step == 320:
            monkeypatch.setattr(checkpoint, "write_file", _no_space)

    with pytest.raises(CheckpointError, match="No space") as caught:
        tiny(name="mine", reporter=Recorder(fill))
    assert "earlier checkpoints are good" in caught.value.hint
    monkeypatch.undo()
    run = tmp_path / "runs" / "mine"
    last = RunFolder.open(run).checkpoints.last
    assert last is not None
    assert last.step == 256
    resume(run)
    assert_same(run, tiny().run)


@pytest.mark.costly
@pytest.mark.parametrize("log", ["metrics", "sim-trace"])
def test_a_full_disk_at_a_log_is_one_clear_error(
    tiny: Train, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, log: str
) -> None:
    def fill(step: int) -> None:
        if step == 256 and log == "metrics":
            monkeypatch.setattr(metrics, "write_file", _no_space)
        elif step == 256:
            monkeypatch.setattr(simtrace.SimTraceWriter, "_write", write)

    def write(writer: simtrace.SimTraceWriter, text: str) -> None:
        if writer._file is not None:
            writer._file.close()
        writer._file = SimpleNamespace(write=_no_space, close=lambda: None)  # type: ignore[assignment]
        write_for_real(writer, text)

    write_for_real = simtrace.SimTraceWriter._write
    with pytest.raises(RunError, match="No space") as caught:
        tiny(name="mine", reporter=Recorder(fill), until="2048 steps")
    monkeypatch.undo()
    assert "--resume" in caught.value.hint
    assert resume(tmp_path / "runs" / "mine").steps == 2048


def test_a_loss_that_is_not_finite_stops_and_the_checkpoint_is_good(
    tiny: Train, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Spoiled:
        """Everything a learner does, until its ninth gradient step."""

        def __init__(self, *arguments: Any, **settings: Any) -> None:
            self._learner, self._count = make_learner(*arguments, **settings), 0

        def __getattr__(self, name: str) -> Any:
            return getattr(self._learner, name)

        def update(self, *minibatch: Any) -> UpdateStats:
            self._count += 1
            stats = self._learner.update(*minibatch)
            return stats if self._count < 9 else replace(stats, policy_loss=float("nan"))

    monkeypatch.setattr(seeing, "learner_of", Spoiled)
    with pytest.raises(TrainingError) as caught:
        tiny(name="mine")
    assert isinstance(caught.value, RacecraftError)
    monkeypatch.undo()
    assert resume(tmp_path / "runs" / "mine").steps == 512
