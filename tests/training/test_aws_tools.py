"""AWS's own tools read what a run of ours leaves behind: deepracer-utils, on its folder, its metrics and its log."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import TINY

from racecraft import evaluate, load_track, train
from racecraft.fidelity import replay
from racecraft.run import read_metrics

logs: Any
tracks: Any

pytestmark = [
    pytest.mark.costly,
    pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning", "ignore::UserWarning"),
]


@pytest.fixture(scope="module", autouse=True)
def _tools() -> None:
    """They load pandas and matplotlib: here, and not in every process that collects tests."""
    global logs, tracks
    pytest.importorskip("matplotlib").use("Agg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what its own imports deprecate is not ours
        logs = pytest.importorskip("deepracer.logs")
        tracks = pytest.importorskip("deepracer.tracks")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of some dozen episodes with two evaluations, and its logs beside it."""
    root = tmp_path_factory.mktemp("runs")
    result = train(
        "oval",
        ppo=TINY,
        until="2048 steps",
        num_threads=1,
        evaluation_trials=2,
        evaluate_every=1024,
        seed=3,
        root=root,
        aws_log=root / "training.log",
    )
    for number in range(2):
        evaluate(result.run, laps=2, num_trials=2, max_resets=4, video=False, aws_log=root / f"evaluation-{number}.log")
    return result.run


def test_the_folder_is_recognised_and_its_settings_are_found(run: Path) -> None:
    log = logs.DeepRacerLog(str(run))
    log.load()
    assert log.fh.type == logs.LogFolderType.DRFC_MODEL_SINGLE_WORKERS
    assert log.hyperparameters()["lr"] == TINY.learning_rate
    assert len(log.action_space()) == 10
    assert log.agent_and_network()["sensor_list"] == ["FRONT_FACING_CAMERA"]


def test_the_training_trace_and_everything_computed_from_it(run: Path) -> None:
    log = logs.DeepRacerLog(str(run))
    log.load()
    frame = log.dataframe()
    lines = read_metrics(run / "metrics" / "TrainingMetrics.json")["metrics"]
    episodes = [line for line in lines if line["phase"] == "training"]
    assert frame["episode"].nunique() == frame["unique_episode"].nunique() == len(episodes) > 20
    assert (frame["iteration"] == frame["episode"] // 20).all()
    assert (frame["unique_episode"] == frame["episode"]).all()

    table = logs.AnalysisUtils.simulation_agg(frame, secondgroup="unique_episode", add_tstamp=True, add_perf=True)
    assert len(table) == len(episodes)
    assert table["progress"].astype(int).tolist() == [line["completion_percentage"] for line in episodes]
    assert table["reward"].round().tolist() == pytest.approx([line["reward_score"] for line in episodes], abs=0.51)
    seconds = [line["elapsed_time_in_milliseconds"] / 1000 for line in episodes]
    assert table["time"].tolist() == pytest.approx(seconds, abs=0.07)  # it counts from the prepare row on
    assert np.isfinite(table.select_dtypes("number")).all(axis=None)
    logs.AnalysisUtils.analyze_training_progress(table, groupby_field="unique_episode")
    logs.AnalysisUtils.scatter_aggregates(table)
    assert len(log.stability.analyze()) == frame["iteration"].nunique()


def test_the_evaluations(run: Path) -> None:
    log = logs.DeepRacerLog(str(run))
    log.load_evaluation_trace()
    frame = log.dataframe()
    table = logs.AnalysisUtils.simulation_agg(frame, firstgroup="stream", is_eval=True)
    files = sorted((run / "metrics").glob("EvaluationMetrics-*.json"))
    trials = [trial for path in files for trial in read_metrics(path)["metrics"]]
    assert frame["stream"].nunique() == 2
    assert len(table) == len(trials)
    assert table["progress"].astype(int).tolist() == [trial["completion_percentage"] for trial in trials]
    assert table["off_track"].tolist() == [trial["off_track_count"] for trial in trials]
    assert table["complete"].tolist() == [int(trial["episode_status"] == "Lap complete") for trial in trials]


def test_the_pictures(run: Path) -> None:
    road = load_track("oval")
    rows = np.concatenate((road.centerline, road.inner, road.outer), axis=1)
    np.save(run / "oval.npy", rows)
    track = tracks.TrackIO(base_path=str(run)).load_track("oval.npy")
    log = logs.DeepRacerLog(str(run))
    log.load()
    frame = log.dataframe()
    best = logs.AnalysisUtils.simulation_agg(frame).nlargest(2, "progress")
    logs.PlottingUtils.plot_selected_laps(best, frame, track)
    logs.PlottingUtils.plot_laps(best, frame, track, style="modern")
    logs.PlottingUtils.plot_grid_world(frame[frame["episode"] == 0].copy(), track)
    log.load_evaluation_trace(force=True)
    logs.PlottingUtils.plot_evaluations(log.dataframe(), track)


def test_a_new_reward_is_tried_on_the_trace(run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    body = "        return params['speed'] + params['closest_waypoints'][1]\n"
    source = (
        "class Reward:\n    def __init__(self, verbose=False):\n        pass\n    def reward_function(self, params):\n"
    )
    (tmp_path / "my_new_reward.py").write_text(source + body)
    monkeypatch.syspath_prepend(tmp_path)
    log = logs.DeepRacerLog(str(run))
    log.load()
    frame = log.dataframe()[:200].copy()
    logs.NewRewardUtils.new_reward(frame, load_track("oval").waypoints, "my_new_reward")
    apart = frame["new_reward"] - frame["speed"] - frame["closest_waypoint"]
    assert set(apart) <= {0.0, 1.0}  # the waypoint ahead is the closest one or the next


def test_the_metrics(run: Path) -> None:
    metrics = logs.TrainingMetrics(None, fname=str(run / "metrics" / "TrainingMetrics.json"))
    document = read_metrics(run / "metrics" / "TrainingMetrics.json")["metrics"]
    assert len(metrics.getTraining()) + len(metrics.getEvaluation()) == len(document)
    assert metrics.getTraining()["iteration"].max() == (len(metrics.getTraining()) - 1) // 20
    summary = metrics.getSummary()
    assert summary["train_episodes"].sum() == len(metrics.getTraining())
    metrics.plotProgress()


def test_the_log_lines(run: Path) -> None:
    path = run.parent / "training.log"
    frame = logs.SimulationLogsIO.load_pandas(str(path), 20)
    log = logs.DeepRacerLog(str(run))
    log.load()
    whole = log.dataframe()
    assert len(frame) == len(whole)
    for name in ("episode", "steps", "iteration", "done", "on_track", "closest_waypoint", "episode_status", "tstamp"):
        assert frame[name].tolist() == whole[name].tolist(), name
    for name, digits in (("x", 4), ("y", 4), ("reward", 4), ("progress", 4), ("steering_angle", 2), ("speed", 2)):
        np.testing.assert_allclose(frame[name], whole[name], atol=0.51 * 10**-digits, err_msg=name)
    found = replay(path, track="oval")
    assert found.rules.rows == len(whole)
    assert found.to_dict()["progress_agreement"] == found.to_dict()["episode_end_agreement"] == 1.0

    text = path.read_text().splitlines()
    episodes = [line for line in text if line.startswith("Training> Name=main_level/agent, Worker=0, Episode=")]
    assert len(episodes) == whole["episode"].nunique()
    assert f"Steps={len(whole)}," in episodes[-1]
    updates = [line for line in text if line.startswith("Policy training> Surrogate loss=")]
    assert len(updates) == 2048 // 64
    fields = dict(part.split("=") for part in updates[-1].removeprefix("Policy training> ").split(", "))
    assert set(fields) == {"Surrogate loss", "KL divergence", "Entropy", "training epoch", "learning_rate"}
    assert all(np.isfinite(float(value)) for value in fields.values())


def test_the_console_s_layout_with_logs(run: Path, tmp_path: Path) -> None:
    """Where a log is read instead of the traces, its settings are in its lines too."""
    (tmp_path / "sim-trace" / "training" / "training-simtrace").mkdir(parents=True)
    for kind, name in (("training", "training-20260101000000-a"), ("evaluation", "evaluation-20260101000000-a")):
        (tmp_path / "logs" / kind).mkdir(parents=True)
        source = run.parent / ("training.log" if kind == "training" else "evaluation-0.log")
        (tmp_path / "logs" / kind / f"{name}-robomaker.log").write_text(source.read_text())
    log = logs.DeepRacerLog(str(tmp_path))
    log.load()
    assert log.fh.type == logs.LogFolderType.CONSOLE_MODEL_WITH_LOGS
    assert log.hyperparameters()["batch_size"] == TINY.minibatch_size
    assert log.agent_and_network() == {
        "world": "oval",
        "sensor_list": ["FRONT_FACING_CAMERA"],
        "network": "RACECRAFT_SMALL",
        "simapp_version": "5.0",
    }
    assert [set(action) >= {"steering_angle", "speed"} for action in log.action_space()] == [True] * 10
    log.load_robomaker_logs(type=logs.LogType.EVALUATION, force=True)
    trials = read_metrics(next((run / "metrics").glob("EvaluationMetrics-*.json")))["metrics"]
    assert log.dataframe()["episode"].nunique() == len(trials)
    assert (run.parent / "evaluation-0.log").read_text().count("Testing> Name=main_level/agent") == len(trials)
