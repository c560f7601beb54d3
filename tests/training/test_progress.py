"""What a training says of itself, as its history keeps it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from racecraft.learn import IterationStats, UpdateStats
from racecraft.learn.ledger import Ended
from racecraft.training import EvaluationReport, IterationReport, TrainResult
from racecraft.training.progress import Lesson, SilentReporter

LOSSES: dict[str, float] = {
    "policy_loss": 0.1,
    "value_loss": 0.2,
    "entropy": 0.3,
    "approx_kl": 0.4,
    "clip_fraction": 0.5,
    "grad_norm": 0.6,
}


def test_an_evaluations_point_has_milliseconds_and_hundredths_of_a_per_cent() -> None:
    report = EvaluationReport(
        step=640, seconds=1.23456, completions=(0.123456, 1.0), lap_times=(9.87654,), is_best=True
    )
    assert report.point() == {
        "step": 640,
        "seconds": 1.235,
        "completions": [0.1235, 1.0],
        "lap_times": [9.877],
        "is_best": True,
    }
    assert (report.completion, report.laps_completed, report.best_lap) == (pytest.approx(0.561728), 1, 9.87654)
    assert replace(report, lap_times=(12.0, 11.0, 13.0)).best_lap == 11.0
    assert replace(report, lap_times=()).best_lap is None


def test_an_iterations_point_by_hand() -> None:
    stats: dict[str, Any] = dict.fromkeys(("environment_seconds", "policy_seconds", "update_seconds"), 1.0)
    report = IterationReport(
        stats=IterationStats(
            iteration=2,
            total_steps=128,
            num_steps=64,
            ended=(Ended(0, 1.0, 20), Ended(1, 2.0, 20), Ended(2, 1.5, 21)),
            losses=UpdateStats(**LOSSES),
            explained_variance=0.7,
            **stats,
        ),
        seconds=2.34567,
        steps_per_second=1234.56,
        episodes=17,
        mean_reward=0.123456,
        completion=0.654321,
        remaining=9.5,
    )
    assert report.point() == {
        "step": 128,
        "seconds": 2.346,
        "pace": 1234.6,
        "episodes": 17,
        "reward": 0.1235,
        "completion": 0.6543,
        "episode_length": 20.33,
        "remaining": 9.5,
        **{name: LOSSES[name] for name in ("policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction")},
        "explained_variance": 0.7,
    }
    lesson = Lesson(steps=4096, needed=12288, steps_per_second=9.0)
    assert replace(report, lesson=lesson).point() == {**report.point(), "lesson": 0.3333}


def test_a_result_has_milliseconds(tmp_path: Path) -> None:
    result = TrainResult(
        run=tmp_path,
        reason="laps",
        wall_seconds=1.23456,
        steps=640,
        laps_completed=2,
        evaluation_trials=3,
        best_lap_seconds=9.87654,
        parts={"learner": 0.98765},
    )
    assert result.to_dict() == {
        "run": str(tmp_path),
        "reason": "laps",
        "wall_seconds": 1.235,
        "steps": 640,
        "laps_completed": 2,
        "evaluation_trials": 3,
        "best_lap_seconds": 9.87654,
        "parts": {"learner": 0.988},
    }


def test_a_reporter_that_shows_nothing_is_what_its_block_is_given() -> None:
    reporter = SilentReporter()
    with reporter as entered:
        assert entered is reporter
