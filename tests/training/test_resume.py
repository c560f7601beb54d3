from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import TINY, Recorder, Train, assert_same, logs, weights

from alive_processes import is_alive
from racecraft import training
from racecraft.errors import CheckpointError, ConfigError, RunError
from racecraft.run import RunFolder
from racecraft.run.checkpoint import Checkpoint, CheckpointStore
from racecraft.track import generate_track
from racecraft.training import Reporter, TrainResult, Until, resume
from racecraft.training.job import Training

REMEMBERING = """
last = 0.0


def reward_function(params):
    global last
    gain, last = params["progress"] - last, params["progress"]
    return gain
"""


LOADED = """
import os, sys, traceback
from racecraft import train
from racecraft.learn import PPOConfig
from racecraft.training import algorithms, evaluator, resume
for line in sys.stdin:
    if child := os.fork():
        print(child, flush=True)
        os.waitpid(child, 0)
        print("ended", flush=True)
        continue
    os.dup2(2, 1)
    try:
        exec(line)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(0)
"""
"""Has each line done by a process of its own, whose start would be mostly loading."""


@pytest.mark.costly
def test_a_run_killed_at_any_iteration_resumes_as_if_it_never_was(tiny: Train, tmp_path: Path) -> None:
    """The folder, copied while training goes on, is what a kill at that moment leaves."""
    copies: list[Path] = []

    def copy(step: int) -> None:
        copies.append(tmp_path / "killed" / str(step))
        shutil.copytree(result_path, copies[-1])

    result_path = tmp_path / "runs" / "undisturbed"
    result = tiny(name="undisturbed", until="576 steps", evaluate_every=192, reporter=Recorder(copy))
    assert result.run == result_path
    for path in copies[::2]:  # before, at and after checkpoints
        resumed = resume(path)
        assert (resumed.reason, resumed.steps) == ("steps", result.steps)
        assert resumed.best_lap_seconds == result.best_lap_seconds
        assert_same(path, result.run)
        assert logs(path) == logs(result.run)


@pytest.mark.slow
def test_a_run_killed_again_and_again_ends_as_if_it_never_was(tiny: Train, tmp_path: Path) -> None:
    undisturbed = tiny(until="8192 steps", name="undisturbed")
    start = (
        "train('oval', reward='centerline', "
        "ppo=PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1), until='8192 steps', "
        "evaluate_every=128, evaluation_trials=2, num_threads=1, root='.', name='killed')"
    )
    go_on = "resume('killed')"
    run, rng = tmp_path / "killed", np.random.default_rng()
    manifest = run / "checkpoints" / "manifest.json"
    command = [sys.executable, "-c", LOADED]
    with subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as loaded:
        assert loaded.stdin is not None
        assert loaded.stdout is not None
        for _ in range(10):
            before = manifest.stat().st_mtime_ns if manifest.exists() else 0
            print(go_on if before else start, file=loaded.stdin, flush=True)
            process = int(loaded.stdout.readline())
            deadline = time.monotonic() + 300
            while is_alive(process) and time.monotonic() < deadline:
                if manifest.exists() and manifest.stat().st_mtime_ns != before:
                    break
                time.sleep(0.001)
            time.sleep(float(rng.uniform(0.0, 0.1)))
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
            assert loaded.stdout.readline() == "ended\n"
    recorder = Recorder()
    resume(run, reporter=recorder)
    assert recorder.notes[0].startswith("Resumed at step")
    assert_same(run, undisturbed.run)
    assert logs(run) == logs(undisturbed.run)


@pytest.mark.costly
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_saves_and_the_run_goes_on_to_the_same_weights(
    tiny: Train, tmp_path: Path, number: signal.Signals
) -> None:
    undisturbed = tiny(until="320 steps")
    handler = signal.getsignal(number)
    recorder = Recorder(lambda step: signal.raise_signal(number) if step == 192 else None)
    interrupted = tiny(until="320 steps", reporter=recorder)
    assert (interrupted.reason, interrupted.steps) == ("interrupted", 192)
    assert signal.getsignal(number) is handler
    assert any("Stopping" in note for note in recorder.notes)
    resumed = resume(interrupted.run)
    assert (resumed.reason, resumed.steps) == ("steps", 320)
    for name, array in weights(resumed.run).items():
        if not name.startswith("trace/"):
            np.testing.assert_array_equal(array, weights(undisturbed.run)[name], err_msg=name)


def test_an_interruption_before_the_first_evaluation_can_be_resumed(tiny: Train) -> None:
    recorder = Recorder(lambda step: signal.raise_signal(signal.SIGINT) if step == 64 else None)
    interrupted = tiny(reporter=recorder)
    assert recorder.evaluations == []
    assert interrupted.best_lap_seconds is None
    assert resume(interrupted.run).steps == 512


def test_a_second_ctrl_c_stops_at_once(tiny: Train, tmp_path: Path) -> None:
    def interrupt(step: int) -> None:
        if step == 192:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    recorder = Recorder(interrupt)
    with pytest.raises(KeyboardInterrupt):
        tiny(reporter=recorder, name="mine")
    assert "--resume" in recorder.notes[-1]
    folder = RunFolder.open(tmp_path / "runs" / "mine")
    assert folder.checkpoints.last is not None
    assert folder.checkpoints.last.step == 128
    assert resume(folder.path).steps == 512


@pytest.mark.costly
def test_another_thread_may_stop_it(tiny: Train) -> None:
    run = tiny(until="64 steps").run
    job = Training(RunFolder.open(run), until=Until(steps=10**9))
    job.reporter = Recorder(lambda step: job.stop() if step == 128 else None)
    assert (job.run().reason, job.run().steps) == ("interrupted", 128)


# ---- new limits


@pytest.mark.costly
def test_a_new_limit_replaces_the_old_one(tiny: Train) -> None:
    run = tiny(until="128 steps").run
    assert resume(run, until="256 steps").steps == 256
    assert resume(run, until=Until(steps=320)).steps == 320


@pytest.mark.costly
def test_a_limit_that_was_reached_before_ends_at_once_and_says_so(tiny: Train) -> None:
    run = tiny(until="128 steps").run
    recorder = Recorder()
    result = resume(run, reporter=recorder)
    assert (result.reason, result.steps, recorder.iterations) == ("steps", 128, [])
    assert any("reached before" in note for note in recorder.notes)
    assert "Resumed at step 128." in recorder.notes
    RunFolder.open(run).reward_function.write_text(REMEMBERING)
    resume(run, reporter=recorder)
    assert "Resumed at step 128; what the reward function remembered begins anew." in recorder.notes


def test_actions_that_cannot_be_learned_as_before_are_refused(tiny: Train) -> None:
    run = tiny(until="64 steps", ppo=replace(TINY, exploration="e-greedy")).run
    continuous = tiny(until="64 steps", actions="continuous").run
    shutil.copy(RunFolder.open(continuous).model_metadata, RunFolder.open(run).model_metadata)
    with pytest.raises(ConfigError, match="needs a discrete action space"):
        resume(run, until="128 steps")


def test_more_laps_than_there_were_trials_bring_more_trials(tiny: Train) -> None:
    run = tiny(until="128 steps", evaluation_trials=2).run
    assert resume(run, until="4 laps or 256 steps").evaluation_trials == 4


def test_seconds_count_from_the_first_start(tiny: Train) -> None:
    run = tiny(until="128 steps").run
    before = RunFolder.open(run).checkpoints.load("last").metadata["seconds"]
    assert before > 0
    result = resume(run, until=Until(seconds=before + 0.01))
    assert (result.reason, result.steps) == ("seconds", 128)


# ---- what cannot be resumed


def test_a_run_in_use_is_refused(tiny: Train) -> None:
    refused: list[str] = []

    def second(step: int) -> None:
        with pytest.raises(RunError, match="in use") as caught:
            resume(path)
        refused.append(str(caught.value))

    run = tiny(until="64 steps").run
    path = run
    resume(run, until="128 steps", reporter=Recorder(second))
    assert len(refused) == 1


@pytest.mark.costly
def test_a_track_that_changed_since_is_refused(tiny: Train, tmp_path: Path) -> None:
    def save(seed: int) -> None:
        track = generate_track(seed)
        np.save(tmp_path / "mine.npy", np.hstack([track.centerline, track.inner, track.outer]))

    save(1)
    run = tiny(str(tmp_path / "mine.npy"), until="64 steps").run
    save(2)
    with pytest.raises(ConfigError, match="digest"):
        resume(run, until="128 steps")
    save(1)
    assert resume(run, until="128 steps").steps == 128


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)


@pytest.mark.costly
@pytest.mark.parametrize("damage", [_flip, Path.unlink, lambda path: path.write_bytes(path.read_bytes()[:1000])])
def test_a_damaged_last_checkpoint_falls_back_to_the_one_before(tiny: Train, damage: Any) -> None:
    undisturbed = tiny().run
    run = tiny(until="384 steps").run
    last = RunFolder.open(run).checkpoints.last
    assert last is not None
    damage(run / "checkpoints" / last.file)
    recorder = Recorder()
    resume(run, until="512 steps", reporter=recorder)
    assert "Using step 256" in recorder.notes[0]
    assert "step 256" in recorder.notes[1]
    assert_same(run, undisturbed)


def test_what_python_collects_meanwhile_is_no_note_of_a_run(tiny: Train, monkeypatch: pytest.MonkeyPatch) -> None:
    # a file or process of somebody else's that is collected while a checkpoint is read warns, too
    run = tiny(until="64 steps").run
    load = CheckpointStore.load

    def slow(store: CheckpointStore, which: str | int = "last") -> Checkpoint:
        warnings.warn("subprocess 4711 is still running", ResourceWarning, stacklevel=2)
        return load(store, which)

    monkeypatch.setattr(CheckpointStore, "load", slow)
    recorder = Recorder()
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        resume(run, until="128 steps", reporter=recorder)
    assert recorder.notes == ["Resumed at step 64."]


def test_without_any_whole_checkpoint_it_says_so(tiny: Train) -> None:
    run = tiny(until="128 steps").run
    for path in (run / "checkpoints").glob("*.safetensors"):
        _flip(path)
    with pytest.raises(CheckpointError, match="checksum"):
        resume(run)


@pytest.mark.parametrize("count", [-1, 0, 2**62])
def test_a_checkpoint_that_counts_otherwise_than_it_is_called_is_refused(tiny: Train, count: int) -> None:
    run = tiny(until="64 steps").run
    store = RunFolder(run).checkpoints
    saved = store.load()
    saved.arrays["ppo/counters"][:] = count
    store.save(saved.step, saved.arrays, metadata=saved.metadata)
    with pytest.raises(CheckpointError, match="steps"):
        resume(run, until="128 steps")


@pytest.mark.parametrize("name", ["run.json", "model_metadata.json", "reward_function.py"])
def test_a_missing_file_is_named(tiny: Train, name: str) -> None:
    run = tiny(until="64 steps").run
    (run / name).unlink()
    with pytest.raises((RunError, ConfigError), match=name):
        resume(run, until="128 steps")


@pytest.mark.parametrize("key", ["settings", "seed", "track_digest"])
def test_a_damaged_run_json_is_refused(tiny: Train, key: str) -> None:
    run = tiny(until="64 steps").run
    document = json.loads((run / "run.json").read_text())
    document[key] = {}
    (run / "run.json").write_text(json.dumps(document))
    with pytest.raises((RunError, ConfigError)):
        resume(run, until="128 steps")


def test_a_folder_that_is_no_run_is_refused_with_the_nearest(tiny: Train, tmp_path: Path) -> None:
    tiny(until="64 steps", name="first-lap")
    with pytest.raises(RunError) as caught:
        resume(tmp_path / "runs" / "first-lapp")
    assert "first-lap" in caught.value.hint
    with pytest.raises(RunError, match=r"run\.json"):
        resume(tmp_path)


def test_the_public_functions_take_any_reporter(tiny: Train) -> None:
    reporter: Reporter = Recorder()
    result: TrainResult = tiny(until="64 steps", reporter=reporter)
    assert training.resume(result.run, until="128 steps", reporter=reporter).steps == 128
