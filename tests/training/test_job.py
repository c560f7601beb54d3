from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import TINY, Recorder, Train, assert_same, logs

from racecraft import load_track
from racecraft.agent import Hyperparameters
from racecraft.errors import ConfigError, RewardError, RunError, TrackNotFound
from racecraft.run import RunFolder, read_metrics, read_simtrace
from racecraft.training import Until, resume
from racecraft.training.start import read_settings

DRFC = Path(__file__).parents[3] / "shared" / "logs" / "drfc"
AWS_LIKE = Hyperparameters(batch_size=32, num_epochs=3, num_episodes_between_training=8)


def save(parameters: Hyperparameters, folder: Path) -> Path:
    path = folder / "hyperparameters.json"
    parameters.save(path)
    return path


def test_the_run_folder_has_everything_where_aws_has_it(tiny: Train, tmp_path: Path) -> None:
    result = tiny(hyperparameters=save(AWS_LIKE, tmp_path), until="1 steps")
    files = {str(path.relative_to(result.run)) for path in result.run.rglob("*") if path.is_file()}
    assert {
        "run.json",
        "reward_function.py",
        "model_metadata.json",
        "hyperparameters.json",
        "training_params.yaml",
        "metrics/TrainingMetrics.json",
        "training-simtrace/0-iteration.csv",
        "model/model_metadata.json",
        "ip/hyperparameters.json",
        "model/deepracer_checkpoints.json",
        "checkpoints/manifest.json",
    } <= files
    assert any(name.startswith("events/events.out.tfevents.") for name in files)
    assert any(name.startswith("checkpoints/") and name.endswith(".safetensors") for name in files)
    assert not any(name.endswith((".tmp", ".pkl", ".pt")) for name in files)


def test_run_json_repeats_the_run(tiny: Train) -> None:
    result = tiny(seed=7, until="128 steps or 5 minutes", direction="alternate")
    document = json.loads((result.run / "run.json").read_text())
    assert document["seed"] == 7
    assert document["track"] == "oval"
    assert document["track_digest"] == load_track("oval").digest
    assert document["versions"]["racecraft"]
    settings = read_settings(RunFolder.open(result.run))
    assert (settings.seed, settings.until, settings.ppo) == (7, Until(steps=128, seconds=300), TINY)


@pytest.mark.costly
def test_metrics_and_simtrace_tell_the_same_story(tiny: Train) -> None:
    result = tiny(until="2048 steps")
    folder = RunFolder.open(result.run)
    lines = read_metrics(folder.training_metrics)["metrics"]
    episodes = [line for line in lines if line["phase"] == "training"]
    assert [line["episode"] for line in episodes] == list(range(1, len(episodes) + 1))
    assert len([line for line in lines if line["phase"] == "evaluation"]) == 2 * (2048 // 128)

    traces = [read_simtrace(path) for path in folder.training_simtrace.iterdir()]
    ended = {int(number): i for i, trace in enumerate(traces) for number in trace["episode"][trace["done"]]}
    assert sorted(ended) == list(range(len(episodes)))
    for number, line in enumerate(episodes):
        trace = traces[ended[number]]
        rows = trace["episode"] == number
        assert trace["episode_status"][rows][0] == "prepare"
        assert trace["steps"][rows].tolist() == list(range(1, rows.sum() + 1))
        assert line["reward_score"] == round(float(trace["reward"][rows].sum()))
        assert line["completion_percentage"] == int(trace["progress"][rows][-1])


def test_tensorboard_reads_the_events(tiny: Train) -> None:
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    result = tiny()
    events = accumulator.EventAccumulator(str(result.run / "events")).Reload()
    tags = set(events.Tags()["scalars"])
    assert {"training/reward", "training/completion", "losses/entropy", "evaluation/completion"} <= tags
    assert [event.step for event in events.Scalars("evaluation/completion")] == [128, 256, 384, 512]


@pytest.mark.costly
def test_the_same_seed_gives_the_same_bits_and_another_does_not(tiny: Train) -> None:
    first, again, other = (tiny(seed=seed, until="256 steps") for seed in (3, 3, 4))
    assert_same(first.run, again.run)
    assert logs(first.run) == logs(again.run)
    with pytest.raises(AssertionError):
        assert_same(first.run, other.run)


@pytest.mark.costly
def test_evaluations_do_not_touch_what_is_learned(tiny: Train) -> None:
    often, seldom = tiny(evaluate_every=64), tiny(evaluate_every=512)
    for name, array in RunFolder.open(often.run).checkpoints.load("last").arrays.items():
        if name.startswith(("weights/", "optimizer/", "ppo/")):
            np.testing.assert_array_equal(array, RunFolder.open(seldom.run).checkpoints.load("last").arrays[name])


def test_the_reporter_is_told_everything_in_order(tiny: Train) -> None:
    recorder = Recorder()
    result = tiny(reporter=recorder)
    assert [report.stats.total_steps for report in recorder.iterations] == list(range(64, 513, 64))
    assert [report.step for report in recorder.evaluations] == [128, 256, 384, 512]
    assert recorder.evaluations[0].is_best
    seconds = [report.seconds for report in recorder.iterations]
    assert seconds == sorted(seconds)
    assert all(report.steps_per_second > 0 for report in recorder.iterations)
    assert recorder.iterations[0].remaining is not None
    assert recorder.iterations[-1].remaining == 0
    assert result.steps == 512
    assert result.laps_completed == recorder.evaluations[-1].laps_completed
    assert sum(result.parts.values()) == pytest.approx(result.wall_seconds, rel=0.5)
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["run"] == str(result.run)


# ---- limits


def test_a_limit_of_steps(tiny: Train) -> None:
    result = tiny(until="100 steps")
    assert (result.reason, result.steps) == ("steps", 128)  # whole iterations


@pytest.mark.costly
def test_a_limit_of_seconds(tiny: Train) -> None:
    recorder = Recorder()
    result = tiny(until="1 s", reporter=recorder)
    assert result.reason == "seconds"
    assert result.wall_seconds >= 1.0
    assert recorder.iterations[0].remaining is not None


@pytest.mark.costly
def test_laps_end_a_training_when_enough_trials_complete(tiny: Train, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.race import evaluation
    from racecraft.training import evaluator

    def all_but_one(*arguments: Any, **settings: Any) -> evaluation.Completion:
        outcome = evaluation.completion(*arguments, **settings)
        times = np.full(len(outcome.completions), 9.5)
        times[0] = math.nan
        return replace(outcome, lap_times=times)

    monkeypatch.setattr(evaluator, "completion", all_but_one)
    result = tiny(until="4 laps or 256 steps", evaluation_trials=5)
    assert (result.reason, result.laps_completed, result.best_lap_seconds) == ("laps", 4, 9.5)
    assert result.steps == 128
    result = tiny(until="5 laps or 256 steps", evaluation_trials=5)
    assert (result.reason, result.laps_completed, result.evaluation_trials) == ("steps", 4, 5)


@pytest.mark.parametrize(
    ("condition", "reason"), [({"term_cond_max_episodes": 20}, "episodes"), ({"term_cond_avg_score": 0.01}, "score")]
)
def test_aws_own_conditions_end_a_training(tiny: Train, tmp_path: Path, condition: dict[str, Any], reason: str) -> None:
    result = tiny(hyperparameters=save(replace(AWS_LIKE, **condition), tmp_path), until="100000 steps")
    assert result.reason == reason
    assert result.steps < 5000


@pytest.mark.costly
def test_a_mean_reward_of_just_the_score_is_enough(tiny: Train, tmp_path: Path) -> None:
    source = tmp_path / "reward_function.py"
    source.write_text("def reward_function(params):\n    return 0.0\n")
    parameters = save(replace(AWS_LIKE, term_cond_avg_score=0.0), tmp_path)
    assert tiny(reward=source, hyperparameters=parameters, until="1000 steps").reason == "score"


# ---- ways to train


def test_whole_episodes_as_aws(tiny: Train, tmp_path: Path) -> None:
    recorder = Recorder()
    result = tiny(hyperparameters=save(AWS_LIKE, tmp_path), until="300 steps", reporter=recorder)
    assert all(report.stats.episodes == 8 for report in recorder.iterations)
    lines = read_metrics(result.run / "metrics" / "TrainingMetrics.json")["metrics"]
    trials = [line["trial"] for line in lines if line["phase"] == "training"]
    assert trials == [1, 2, 3, 4, 5, 6, 7, 8] * len(recorder.iterations)  # no car drives more than its share


def test_e_greedy_exploration(tiny: Train, tmp_path: Path) -> None:
    parameters = replace(AWS_LIKE, exploration_type="e-greedy", e_greedy_value=0.05, epsilon_steps=200)
    assert tiny(hyperparameters=save(parameters, tmp_path), until="200 steps").reason == "steps"


def test_e_greedy_is_nothing_to_continuous_actions(tiny: Train, tmp_path: Path) -> None:
    recorder = Recorder()
    parameters = save(replace(AWS_LIKE, exploration_type="e-greedy"), tmp_path)
    result = tiny(hyperparameters=parameters, actions="continuous", until="64 steps", reporter=recorder)
    assert any("'e-greedy' has no effect" in note for note in recorder.notes)
    assert json.loads((result.run / "hyperparameters.json").read_text())["exploration_type"] == "e-greedy"


def test_our_e_greedy_with_continuous_actions_is_refused_before_anything_is_written(
    tiny: Train, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match="e-greedy"):
        tiny(ppo=replace(TINY, exploration="e-greedy"), actions="continuous")
    assert not (tmp_path / "runs").exists()


def test_what_only_awss_console_refused_trains(tiny: Train, tmp_path: Path) -> None:
    recorder = Recorder()
    wide = replace(AWS_LIKE, num_epochs=1, batch_size=1000, lr=0.01, num_episodes_between_training=200)
    tiny(hyperparameters=save(wide, tmp_path), until="100 steps", reporter=recorder)
    assert all(report.stats.episodes == 200 for report in recorder.iterations)
    assert len([note for note in recorder.notes if "AWS's console allowed" in note]) == 4


def test_continuous_actions(tiny: Train) -> None:
    result = tiny(actions="continuous")
    trace = read_simtrace(next((result.run / "training-simtrace").iterdir()))
    assert trace["action"].shape == (len(trace["steps"]), 2)
    assert np.ptp(trace["steer"]) > 10


@pytest.mark.costly
@pytest.mark.parametrize("direction", ["reverse", "alternate"])
def test_directions(tiny: Train, direction: str) -> None:
    result = tiny(direction=direction, until="1024 steps")
    params = (result.run / "training_params.yaml").read_text()
    assert f"REVERSE_DIR: {'true' if direction == 'reverse' else 'false'}" in params
    assert f"ALTERNATE_DRIVING_DIRECTION: {'true' if direction == 'alternate' else 'false'}" in params


@pytest.mark.costly
def test_a_reward_that_remembers_has_a_memory_for_each_car(tiny: Train, tmp_path: Path) -> None:
    source = tmp_path / "reward_function.py"
    source.write_text(
        "last = 0\ndef reward_function(params):\n    global last\n"
        "    follows, last = params['steps'] - last, params['steps']\n"
        "    return 1.0 if follows == 1 or params['steps'] == 2 else -50.0\n"
    )
    result = tiny(reward=source)
    trace = read_simtrace(next((result.run / "training-simtrace").iterdir()))
    assert trace["reward"].min() >= 0


@pytest.mark.slow
@pytest.mark.skipif(not DRFC.is_dir(), reason="the logs of a real AWS training are not here (../shared/logs/drfc)")
def test_aws_own_files_train_unchanged(tiny: Train, tmp_path: Path) -> None:
    result = tiny(
        "reinvent_2018",
        model_metadata=DRFC / "model_metadata.json",
        hyperparameters=DRFC / "hyperparameters.json",
        until="1 steps",
        evaluation_trials=1,
    )
    assert read_settings(RunFolder.open(result.run)).network == "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
    for name in ("model_metadata.json", "hyperparameters.json"):
        written, original = (json.loads((folder / name).read_text()) for folder in (result.run, DRFC))
        assert written == original
    lines = read_metrics(result.run / "metrics" / "TrainingMetrics.json")["metrics"]
    assert len([line for line in lines if line["phase"] == "training"]) == 20


# ---- what is refused before a run folder is made


@pytest.mark.parametrize(
    ("settings", "error", "says"),
    [
        ({"track": "ovall"}, TrackNotFound, "oval"),
        ({"reward": "racign"}, RewardError, "racing"),
        ({"until": "soon"}, ConfigError, "until"),
        ({"until": 5}, ConfigError, "until"),
        ({"actions": "evrything"}, ConfigError, "evrything"),
        ({"vehicle": "v9"}, ConfigError, "v9"),
        ({"seed": -1}, ConfigError, "seed"),
        ({"num_envs": -4}, ConfigError, "num_envs"),
        ({"model_metadata": "nowhere.json"}, ConfigError, "nowhere.json"),
        ({"hyperparameters": "nowhere.json"}, ConfigError, "nowhere.json"),
        ({"learning_rate": 1.0}, ConfigError, "learning_rate"),
        ({"name": "../escape"}, RunError, "escape"),
    ],
)
def test_bad_input_leaves_no_folder(
    tiny: Train, tmp_path: Path, settings: dict[str, Any], error: type[Exception], says: str
) -> None:
    with pytest.raises(error) as caught:
        tiny(**settings)
    assert says in str(caught.value) + getattr(caught.value, "hint", "")
    assert not list((tmp_path / "runs").glob("*"))


@pytest.mark.parametrize(
    "source", ["", "def reward(params): return 1", "def reward_function(params):\n    return params['sped']\n"]
)
def test_a_reward_that_cannot_be_right_leaves_no_folder(tiny: Train, tmp_path: Path, source: str) -> None:
    path = tmp_path / "reward_function.py"
    path.write_text(source)
    with pytest.raises(RewardError):
        tiny(reward=path)
    assert not (tmp_path / "runs").exists()


def test_a_taken_name_is_refused(tiny: Train) -> None:
    run = tiny(name="mine", until="64 steps").run
    with pytest.raises(RunError, match="exists"):
        tiny(name="mine")
    assert resume(run, until="128 steps").steps == 128


# ---- how it learned


@pytest.mark.costly
def test_laps_of_a_training_are_kept_and_change_nothing(tiny: Train, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.judging.evolution import drive_checkpoint, evolution_of
    from racecraft.run.evolution import read_drives
    from racecraft.training.job import Training

    plain = tiny(seed=5)
    monkeypatch.setattr(Training, "looks_on", True)
    looked = tiny(seed=5)
    assert_same(plain.run, looked.run)
    seldom, often = (read_drives(RunFolder.open(result.run)) for result in (plain, looked))
    assert [drive.step for drive in seldom] == [128, 256, 384, 512]
    assert {drive.step for drive in often} == {64, 128, 192, 256, 320, 384, 448, 512}
    for drive in seldom:
        (same,) = [one for one in often if one.step == drive.step]
        assert same.point() == drive.point()

    folder = RunFolder.open(looked.run)
    best = folder.checkpoints.best
    assert best is not None
    (kept,) = [drive for drive in often if drive.step == best.step]
    driven = drive_checkpoint(folder, best.step, num_trials=1).trials[0].recording
    rows = min(len(kept.poses), len(driven.poses))
    start = len(driven.poses) - len(kept.poses)
    assert start in (0, 1)  # a recording has the row of preparation, too
    np.testing.assert_allclose(kept.poses[: rows - 1], 1000 * driven.poses[start:][: rows - 1], atol=1)
    shown = evolution_of(folder)
    assert shown[-1].step == best.step
    assert [drive.step for drive in shown] == sorted({drive.step for drive in shown})
    folder.evolution.unlink()  # as of a run from before
    assert [drive.step for drive in evolution_of(folder)][-1] == best.step


def test_a_film_needs_something_to_compare(tiny: Train) -> None:
    from racecraft.judging.evolution import film_evolution

    run = tiny(until="64 steps", evaluate_every=64).run
    with pytest.raises(RunError, match="no earlier laps"):
        film_evolution(run)
