"""Jobs about models: training one, and copying one to the store."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.errors import RacecraftError
from racecraft.race.policy import NetworkPolicy
from racecraft.serve.jobs.task import Task
from racecraft.serve.live.cars import LiveWriter
from racecraft.sim import Simulation
from racecraft.training import IterationReport, SilentReporter, TrainResult, Until
from racecraft.training.job import Training


class LiveReporter(SilentReporter):
    """Shows a training's cars to whoever looks."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: LiveWriter | None = None
        self._step = 0

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Open the window."""
        self._writer = LiveWriter(self._folder, simulation, policy)
        self._writer.look(step=0)

    def step(self) -> None:
        """Move the cars."""
        if self._writer is not None:
            self._writer.look(step=self._step)

    def iteration(self, report: IterationReport) -> None:
        """Move the cars, also where the training tells of no steps."""
        self._step = report.stats.total_steps
        self.step()

    def __exit__(self, *_: object) -> None:
        """Close the window."""
        if self._writer is not None:
            self._writer.close()


class ConsoleTraining(Training):
    """A training whose errors are shown beside buttons, and whose page shows how it learned."""

    looks_on = True

    def way_on(self, error: RacecraftError) -> str:
        """Nothing: the page has the way on."""
        return ""


def train(task: Task) -> dict[str, Any]:
    """Train, from the last checkpoint where there is one."""
    until = task.job.payload.get("until")
    folder = task.folder
    with LiveReporter(folder.path) as reporter:
        training = ConsoleTraining(folder, until=Until.parse(until) if until else None, reporter=reporter)
        task.on_stop(training.stop)
        result: TrainResult = training.run()
    return result.to_dict()


def film_evolution(task: Task) -> dict[str, Any]:
    """Film how a model learned."""
    from racecraft.judging.evolution import film_evolution as film

    return {"run": str(task.folder.path), "video": film(task.folder.path).name}


def store(task: Task) -> dict[str, Any]:
    """Nothing but what comes after every job: the run is copied to where artifacts are kept."""
    return {"run": str(task.folder.path)}
