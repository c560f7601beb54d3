import json

import numpy as np
import pytest

from racecraft.agent import ContinuousActionSpace, DiscreteActionSpace
from racecraft.race import Autopilot, RaceRules, evaluate
from racecraft.race.artifacts import metrics_of, write_metrics, write_simtrace
from racecraft.run import read_metrics, read_simtrace
from racecraft.track import load_track

OVAL = load_track("oval")
ACTIONS = DiscreteActionSpace([(-0.5, 1.0), (0.0, 1.0), (0.0, 2.0), (0.5, 1.0)])


def clumsy(state):
    """Turns left or right by the offset and now and then speeds ahead: leaves the track sometimes."""
    index = np.where(state[:, 4] > 0.9, 0, np.where(state[:, 8] > 0.3, 3, 2))
    return ACTIONS.to_commands(index)


def race(driver=clumsy, *, num_trials=2, **rules):
    return evaluate(driver, OVAL, rules=RaceRules(**rules), num_trials=num_trials, sees="state")


def test_metrics_have_every_lap_on_one_clock(tmp_path):
    evaluation = race(laps=2, offtrack_penalty=1.0)
    write_metrics(evaluation, tmp_path / "metrics" / "EvaluationMetrics-1.json")
    entries = read_metrics(tmp_path / "metrics" / "EvaluationMetrics-1.json")["metrics"]
    assert entries == json.loads(json.dumps([vars(entry) for entry in metrics_of(evaluation)]))
    assert [entry["trial"] for entry in entries] == [1, 2, 3, 4]
    for entry, lap in zip(entries, evaluation.laps(), strict=True):
        assert entry["elapsed_time_in_milliseconds"] == pytest.approx(1000 * lap.time, abs=1)
        assert entry["elapsed_time_in_milliseconds"] == entry["metric_time"] - entry["start_time"]
        assert entry["off_track_count"] == entry["reset_count"] == lap.off_track_count
        assert (entry["completion_percentage"], entry["episode_status"]) == (100, "Lap complete")
    assert entries[1]["start_time"] == entries[0]["metric_time"]  # a flying lap
    assert entries[2]["start_time"] > entries[1]["metric_time"]
    assert sum(entry["off_track_count"] for entry in entries) > 0


def test_an_incomplete_lap_counts_its_last_mistake():
    (entry,) = metrics_of(race(lambda state: np.tile(np.float32([0, 2]), (len(state), 1)), num_trials=1, max_resets=0))
    assert entry.episode_status == "Off track"
    assert (entry.off_track_count, entry.reset_count) == (1, 1)
    assert 0 < entry.completion_percentage < 100


@pytest.mark.parametrize("is_continuous", [True, False])
def test_simtrace_has_every_step(tmp_path, is_continuous):
    evaluation = race(laps=2, offtrack_penalty=1.0, is_continuous=is_continuous)
    write_simtrace(evaluation, tmp_path, action_space=ACTIONS)
    trace = read_simtrace(tmp_path / "0-iteration.csv")
    rows = np.concatenate([trial.recording.rows for trial in evaluation.trials])
    assert len(trace["steps"]) == len(rows)
    assert sorted(set(trace["episode"].tolist())) == [0, 1, 2, 3]
    assert (trace["episode_status"] == "prepare").sum() == (2 if is_continuous else 4)
    assert trace["done"].sum() == (trace["episode_status"] == "lap_complete").sum() == 4
    steps = np.diff(trace["tstamp"]) * 15
    is_new_trial = np.isin(trace["episode"][1:], [2]) & (trace["steps"][1:] == 1)
    np.testing.assert_allclose(steps, np.where(is_new_trial, 2.0, 1.0), atol=0.03)
    np.testing.assert_allclose(trace["X"][1:], np.where(trace["steps"] == 1, trace["X"], rows[:, 2])[1:])

    stands = trace["episode_status"] == "pause"
    assert stands.sum() == 15 * sum(lap.resets for lap in evaluation.laps()) > 0
    assert (trace["reward"][stands] == 0.0).all()
    driven = ~stands & (trace["episode_status"] != "prepare")
    assert set(trace["reward"][driven].tolist()) <= {1.0, 0.5, 0.1, 0.001}
    degrees = np.array(ACTIONS.to_degrees())[trace["action"]]
    np.testing.assert_allclose(np.stack([trace["steer"], trace["throttle"]], axis=1), degrees)


def test_simtrace_of_a_continuous_policy(tmp_path):
    evaluation = race(Autopilot(), num_trials=1, laps=1)
    action_space = ContinuousActionSpace((-0.5, 0.5), (0.5, 2.0))
    write_simtrace(evaluation, tmp_path, action_space=action_space)
    trace = read_simtrace(tmp_path / "0-iteration.csv")
    steering = np.degrees(evaluation.trials[0].recording.column("steering_angle"))
    np.testing.assert_allclose(trace["steer"][1:], steering[1:])
    np.testing.assert_allclose(trace["action"][:, 0], trace["steer"])
