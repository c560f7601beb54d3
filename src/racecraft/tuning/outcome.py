"""What a search found: its trials, the best one, and what mattered."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.tuning.space import Parameter


@dataclass(frozen=True, kw_only=True)
class TrialOutcome:
    """One trial."""

    number: int
    state: str
    """``running``, ``complete``, ``pruned`` (it lagged behind), ``out of time`` or ``fail``."""
    value: float | None
    """What the search makes small: camera steps or seconds; None where it did not come to that."""
    params: dict[str, float]
    """The numbers it was given."""
    run: str
    """Its run folder."""
    completion: float | None
    """Of its best evaluation: mean fraction of the lap."""
    best_lap_seconds: float | None
    steps: int | None
    """Camera steps it was trained."""
    seconds: float | None
    """Wall clock it took; None where it failed or was killed."""
    error: str
    """Why it failed, in one sentence."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Everything found so far."""

    folder: Path
    goal: str
    """``laps`` or ``lap_time``."""
    space: tuple[Parameter, ...]
    trials: tuple[TrialOutcome, ...]
    """In the order they began; the first one is what the user had."""
    importances: dict[str, float]
    """How much each number mattered, the most important first, adding up to 1; empty with too few trials."""
    is_interrupted: bool

    @property
    def best(self) -> TrialOutcome | None:
        """The best trial."""
        done = [trial for trial in self.trials if trial.state == "complete" and trial.value is not None]
        return min(done, key=lambda trial: (trial.value, trial.number), default=None)

    @property
    def baseline(self) -> TrialOutcome | None:
        """The completed trial with the numbers the user had, where there is one."""
        defaults = {parameter.name: parameter.default for parameter in self.space}
        same = [trial for trial in self.trials if trial.params == defaults and trial.value is not None]
        return same[0] if same else None

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        best, baseline = self.best, self.baseline
        return {
            "folder": str(self.folder),
            "goal": self.goal,
            "best": None if best is None else asdict(best),
            "baseline": None if baseline is None else asdict(baseline),
            "importances": self.importances,
            "space": [parameter.to_dict() for parameter in self.space],
            "trials": [asdict(trial) for trial in self.trials],
            "interrupted": self.is_interrupted,
        }
