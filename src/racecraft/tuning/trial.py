"""One trial: what is ordered, how it is trained and judged, and what comes of it; all of it plain data.

Where it is trained is `racecraft.tuning.seats`' affair, so an order holds everything that judging needs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Self

from racecraft.run import RunFolder
from racecraft.training import EvaluationReport, SilentReporter, TrainResult
from racecraft.training.job import Training

NO_LAP: Final = 1000.0  # s, of a trial that completed no lap
FIRST_JUDGED: Final = 1
"""The evaluation, from 0, at which a trial may first be ended for lagging behind."""


@dataclass(frozen=True, kw_only=True)
class Order:
    """A trial to be made of a run folder."""

    run: str
    """The folder."""
    goal: str
    """``laps`` or ``lap_time``."""
    trial_steps: int
    """Camera steps after which it ends."""
    bars: tuple[float, ...] = ()
    """By evaluation: who is worse by then lags behind and is ended."""
    is_checked: bool = True
    """Whether the reward function has just been checked, and not changed since."""
    num_threads: int = 0
    """Of simulator and learner where the run leaves it open; 0 takes one per core."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> Self:
        """From what `to_dict` gave."""
        return cls(**{**document, "bars": tuple(document["bars"])})


@dataclass(frozen=True, kw_only=True)
class Report:
    """What came of a trial."""

    reason: str
    """``pruned``, or why its training ended, as in `TrainResult`."""
    value: float
    """What the search makes small: camera steps or seconds."""
    marks: tuple[float, ...]
    """One for each evaluation, less is better: how far it came, then the lap time."""
    completion: float
    """Of its best evaluation: mean fraction of the lap."""
    best_lap: float | None
    steps: int
    seconds: float
    """Wall clock it took."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> Self:
        """From what `to_dict` gave."""
        return cls(**{**document, "marks": tuple(document["marks"])})


def run_trial(order: Order, *, on_training: Callable[[Training], None] = lambda _: None) -> Report:
    """Train a trial until its end.

    Args:
        order: What to do.
        on_training: Is given the training before it begins, to be able to stop it.

    Raises:
        RacecraftError: It cannot be trained.
    """
    begun = time.monotonic()
    judge = _Judge(order)
    training = Training(RunFolder.open(Path(order.run)), reporter=judge, is_checked=order.is_checked)
    if training.settings.num_threads == 0:
        training.settings = replace(training.settings, num_threads=order.num_threads)
    judge.training = training
    on_training(training)
    result = training.run()
    return Report(
        reason="pruned" if judge.is_pruned else result.reason,
        value=judge.score(result),
        marks=tuple(judge.marks),
        completion=judge.best,
        best_lap=result.best_lap_seconds,
        steps=result.steps,
        seconds=time.monotonic() - begun,
    )


@dataclass
class _Judge(SilentReporter):
    """Follows a trial's evaluations, and ends it when it lags behind."""

    order: Order
    training: Training | None = None
    is_pruned: bool = False
    best: float = 0.0
    marks: list[float] = field(default_factory=list)

    def evaluation(self, report: EvaluationReport) -> None:
        """Compare the best so far with the median of trials before at the same evaluation."""
        if report.step == 0:  # what all trials begin with
            return
        self.best = max(self.best, report.completion)
        lap = report.best_lap if self.order.goal == "lap_time" and report.best_lap is not None else NO_LAP
        number = len(self.marks)
        self.marks.append(1.0 - report.completion + lap / NO_LAP)
        is_judged = FIRST_JUDGED <= number < len(self.order.bars)
        if self.training is not None and is_judged and min(self.marks) > self.order.bars[number]:
            self.is_pruned = True
            self.training.stop()

    def score(self, result: TrainResult) -> float:
        """The trial's value, less is better: camera steps, or seconds."""
        if self.order.goal == "lap_time":
            if result.best_lap_seconds is not None:
                return result.best_lap_seconds
            return NO_LAP * (2.0 - self.best)
        return float(result.steps) if result.reason == "laps" else self.order.trial_steps * (2.0 - self.best)
