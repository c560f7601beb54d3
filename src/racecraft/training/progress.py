"""What a training run reports while it goes, and to whom."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from racecraft.learn import IterationStats

if TYPE_CHECKING:
    from racecraft.race.policy import NetworkPolicy
    from racecraft.sim import Simulation


@dataclass(frozen=True, kw_only=True)
class EvaluationReport:
    """One deterministic evaluation during training."""

    step: int
    """Camera steps of training behind it."""
    seconds: float
    """Wall clock since the start."""
    completions: tuple[float, ...]
    """Fraction of the lap each trial drove, 0 to 1."""
    lap_times: tuple[float, ...]
    """s, of the trials that completed the lap."""
    is_best: bool
    """No checkpoint before was better, by `Evaluator.rank`."""

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> EvaluationReport:
        """What `dataclasses.asdict` and JSON made of one; KeyError or TypeError where it is not that."""
        tuples = {name: tuple(map(float, document[name])) for name in ("completions", "lap_times")}
        return cls(**{**document, **tuples})

    def point(self) -> dict[str, Any]:
        """For the run's history."""
        return {
            "step": self.step,
            "seconds": round(self.seconds, 3),
            "completions": [round(share, 4) for share in self.completions],
            "lap_times": [round(lap, 3) for lap in self.lap_times],
            "is_best": self.is_best,
        }

    def scalars(self) -> dict[str, float]:
        """For TensorBoard."""
        scalars = {"evaluation/completion": self.completion, "evaluation/laps": float(self.laps_completed)}
        return scalars if self.best_lap is None else {**scalars, "evaluation/best_lap_s": self.best_lap}

    @property
    def completion(self) -> float:
        """Mean fraction of the lap."""
        return sum(self.completions) / len(self.completions)

    @property
    def laps_completed(self) -> int:
        """Trials that drove the whole lap."""
        return len(self.lap_times)

    @property
    def best_lap(self) -> float | None:
        """s, the fastest lap; None when none was completed."""
        return min(self.lap_times, default=None)


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """How far a teacher is, which learns before the first camera step."""

    steps: int
    """It has learned from so far; no camera sees them."""
    needed: int
    """Steps after which its student begins."""
    steps_per_second: float
    """Of the teacher lately; NaN before there are two iterations."""

    @property
    def share(self) -> float:
        """Of what it is to learn, 0 to 1."""
        return min(self.steps / self.needed, 1.0)


@dataclass(frozen=True, kw_only=True)
class IterationReport:
    """One iteration of training."""

    stats: IterationStats
    seconds: float
    """Wall clock since the start."""
    steps_per_second: float
    """Camera steps per second of training lately, everything included."""
    episodes: int
    """Training episodes finished in the run."""
    mean_reward: float
    """Of the last 100 training episodes; NaN before the first."""
    completion: float
    """Mean fraction of a lap in the last 100 training episodes; NaN before the first."""
    remaining: float | None
    """Estimated seconds until a limit of steps or seconds; None when only laps count."""
    lesson: Lesson | None = None
    """Where the iteration was a teacher's; there were no camera steps in it."""

    def point(self) -> dict[str, Any]:
        """For the run's history; NaN is what is not known yet. Only a teacher's has a `lesson`: its share, 0 to 1."""
        losses = self.stats.losses
        lesson = {} if self.lesson is None else {"lesson": round(self.lesson.share, 4)}
        return {
            "step": self.stats.total_steps,
            "seconds": round(self.seconds, 3),
            "pace": round(self.steps_per_second, 1),
            "episodes": self.episodes,
            "reward": round(self.mean_reward, 4),
            "completion": round(self.completion, 4),
            "episode_length": round(self.stats.mean_length, 2),
            "remaining": self.remaining,
            "policy_loss": losses.policy_loss,
            "value_loss": losses.value_loss,
            "entropy": losses.entropy,
            "approx_kl": losses.approx_kl,
            "clip_fraction": losses.clip_fraction,
            "explained_variance": self.stats.explained_variance,
            **lesson,
        }

    def scalars(self) -> dict[str, float]:
        """For TensorBoard; what is not known yet is left out."""
        losses = self.stats.losses
        scalars = {
            "training/reward": self.mean_reward,
            "training/completion": self.completion,
            "training/steps_per_second": self.steps_per_second,
            "training/episode_length": self.stats.mean_length,
            "losses/policy": losses.policy_loss,
            "losses/value": losses.value_loss,
            "losses/entropy": losses.entropy,
            "losses/approx_kl": losses.approx_kl,
            "losses/clip_fraction": losses.clip_fraction,
            "losses/explained_variance": self.stats.explained_variance,
        }
        return {tag: value for tag, value in scalars.items() if math.isfinite(value)}


@dataclass(frozen=True, kw_only=True)
class TrainResult:
    """How a training ended."""

    run: Path
    """The run folder."""
    reason: str
    """``laps``, ``lap_time``, ``seconds``, ``steps``, ``episodes``, ``score`` or ``interrupted``."""
    wall_seconds: float
    """From the start of the process (or call) to the end."""
    steps: int
    """Camera steps of the run."""
    laps_completed: int
    """Trials of the last evaluation that drove the whole lap."""
    evaluation_trials: int
    """Trials of that evaluation."""
    best_lap_seconds: float | None
    """Fastest lap of all evaluations."""
    parts: dict[str, float]
    """Seconds by part: start, simulator, reward, log, policy, learner, evaluation, checkpoint."""

    def to_dict(self) -> dict[str, object]:
        """As JSON."""
        return {
            "run": str(self.run),
            "reason": self.reason,
            "wall_seconds": round(self.wall_seconds, 3),
            "steps": self.steps,
            "laps_completed": self.laps_completed,
            "evaluation_trials": self.evaluation_trials,
            "best_lap_seconds": self.best_lap_seconds,
            "parts": {name: round(seconds, 3) for name, seconds in self.parts.items()},
        }


class Reporter(Protocol):
    """Shows a training to somebody. Calls come from the training's own thread, so they must be quick."""

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Training begins; both may be looked at in the calls that follow, which is how cars are shown live."""

    def note(self, text: str) -> None:
        """Something worth a line."""

    def step(self) -> None:
        """The cars drove a step; not told by a training on a GPU, whose cars nobody sees in between."""

    def iteration(self, report: IterationReport) -> None:
        """An iteration ended."""

    def evaluation(self, report: EvaluationReport) -> None:
        """An evaluation ended."""


class SilentReporter:
    """Shows nothing; a context manager, as the other reporters are."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing."""

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""

    def step(self) -> None:
        """Nothing."""

    def iteration(self, report: IterationReport) -> None:
        """Nothing."""

    def evaluation(self, report: EvaluationReport) -> None:
        """Nothing."""


class NotingReporter(SilentReporter):
    """Shows nothing, but keeps the notes for who says in the end how it went."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, text: str) -> None:
        """Kept, in order."""
        self.notes.append(text)
