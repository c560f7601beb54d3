"""What jobs do, a function for each kind; see racecraft.serve.kinds. They run in processes of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object
from racecraft.race.policy import NetworkPolicy
from racecraft.run import RunFolder
from racecraft.serve.artifacts import Artifacts
from racecraft.serve.database import Database
from racecraft.serve.live import LiveWriter
from racecraft.serve.tables import Job
from racecraft.sim import Simulation
from racecraft.training import IterationReport, SilentReporter, TrainResult, Until
from racecraft.training.job import Training


@dataclass(frozen=True, kw_only=True)
class Task:
    """A job and what it may use."""

    job: Job
    runs: Path
    """Folder of the runs."""
    database: Database
    artifacts: Artifacts | None
    """Where runs are copied to."""
    on_stop: Callable[[Callable[[], None]], None]
    """Takes what to call when the job is to end early and be saved; without that it is just ended."""

    @property
    def folder(self) -> RunFolder:
        """The run that the job is about."""
        return RunFolder.open(self.runs / self.job.run)


class LiveReporter(SilentReporter):
    """Shows a training's cars to whoever looks."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: LiveWriter | None = None

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Open the window."""
        self._writer = LiveWriter(self._folder, simulation, policy)
        self._writer.look(step=0)

    def iteration(self, report: IterationReport) -> None:
        """Move the cars."""
        if self._writer is not None:
            self._writer.look(step=report.stats.total_steps)


def train(task: Task) -> dict[str, Any]:
    """Train, from the last checkpoint where there is one."""
    until = task.job.payload.get("until")
    folder = task.folder
    training = Training(folder, until=Until.parse(until) if until else None, reporter=LiveReporter(folder.path))
    task.on_stop(training.stop)
    result: TrainResult = training.run()
    return result.to_dict()


def evaluate(task: Task) -> dict[str, Any]:
    """Race a model against the clock, unless this very job did so before its process was killed."""
    from racecraft.judging.evaluation import evaluate_run

    folder = task.folder
    if task.job.attempts > 1 and (done := _evaluated(folder, task.job.id)) is not None:
        return done
    return evaluate_run(folder.path, job=task.job.id, **task.job.payload).to_dict()


def race(task: Task) -> dict[str, Any]:
    """Drive a model's entry in a race."""
    from racecraft.serve import race_tasks

    return race_tasks.race(task.folder, task.job.payload)


def store(task: Task) -> dict[str, Any]:
    """Nothing but what comes after every job: the run is copied to where artifacts are kept."""
    return {"run": str(task.folder.path)}


def _evaluated(folder: RunFolder, job: str) -> dict[str, Any] | None:
    """The summary of an evaluation that a job had finished."""
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True):
        try:
            document = read_json_object(path)
        except ConfigError:
            continue
        if document.get("job") == job:
            return {"run": str(folder.path), **document}
    return None
