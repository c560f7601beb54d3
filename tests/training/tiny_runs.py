"""What the tests of trainings share: a tiny PPO, a reporter that keeps what it is told, and comparisons of runs."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.learn import PPOConfig
from racecraft.race.policy import NetworkPolicy
from racecraft.run import RunFolder
from racecraft.sim import Simulation
from racecraft.training import EvaluationReport, IterationReport, TrainResult

TINY = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
"""64 steps to an iteration."""

Train = Callable[..., TrainResult]


class Recorder:
    """A reporter that keeps what it is told, and calls back after every iteration."""

    def __init__(self, after_iteration: Callable[[int], None] | None = None) -> None:
        self.notes: list[str] = []
        self.iterations: list[IterationReport] = []
        self.evaluations: list[EvaluationReport] = []
        self._after_iteration = after_iteration

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        self.simulation, self.policy = simulation, policy

    def note(self, text: str) -> None:
        self.notes.append(text)

    def step(self) -> None:
        """Nothing is kept of a step."""

    def iteration(self, report: IterationReport) -> None:
        self.iterations.append(report)
        if self._after_iteration is not None:
            self._after_iteration(report.stats.total_steps)

    def evaluation(self, report: EvaluationReport) -> None:
        self.evaluations.append(report)


def weights(run: Path) -> dict[str, NDArray[Any]]:
    """Everything the last checkpoint holds, network and optimiser and cars."""
    return RunFolder.open(run).checkpoints.load("last").arrays


def assert_same(run: Path, other: Path) -> None:
    """The last checkpoints of two runs are equal to the bit."""
    first, second = weights(run), weights(other)
    assert first.keys() == second.keys()
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name], err_msg=name)


def logs(run: Path) -> dict[str, Any]:
    """Sim-traces and metrics, by file."""
    texts: dict[str, Any] = {path.name: path.read_text() for path in sorted((run / "training-simtrace").iterdir())}
    return {**texts, "metrics": json.loads((run / "metrics" / "TrainingMetrics.json").read_text())}
