"""Trainings of about half a second: few cars, few steps, one thread."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tiny_runs import TINY, Train

from racecraft.training import TrainResult, train


@pytest.fixture
def tiny(tmp_path: Path) -> Train:
    """`train` with everything small; any setting can be given."""

    def run(track: str = "oval", **settings: Any) -> TrainResult:
        if "hyperparameters" not in settings:
            settings.setdefault("ppo", TINY)
        defaults = {
            "until": "512 steps",
            "reward": "centerline",
            "evaluate_every": 128,
            "evaluation_trials": 2,
            "num_threads": 1,
            "root": tmp_path / "runs",
        }
        return train(track, **{**defaults, **settings})

    return run
