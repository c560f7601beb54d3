"""Searches of a few tiny trials: what a trial is, how a search ends, goes on, and what it says."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from racecraft.errors import ConfigError, RewardError, RunError
from racecraft.learn import PPOConfig
from racecraft.run import RunFolder
from racecraft.tuning import TrialOutcome, Tuning, find_constants, start_tuning
from racecraft.tuning import study as study_module

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
    tuning = Tuning(folder)
    study = tuning._study()
    trial = study.ask()  # and here the process dies
    values = {parameter.name: study_module._suggest(trial, parameter) for parameter in tuning.space}
    outcome = Tuning(folder).run(minutes=5, max_trials=1)
    assert [trial.state for trial in outcome.trials] == ["complete", "complete", "fail", "complete"]
    assert outcome.trials[3].params == values
    assert len(Tuning(folder).run(minutes=5, max_trials=1).trials) == 5  # once is enough


def test_at_the_end_of_the_time_the_trial_under_way_is_kept_for_later(tmp_path: Path) -> None:
    folder = begin(tmp_path, trial_steps=10**8)
    first = Tuning(folder).run(minutes=2 / 60)
    assert [trial.state for trial in first.trials] == ["out of time"]
    assert not first.is_interrupted
    assert first.best is None
    second = Tuning(folder).run(minutes=1 / 60)
    assert second.trials[1].params == first.trials[0].params


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


def test_a_trial_that_lags_behind_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    optuna = pytest.importorskip("optuna")
    eager = optuna.pruners.ThresholdPruner(upper=0.5)  # nobody is that far after 64 steps
    monkeypatch.setattr(optuna.pruners, "MedianPruner", lambda **_: eager)
    outcome = Tuning(begin(tmp_path, trial_steps=10**6)).run(minutes=5, max_trials=2)
    assert [trial.state for trial in outcome.trials] == ["pruned", "pruned"]
    assert all(trial.steps == 64 for trial in outcome.trials)
    assert not outcome.is_interrupted


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
        ({"search": ["nonsense"]}, "neither a constant"),
    ],
)
def test_a_search_that_makes_no_sense_is_refused(tmp_path: Path, settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        begin(tmp_path, **settings)


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
    (folder / "study.sqlite").write_bytes(b"not a database")
    with pytest.raises(RunError, match=r"study\.sqlite cannot be used"):
        Tuning(folder).run(minutes=1)
    broken = tmp_path / "broken"
    shutil.copytree(folder, broken)
    document = json.loads((broken / "tuning.json").read_text())
    (broken / "tuning.json").write_text(json.dumps({**document, "space": [{"name": 1}]}))
    with pytest.raises(RunError, match="cannot be opened"):
        Tuning(broken)
