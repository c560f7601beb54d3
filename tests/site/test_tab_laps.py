"""Laps that the page shows again, corner by corner, against what the console says of the same drives."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import digest, in_node

from racecraft.agent import action_space
from racecraft.analysis import TracedLap, pay_laps, read_laps
from racecraft.analysis.corners import passages, sectors_of
from racecraft.analysis.laps import start_place
from racecraft.learn.flat_weights import join_weights
from racecraft.race import Autopilot, Evaluation, RaceRules, evaluate
from racecraft.race.artifacts import write_simtrace
from racecraft.race.policy import load_policy
from racecraft.race.rules import RULE_SETS
from racecraft.replay import Replay, write_replay
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER
from racecraft.serve.evaluations.objects import objects_in
from racecraft.sim import Objects, Obstacles
from racecraft.sim.views import driver_frames
from racecraft.site.javascript import javascript
from racecraft.site.plan import packed, plan, track_file
from racecraft.site.starter import SHOWN, told_starter
from racecraft.track import Track, load_track
from racecraft.training.evaluator import SEED

pytestmark = pytest.mark.slow
TRACKS = ("reinvent_2018", "hairpin", "straight")
REWARD = "racing"
BOXES = Objects(obstacles=Obstacles(count=3, placement="random"))


def traced(evaluation: Evaluation, folder: Path) -> list[TracedLap]:
    write_simtrace(evaluation, folder, action_space=action_space("continuous"))
    return read_laps(folder / "0-iteration.csv")


def same(theirs: dict[str, Any], track: Track, laps: list[TracedLap]) -> None:
    """Whether a report says of laps what the console does."""
    sectors = sectors_of(track)
    assert len(theirs["sectors"]) == len(sectors)
    for told, sector in zip(theirs["sectors"], sectors, strict=True):
        for name in ("number", "start", "end", "apex", "turn"):
            assert told[name] == pytest.approx(getattr(sector, name), abs=1e-9)
    assert [lap["number"] for lap in theirs["laps"]] == [lap.number for lap in laps]
    for told, lap in zip(theirs["laps"], laps, strict=True):
        assert (told["status"], told["is_complete"]) == (lap.status, lap.is_complete)
        assert told["puts"] == list(lap.puts)
        assert told["seconds"] == pytest.approx(lap.seconds, abs=2e-3)
        assert told["penalty_seconds"] == pytest.approx(lap.penalty_seconds)
        assert told["start"] == pytest.approx(start_place(track, lap), abs=1e-6)
        for name, ours in (
            *(("share", lap.share), ("x", lap.points[:, 0]), ("y", lap.points[:, 1])),
            *(("heading", lap.heading), ("throttle", lap.throttle), ("steering", lap.steering_angle)),
        ):
            np.testing.assert_allclose(told[name], ours, atol=1e-6, err_msg=name)
        np.testing.assert_allclose(told["time"], lap.time, atol=2e-3)  # the file's are rounded
        np.testing.assert_allclose(told["speed"], lap.speed, atol=0.1)
        for passed, passage in zip(told["passages"], passages(track, lap, sectors), strict=True):
            assert (passed is None) == (passage is None)
            if passed is not None and passage is not None:
                assert passed["seconds"] == pytest.approx(passage.seconds, abs=4e-3)
                assert passed["entry_speed"] == pytest.approx(passage.entry_speed, abs=0.1)
                assert passed["slowest"] == pytest.approx(passage.slowest, abs=0.1)
                assert passed["exit_speed"] == pytest.approx(passage.exit_speed, abs=0.1)


def test_a_models_laps_are_those_of_the_console(tmp_path: Path) -> None:
    told, policy = plan(), load_policy(RunFolder(FOLDER / SHOWN), num_threads=1)[1]
    weights = join_weights(policy.learner.weights(), policy.learner.spec)
    race = told["races"]["time-trial"]
    cases = [
        {
            **{"what": "watched", "plan": told, "race": race, "objects": race["objects"], "seed": 7},
            **{"policy": {**race["policies"]["continuous"], **told_starter()[0]}, "weights": packed(weights)},
            **{"track": track_file(name), "reward": javascript({"own": load_preset(REWARD)})},
        }
        for name in TRACKS
    ]
    results = in_node("core", cases, tmp_path)["results"]
    for name, theirs in zip(TRACKS, results, strict=True):
        track = load_track(name)
        evaluation = evaluate(policy, track, rules=RULE_SETS["first_lap"], seed=7 + SEED, num_threads=1)
        laps = traced(evaluation, tmp_path / name)
        assert sum(lap.is_complete for lap in laps) == 5
        same(theirs["report"], track, laps)
        for lap in pay_laps(load_preset(REWARD), track, tmp_path / name / "0-iteration.csv"):
            paid = theirs["report"]["laps"][lap.number - 1]["reward"]
            assert [row for row, reward in enumerate(paid) if reward is not None] == lap.rows.tolist()
            np.testing.assert_allclose([paid[row] for row in lap.rows], lap.rewards, atol=1e-3)
        assert theirs["count"] == len(laps[-1].time)
        (pose,) = evaluation.trials[-1].recording.poses[:1]
        assert theirs["first"] == digest(driver_frames(track, [pose]))


def test_a_replays_laps_are_those_of_the_console(tmp_path: Path) -> None:
    rules = RaceRules(laps=2, max_resets=20, direction="reverse")
    told, track = {**plan(), "tracks": ["hairpin"]}, load_track("hairpin")
    driven = {
        "mistakes": evaluate(
            Autopilot(speed=4.0, lateral_acceleration=8.0), track, rules=rules, num_trials=2, sees="state"
        ),
        "boxes": evaluate(
            Autopilot(speed=2.0), track, rules=RaceRules(laps=1), objects=BOXES, num_trials=2, sees="state"
        ),
    }
    cases = []
    for name, evaluation in driven.items():
        file = write_replay(Replay.of(evaluation), tmp_path / f"{name}.replay").read_bytes()
        replay = base64.b64encode(file).decode()
        cases.append({"what": "rewatched", "plan": told, "replay": replay, "track": track_file("hairpin")})
    results = dict(zip(driven, in_node("core", cases, tmp_path)["results"], strict=True))
    for name, evaluation in driven.items():
        laps = traced(evaluation, tmp_path / name)
        way = track.reversed() if name == "mistakes" else track
        same(results[name]["report"], way, laps)
        assert results[name]["report"]["is_reversed"] == (name == "mistakes")
    assert any(lap["puts"] for lap in results["mistakes"]["report"]["laps"])
    rows = [trial.recording.lap(1).rows for trial in driven["boxes"].trials]
    for lap, ours in zip(results["boxes"]["report"]["laps"], map(objects_in, rows), strict=True):
        assert [thing["kind"] for thing in lap["objects"]] == [thing.kind for thing in ours]
        np.testing.assert_allclose([thing["x"] for thing in lap["objects"]], [thing.x for thing in ours], atol=1e-3)
