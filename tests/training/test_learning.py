"""Does it learn? From camera pixels to laps on the oval; and the control, which must not."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder

from racecraft import evaluate, train
from racecraft.agent import SensorSuite
from racecraft.judging.ladder import rate_models
from racecraft.learn import PPOConfig
from racecraft.run import RunFolder
from racecraft.sim import Bots, Objects
from racecraft.training import Opponents, resume
from racecraft.training.regimes import DUEL

BUDGET = 60_000  # camera steps; about 8,000 are usual


@pytest.mark.costly
def test_a_car_learns_five_of_five_laps_of_the_oval(tmp_path: Path) -> None:
    recorder = Recorder()
    result = train("oval", until=f"5 laps or {BUDGET} steps", seed=1, root=tmp_path, reporter=recorder)
    assert (result.reason, result.laps_completed) == ("laps", 5), [report.completion for report in recorder.evaluations]
    assert result.best_lap_seconds is not None
    assert 4 < result.best_lap_seconds < 25  # 16.8 m at no more than 4 m/s

    raced = evaluate(result.run, laps=1, num_trials=5, video=False)
    assert raced.evaluation.laps_completed == 5
    assert raced.evaluation.best_lap == pytest.approx(result.best_lap_seconds, rel=0.2)


@pytest.mark.slow
def test_without_learning_it_does_not(tmp_path: Path) -> None:
    idle = replace(PPOConfig(), learning_rate=0.0)
    result = train("oval", until="5 laps or 20000 steps", ppo=idle, seed=1, root=tmp_path)
    assert (result.reason, result.laps_completed) == ("steps", 0)


@pytest.mark.slow
def test_a_blind_car_does_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The control of the control: what it learns, it learns from what it sees."""
    read = SensorSuite.read
    monkeypatch.setattr(SensorSuite, "read", lambda sensors, cars: np.zeros_like(read(sensors, cars)))
    result = train("oval", until="5 laps or 30000 steps", seed=1, root=tmp_path)
    assert (result.reason, result.laps_completed) == ("steps", 0)


@pytest.mark.slow
def test_paid_for_lap_time_a_continuous_car_beats_one_that_keeps_to_two_metres_a_second(tmp_path: Path) -> None:
    """A lap of the oval takes 8.4 s at 2 m/s along its middle."""
    until = "7.6 s lap or 120000 steps"
    result = train("oval", reward="lap_time", actions="continuous", until=until, seed=1, root=tmp_path)
    assert result.reason == "lap_time"
    assert result.best_lap_seconds is not None
    assert 4 < result.best_lap_seconds <= 7.6


RACE = {
    "objects": Objects(bots=Bots(count=2, speed=0.6, placement="random")),
    "evaluate_every": 10_000,
    "evaluation_trials": 10,
    "seed": 1,
}


@pytest.mark.slow
def test_a_car_learns_to_pass_bots_with_camera_and_lidar(tmp_path: Path) -> None:
    """With the defaults of a race; 20,000 steps are usual."""
    result = train("oval", until="6 laps or 120000 steps", root=tmp_path, **RACE)
    assert (result.reason, result.laps_completed >= 6) == ("laps", True)


@pytest.mark.slow
def test_without_learning_bots_are_run_into(tmp_path: Path) -> None:
    idle = replace(PPOConfig(), learning_rate=0.0)
    result = train("oval", until="6 laps or 20000 steps", ppo=idle, root=tmp_path, **RACE)
    assert result.reason == "steps"


@pytest.mark.slow
def test_who_races_itself_beats_what_it_was(tmp_path: Path) -> None:
    """Without a teacher, its first seconds; every other race the newer one starts behind.

    Seeds 1 to 3 win 14, 12 and 16 of 20 here; what a whole training reaches stands in docs/log/self-play.md.
    """
    alone: dict[str, Any] = {"opponents": Opponents(), "algorithm": "ppo", "seed": 3, "root": tmp_path}
    run = train("speedway", until="20000 steps", name="duel", **alone).run
    before = shutil.copytree(run, tmp_path / "before")
    resume(run, until="100000 steps")
    ladder = rate_models(
        [f"{run}@last", f"{before}@last"], tracks="speedway", kind="head-to-model", starts=20, seed=3, num_threads=1
    )
    wins = {row.name.split("@")[0]: row.wins for row in ladder.rows}
    assert wins["duel"] >= 15, wins  # against itself it would win 10


@pytest.mark.slow
def test_who_is_taught_to_race_is_fast_before_it_has_raced(tmp_path: Path) -> None:
    """The plain command's first half minute, its teacher's cut short.

    Seeds 1 to 3 lap in 10.5 to 10.7 s; without a teacher in 13 to 15 s.
    """
    assert DUEL.distill is not None
    lessons = replace(DUEL.distill, teacher_steps=350_000)
    run = train("speedway", opponents=Opponents(), distill=lessons, until="50000 steps", seed=2, root=tmp_path).run
    metrics = RunFolder.open(run).checkpoints.load("last").metrics
    assert (metrics["laps"], metrics["completion"]) == (5.0, 1.0)
    assert metrics["best_lap_s"] is not None
    assert metrics["best_lap_s"] < 11.0
