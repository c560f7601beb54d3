"""`racecraft train`: from its options to its last line, and what stops it."""

from __future__ import annotations

import json
import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest
from command_line import GOOD_REWARD, SMALL, Run


@pytest.mark.costly
def test_train_ends_with_one_json_object(racecraft: Run) -> None:
    outcome = racecraft("train", *SMALL, "--until", "1024 steps", "--seed", "3", "--name", "mine", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    result = outcome.document
    assert result["run"] == "runs/mine"
    assert result["steps"] == 1024
    assert result["wall_seconds"] > 0
    assert 0 <= result["laps_completed"] <= result["evaluation_trials"] == 5
    assert result["best_lap_seconds"] is None or result["best_lap_seconds"] > 0
    assert result["reason"] == "steps"
    assert json.loads(Path("runs/mine/run.json").read_text())["seed"] == 3


@pytest.mark.costly
def test_notes_on_the_files_are_in_the_json_or_on_stderr(racecraft: Run) -> None:
    Path("hyperparameters.json").write_text(json.dumps({"num_epochs": 1, "num_epoch": 3, "batch_size": 32}))
    command = ("train", *SMALL, "--hyperparameters", "hyperparameters.json", "--until", "1 steps")
    notes = [
        "hyperparameters.json: unknown field 'num_epoch' has no effect. Did you mean 'num_epochs'?",
        "hyperparameters.json: num_epochs is 1, and AWS's console allowed 3 to 10.",
    ]
    told = racecraft(*command, "--json")
    assert (told.status, told.err, told.document["notes"]) == (0, "", notes)
    logged = racecraft(*command, "--aws-log", "-")
    assert (logged.status, [note in " ".join(logged.err.split()) for note in notes]) == (0, [True, True])
    assert "no effect" not in logged.out
    assert racecraft("train", *SMALL, "--until", "1 steps", "--json").document["notes"] == []


@pytest.mark.costly
def test_train_against_itself_and_against_the_run_that_came_of_it(racecraft: Run) -> None:
    race = ("--race", "head-to-head", "--cars", "3", "--until", "512 steps", "--json")
    first = racecraft("train", *SMALL, *race, "--name", "first")
    assert (first.status, first.err) == (0, "")
    opponents = json.loads(Path("runs/first/run.json").read_text())["settings"]["opponents"]
    assert (opponents["drivers"], opponents["cars"]) == (["self"], 3)
    second = racecraft("train", *SMALL, *race, "--opponents", "runs/first", "--reward", "overtake", "--name", "second")
    assert (second.status, second.err) == (0, "")
    bots = racecraft("train", *SMALL, "--race", "head-to-head", "--opponents", "bots", "--bots", "2", *race[4:])
    assert (bots.status, bots.err) == (0, "")
    assert json.loads(Path(bots.document["run"], "run.json").read_text())["settings"]["objects"]["bots"]["count"] == 2


@pytest.mark.costly
def test_train_tells_people_how_it_goes_and_how_to_go_on(racecraft: Run) -> None:
    outcome = racecraft("train", *SMALL, "--until", "1024 steps", "--name", "mine", "--runs", "my runs")
    assert outcome.status == 0
    assert len([line for line in outcome.err.splitlines() if "of 5 laps" in line]) == 2
    assert "All steps are done" in outcome.out
    assert "Run folder: my runs/mine\n" in outcome.out
    assert "racecraft train --resume 'my runs/mine'\n" in outcome.out  # as a shell takes it
    assert "racecraft evaluate 'my runs/mine'\n" in outcome.out
    resumed = racecraft("train", "--resume", "my runs/mine", "--until", "1536 steps", "--json")
    assert (resumed.status, resumed.document["steps"]) == (0, 1536)
    taken = racecraft("train", *SMALL, "--name", "mine", "--runs", "my runs", "--json")
    assert taken.document["error"]["code"] == "RunError"
    assert "--resume" in taken.document["error"]["hint"]


@pytest.mark.costly
def test_the_log_of_aws_on_stdout_is_all_there_is_on_stdout(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("train", *SMALL, "--until", "512 steps", "--name", "mine", "--aws-log", "-")
    assert outcome.status == 0
    marks = ("SIM_TRACE_LOG:", "Training> Name=main_level/agent, ", "Policy training> Surrogate loss=", "Sensor list ")
    for mark in marks:
        assert any(line.startswith(mark) for line in outcome.out.splitlines()), mark
    assert "Learned" not in outcome.out
    assert outcome.err == ""
    racecraft("train", "--resume", "runs/mine", "--until", "1024 steps", "--aws-log", "later/mine.log", "--json")
    assert "SIM_TRACE_LOG:" in Path("later/mine.log").read_text()
    outcome = racecraft(
        "evaluate", str(trained), "--laps", "1", "--trials", "1", "--no-video", "--max-resets", "2", "--aws-log", "-"
    )
    assert outcome.out.splitlines()[-1].startswith("Testing> Name=main_level/agent")
    for verb in ("train", "evaluate runs/mine"):
        outcome = racecraft(*verb.split(), "--aws-log", "-", "--json")
        assert outcome.status == 2
        assert "both want stdout" in outcome.err


def test_train_with_a_video_evaluates_in_the_same_object(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.judging import evaluation as run_evaluation

    asked: list[Path] = []

    class Evaluated:
        def to_dict(self) -> dict[str, Any]:
            return {"laps_completed": 3}

    monkeypatch.setattr(run_evaluation, "evaluate_run", lambda run: asked.append(run) or Evaluated())
    result = racecraft("train", *SMALL, "--until", "512 steps", "--name", "mine", "--video", "--json").document
    assert asked == [Path("runs/mine")]
    assert result["evaluation"] == {"laps_completed": 3}


def test_a_reward_that_fails_late_is_one_error(racecraft: Run, tmp_path: Path) -> None:
    source = GOOD_REWARD.replace(
        "    return", "    if params['is_offtrack'] and params['steps'] != 95: return None\n    return"
    )
    (tmp_path / "mine.py").write_text(source)
    outcome = racecraft("train", *SMALL, "--reward", "mine.py", "--until", "9000 steps", "--name", "mine")
    assert outcome.status == 1
    assert "line 2" in outcome.err
    assert "params = {" in outcome.err
    assert "--resume runs/mine" in outcome.err
    assert "Traceback" not in outcome.err


@pytest.mark.costly
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_training_is_status_130_and_can_go_on(racecraft: Run, number: signal.Signals) -> None:
    ended = threading.Event()

    def interrupt() -> None:
        while not Path("runs/mine/checkpoints/manifest.json").exists():
            if ended.wait(0.01):
                return  # the signal would end the tests, not the training
        os.kill(os.getpid(), number)

    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        outcome = racecraft("train", *SMALL, "--until", "10 minutes", "--name", "mine")
    finally:
        ended.set()
        thread.join()
    assert outcome.status == 130, outcome
    assert "Stopped" in outcome.out
    assert "racecraft train --resume runs/mine" in outcome.out
    resumed = racecraft("train", "--resume", "runs/mine", "--until", "1 steps", "--json")
    assert (resumed.status, resumed.document["reason"]) == (0, "steps")
