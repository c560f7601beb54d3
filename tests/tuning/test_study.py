"""Searches of a few tiny trials: what a trial is, how a search ends, goes on, and what it says."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.errors import CheckpointError, ConfigError, RewardError, RunError
from racecraft.learn import PPOConfig
from racecraft.run import RunFolder, checkpoint
from racecraft.tuning import (
    Parameter,
    TrialOutcome,
    Tuning,
    drawing,
    find_constants,
    record,
    seats,
    start,
    start_tuning,
    study,
)
from racecraft.tuning.trial import Order, Report

TINY = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)


def begin(tmp_path: Path, **settings: Any) -> Path:
    defaults: dict[str, Any] = {
        "track": "oval",
        "search": ["BORDER_LOSS", "learning_rate=0.0005..0.003"],
        "trial_steps": 128,
        "reward": "racing",
        "ppo": TINY,
        "evaluate_every": 64,
        "evaluation_trials": 2,
        "num_threads": 1,
        "root": tmp_path,
        "name": "search",
    }
    given = {**defaults, **settings}
    return start_tuning(**{name: value for name, value in given.items() if value is not None})


@pytest.mark.costly
def test_every_trial_is_a_run_with_the_numbers_it_was_given(tmp_path: Path) -> None:
    told: list[TrialOutcome] = []
    outcome = Tuning(begin(tmp_path), on_trial=told.append).run(minutes=5, max_trials=3)
    assert [trial.number for trial in outcome.trials] == [trial.number for trial in told] == [0, 1, 2]
    assert outcome.trials[0].params == {"BORDER_LOSS": 0.5, "learning_rate": TINY.learning_rate}
    for trial in outcome.trials:
        run = RunFolder.open(trial.run)
        constants = find_constants(run.read_reward_function())
        assert constants["BORDER_LOSS"] == trial.params["BORDER_LOSS"]
        assert run.read_info().settings["ppo"]["learning_rate"] == trial.params["learning_rate"]
        assert run.checkpoints.last is not None
    assert outcome.best is not None
    assert outcome.best.value == min(trial.value for trial in outcome.trials if trial.value is not None)
    assert json.loads((tmp_path / "search" / "result.json").read_text())["best"]["run"] == outcome.best.run


@pytest.mark.slow
def test_a_search_goes_on_where_it_was_killed(tmp_path: Path) -> None:
    folder = begin(tmp_path)
    Tuning(folder).run(minutes=5, max_trials=2)
    number, values, _ = Tuning(folder)._record().begin(2)  # and here the process dies
    assert number == 2
    outcome = Tuning(folder).run(minutes=5, max_trials=1)
    assert [trial.state for trial in outcome.trials] == ["complete", "complete", "out of time", "complete"]
    assert outcome.trials[3].params == values
    assert len(Tuning(folder).run(minutes=5, max_trials=1).trials) == 5  # once is enough


@pytest.mark.slow
def test_trials_at_once_are_the_same_trials_also_where_one_was_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Mortal(seats.ProcessSeat):
        def run(self, order: Any) -> Any:
            if order.run.endswith("trial-0001"):
                self._started().kill()
            return super().run(order)

    monkeypatch.setattr(drawing, "BEGINNERS", 2)  # trials 4 and 5 are chosen by the estimator, 1 to 3 at random
    monkeypatch.setattr(study, "ProcessSeat", Mortal)
    found = []
    for processes in (1, 2):
        folder = begin(tmp_path, name=f"by-{processes}", window=3)
        outcome = Tuning(folder).run(minutes=5, max_trials=6, processes=processes)
        done = [trial for trial in outcome.trials if trial.state == "complete"]
        found.append(sorted((str(trial.params), trial.value, trial.completion, trial.steps) for trial in done))
        assert [trial.state for trial in outcome.trials].count("out of time") == processes - 1
    assert found[0] == found[1]
    assert len(found[0]) == 6


@pytest.mark.slow
def test_trials_at_once_end_with_the_time(tmp_path: Path) -> None:
    outcome = Tuning(begin(tmp_path, trial_steps=10**8)).run(minutes=1 / 60, processes=2)
    assert [trial.state for trial in outcome.trials] == ["out of time"] * 2


def test_a_seat_that_was_stopped_before_its_process_was_there_trains_nothing() -> None:
    seat = seats.ProcessSeat()
    seat.stop()
    with pytest.raises(seats.SeatLost):
        seat.run(Order(run="none", goal="laps", trial_steps=1))


def test_how_a_seats_process_ended_is_its_own_status() -> None:
    seat, code = seats.ProcessSeat(), "import os, time; os.close(1); time.sleep(0.2); os._exit(3)"
    seat._process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with pytest.raises(seats.SeatLost, match="ended with status 3"):
        seat.run(Order(run="none", goal="laps", trial_steps=1))


@pytest.mark.costly
def test_who_is_ready_first_does_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "BEGINNERS", 2)
    space = [Parameter("gamma", "hyperparameter", 0.9, 0.99, False, False, 0.95)]
    found = []
    for name, last_first in (("a", False), ("b", True)):
        (tmp_path / name).mkdir()
        book = record.Record(tmp_path / name, space, seed=3, window=3)
        under_way: dict[int, tuple[int, float]] = {}
        for _ in range(7):
            while len(under_way) < 3 and (place := book.next_place(list(under_way))) is not None:
                number, values, _ = book.begin(place)
                under_way[place] = number, values["gamma"]
            number, gamma = under_way.pop(max(under_way) if last_first else min(under_way))
            value = (gamma - 0.97) ** 2
            marks = (value,)
            book.tell(
                number,
                Report(reason="steps", value=value, marks=marks, completion=1.0, best_lap=None, steps=1, seconds=1.0),
            )
        found.append([trial.params["gamma"] for trial in book.trials()][:7])
    assert found[0] == found[1]
    assert len(set(found[0])) == 7


@pytest.mark.costly
@pytest.mark.parametrize("window", [1, 3])
def test_numbers_of_now_that_lie_outside_the_bounds_are_the_first_trial_and_teach_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder, window: int
) -> None:
    monkeypatch.setattr(drawing, "BEGINNERS", 2)
    space = [
        Parameter("gamma", "hyperparameter", 0.9, 0.99, False, False, 0.5),
        Parameter("minibatch_size", "hyperparameter", 1, 30, True, True, 128),
    ]
    book = record.Record(tmp_path, space, seed=3, window=window)
    found = []
    under_way: dict[int, int] = {}
    for _ in range(6):
        while (place := book.next_place(list(under_way))) is not None:
            under_way[place], values, _ = book.begin(place)
            found.append(values["gamma"])
        value = abs(found[-1] - 0.95)
        report = Report(reason="steps", value=value, marks=(), completion=1.0, best_lap=None, steps=1, seconds=1.0)
        book.tell(under_way.pop(min(under_way)), report)
        book = record.Record(tmp_path, space, seed=3, window=window)  # as one that goes on
    assert found[0] == 0.5
    assert all(0.9 <= gamma <= 0.99 for gamma in found[1:])
    assert len(set(found)) == len(found) >= 6
    assert not recwarn.list
    assert set(book.importances()) == {"gamma", "minibatch_size"}


@pytest.mark.costly
def test_what_kills_its_process_again_and_again_has_failed(tmp_path: Path) -> None:
    book = Tuning(begin(tmp_path))._record()
    for _ in range(record.MAX_LOSSES):
        number, _, _ = book.begin(0)
        book.tell_cut(number, is_lost=True)
    assert [trial.state for trial in book.trials()] == ["out of time", "out of time", "fail"]
    assert book.next_place([]) == 1


@pytest.mark.costly
def test_at_the_end_of_the_time_the_trial_under_way_is_kept_for_later(tmp_path: Path) -> None:
    folder = begin(tmp_path, trial_steps=10**8)
    first = Tuning(folder).run(minutes=2 / 60)
    assert [trial.state for trial in first.trials] == ["out of time"]
    assert not first.is_interrupted
    assert first.best is None
    second = Tuning(folder).run(minutes=1 / 60)
    assert second.trials[1].params == first.trials[0].params


@pytest.mark.costly
def test_trials_begin_with_a_parents_weights_and_awss_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the parent may be named from another folder than the search is resumed in
    parent = Tuning(begin(tmp_path, name="first"))
    parent.run(max_trials=1)
    file = tmp_path / "hyperparameters.json"
    file.write_text(json.dumps({"lr": 0.001, "batch_size": 64, "num_episodes_between_training": 4}))
    folder = begin(
        tmp_path,
        name="second",
        parent="first/trial-0000@last",
        hyperparameters=file,
        ppo=None,
        track=None,
        reward=None,
        search=["learning_rate"],
    )
    monkeypatch.chdir("/")
    outcome = Tuning(folder).run(max_trials=1)
    run = RunFolder.open(outcome.trials[0].run)
    information = run.read_info()
    assert information.parent is not None
    assert (information.parent["step"], information.track) == (128, "oval")
    ppo = information.settings["ppo"]
    assert (ppo["learning_rate"], ppo["minibatch_size"]) == (0.001, 64)
    assert run.read_aws_hyperparameters()["batch_size"] == 64
    shutil.rmtree(tmp_path / "first")
    with pytest.raises(RunError, match="trial-0000"):
        Tuning(folder)


def test_who_has_a_search_made_says_whose_it_is_and_where_its_parent_lies(tmp_path: Path) -> None:
    folder = begin(tmp_path, name="first")
    assert not Tuning(folder).plan.foreign
    assert Tuning(folder, foreign=True).plan.foreign
    document = json.loads((folder / "tuning.json").read_text())
    (folder / "tuning.json").write_text(json.dumps({**document, "foreign": True}))
    assert Tuning(folder, foreign=False).plan.foreign
    parent = Tuning(folder).plan.start(root=tmp_path / "theirs", name="run")
    parent.checkpoints.save(64, {"weights/x": np.zeros(1, dtype=np.float32)}, metadata={})
    (folder / "tuning.json").write_text(json.dumps({**document, "parent": f"{parent.path}@64"}))
    assert Tuning(folder, parents=tmp_path / "theirs").plan.parent is not None
    with pytest.raises(RunError, match="does not lie in"):
        Tuning(folder, parents=tmp_path)


@pytest.mark.costly
def test_a_trial_that_lags_behind_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record, "bars", lambda *_: (0.0, 0.5))  # nobody is that far after 128 steps
    outcome = Tuning(begin(tmp_path, trial_steps=10**6)).run(minutes=5, max_trials=2)
    assert [trial.state for trial in outcome.trials] == ["pruned", "pruned"]
    assert all(trial.steps == 128 for trial in outcome.trials)  # never at its first evaluation
    assert not outcome.is_interrupted


@pytest.mark.costly
def test_a_trial_that_fails_is_told_and_the_search_goes_on(tmp_path: Path) -> None:
    reward = tmp_path / "reward_function.py"
    reward.write_text("K = 1\n\ndef reward_function(params):\n    return 1.0 / max(0, 3 - K)\n")
    folder = begin(tmp_path, reward=reward, search=["K=1..9"])
    outcome = Tuning(folder).run(minutes=5, max_trials=6)
    failed = [trial for trial in outcome.trials if trial.state == "fail"]
    assert failed
    assert all(trial.params["K"] >= 3 and "ZeroDivisionError" in trial.error for trial in failed)
    assert outcome.best is not None
    assert outcome.best.params["K"] < 3


@pytest.mark.costly
def test_a_full_disk_ends_the_search_and_is_no_trials_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    folder = begin(tmp_path)
    with monkeypatch.context() as full:
        full.setattr(checkpoint, "write_file", no_space)
        with pytest.raises(CheckpointError, match="No space"):
            Tuning(folder).run(minutes=5)
    outcome = Tuning(folder).run(minutes=5, max_trials=1)
    assert [trial.state for trial in outcome.trials] == ["out of time", "complete"]
    assert outcome.trials[0].params == outcome.trials[1].params


@pytest.mark.costly
def test_a_study_that_is_damaged_in_the_middle_is_told_in_a_sentence(tmp_path: Path) -> None:
    folder = begin(tmp_path)

    def damage(_: TrialOutcome) -> None:
        (folder / "study.sqlite").write_bytes(b"not a database" * 1000)

    with pytest.raises(RunError, match=r"study\.sqlite cannot be used: file is not a database\."):
        Tuning(folder, on_trial=damage).run(minutes=5, max_trials=2)
    with pytest.raises(RunError, match=r"study\.sqlite cannot be used"):
        Tuning(folder).past()


@pytest.mark.costly
def test_what_does_not_train_now_is_an_error_and_no_search(tmp_path: Path) -> None:
    reward = tmp_path / "reward_function.py"
    reward.write_text("K = 1\n\ndef reward_function(params):\n    return params['sped'] * K\n")
    with pytest.raises(RewardError, match="sped"):
        Tuning(begin(tmp_path, reward=reward, search=["K"])).run(minutes=1)


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"goal": "fame"}, "goal is 'fame'; allowed are laps, lap_time"),
        ({"trial_steps": 0}, "trial_steps is 0"),
        ({"root": "a\0b"}, "root is .*; use a folder's path"),
        ({"name": 5}, "name is 5; use a text"),
        ({"search": ["nonsense"]}, "neither a constant"),
    ],
)
def test_a_search_that_makes_no_sense_is_refused(tmp_path: Path, settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        begin(tmp_path, **settings)


def test_a_study_lies_in_its_search_whatever_the_folder_is_called(tmp_path: Path) -> None:
    root = tmp_path / "which? 50% #1 {x}"
    Tuning(begin(root)).past()
    assert (root / "search" / "study.sqlite").is_file()
    assert [path.name for path in tmp_path.iterdir()] == [root.name]


def test_a_full_disk_at_the_beginning_leaves_the_name_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as full:
        full.setattr(start, "write_json", no_space)
        with pytest.raises(RunError, match="search cannot be made: No space left"):
            begin(tmp_path)
    assert begin(tmp_path).is_dir()


def test_names_limits_and_damage_are_told_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="not allowed"):
        begin(tmp_path, name="../up")
    folder = begin(tmp_path)
    with pytest.raises(RunError, match="exists"):
        begin(tmp_path)
    with pytest.raises(ConfigError, match="minutes is 0"):
        Tuning(folder).run(minutes=0)
    with pytest.raises(ConfigError, match="trials is -1"):
        Tuning(folder).run(max_trials=-1)
    with pytest.raises(RunError, match="holds no tuning"):
        Tuning(tmp_path)
    for wrong in (None, 5, "a\0b"):
        with pytest.raises(ConfigError, match=r"tuning is .*; use the path of a search's folder"):
            Tuning(wrong)  # type: ignore[arg-type]
    (folder / "study.sqlite").write_bytes(b"not a database")
    with pytest.raises(RunError, match=r"study\.sqlite cannot be used"):
        Tuning(folder).run(minutes=1)
    broken = tmp_path / "broken"
    shutil.copytree(folder, broken)
    document = json.loads((broken / "tuning.json").read_text())
    (broken / "tuning.json").write_text(json.dumps({**document, "space": [{"name": 1}]}))
    with pytest.raises(RunError, match="cannot be opened"):
        Tuning(broken)
