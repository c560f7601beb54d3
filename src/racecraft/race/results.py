"""What an evaluation found: laps, trials, and their summary with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from racecraft.race.conditions import Conditions
from racecraft.race.recording import Recording
from racecraft.race.rules import RaceRules
from racecraft.race.statistics import Interval, mean_interval, wilson_interval
from racecraft.track.track import Track


@dataclass(frozen=True, kw_only=True)
class Lap:
    """One lap, or the attempt at one."""

    number: int
    """Within its trial, from 1."""
    status: str
    """``lap_complete``, or why it ended without that."""
    start_time: float
    """s on the trial's clock; a flying lap starts when the one before ends."""
    time: float
    """s it took, penalties included: steps times 1/15 s, with the step that prepares a standing start."""
    completion: float
    """Fraction of the lap driven, 0 to 1."""
    off_track_count: int = 0
    """Times the car left the track."""
    crash_count: int = 0
    """Times it hit something."""
    immobilized_count: int = 0
    """Times it was stuck."""
    reversed_count: int = 0
    """Times it drove the wrong way."""
    resets: int = 0
    """Times it was put back on the track; a mistake that ends a trial resets nothing."""
    penalty_seconds: float = 0.0
    """s it stood for that; part of `time`."""

    @property
    def is_complete(self) -> bool:
        """Whether the car crossed the line."""
        return self.status == "lap_complete"

    @property
    def is_clean(self) -> bool:
        """Complete, and without a single mistake."""
        return self.is_complete and self.resets == 0


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One race against the clock, of as many laps as the rules ask for."""

    index: int
    """From 0."""
    laps: tuple[Lap, ...]
    """In order; the last one may be incomplete."""
    status: str
    """How it ended: ``lap_complete``, a mistake with no resets left, ``time_up``; ``in_progress`` if cut."""
    completion: float
    """Fraction of the whole distance driven, 0 to 1."""
    recording: Recording
    """Every step."""

    @property
    def lap_times(self) -> tuple[float, ...]:
        """Times of the completed laps, s."""
        return tuple(lap.time for lap in self.laps if lap.is_complete)

    @property
    def is_finished(self) -> bool:
        """Whether all laps were completed."""
        return self.status == "lap_complete"

    @property
    def time(self) -> float:
        """On the clock at the end, s."""
        return math.fsum(lap.time for lap in self.laps)


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """All trials of an evaluation; times are in seconds, completions are fractions."""

    conditions: Conditions
    """Where and by which rules."""
    trials: tuple[Trial, ...]

    @property
    def track(self) -> Track:
        """As handed in; with direction ``reverse`` it was driven the other way."""
        return self.conditions.track

    @property
    def rules(self) -> RaceRules:
        """Of the race."""
        return self.conditions.rules

    @property
    def seed(self) -> int:
        """Of the starts."""
        return self.conditions.seed

    def laps(self) -> Iterator[Lap]:
        """Every lap that was begun."""
        for trial in self.trials:
            yield from trial.laps

    @property
    def completions(self) -> tuple[float, ...]:
        """Completion of each trial."""
        return tuple(trial.completion for trial in self.trials)

    @property
    def mean_completion(self) -> float:
        """Mean of `completions`."""
        return math.fsum(self.completions) / len(self.trials)

    @property
    def completion_interval(self) -> Interval:
        """95 % confidence interval of the mean completion, over the trials' different starts."""
        return mean_interval(self.completions, low=0.0, high=1.0)

    @property
    def laps_begun(self) -> int:
        """Laps begun."""
        return sum(len(trial.laps) for trial in self.trials)

    @property
    def laps_completed(self) -> int:
        """Laps completed."""
        return sum(lap.is_complete for lap in self.laps())

    @property
    def laps_clean(self) -> int:
        """Laps completed without a reset."""
        return sum(lap.is_clean for lap in self.laps())

    @property
    def clean_lap_rate(self) -> float:
        """Clean laps over laps begun."""
        return self.laps_clean / self.laps_begun

    @property
    def clean_lap_interval(self) -> Interval:
        """95 % confidence interval of the clean lap rate, taking laps as independent."""
        return wilson_interval(self.laps_clean, self.laps_begun)

    @property
    def best_lap(self) -> float | None:
        """Fastest completed lap."""
        return min(self._lap_times(), default=None)

    @property
    def mean_lap(self) -> float | None:
        """Mean of the completed laps."""
        times = self._lap_times()
        return math.fsum(times) / len(times) if times else None

    @property
    def total_time(self) -> float | None:
        """Mean race time of the trials that finished all their laps."""
        times = [trial.time for trial in self.trials if trial.is_finished]
        return math.fsum(times) / len(times) if times else None

    @property
    def best_trial(self) -> Trial:
        """The trial to show: most completed, then fastest."""
        return max(self.trials, key=lambda trial: (trial.completion, -trial.time))

    def summary(self) -> dict[str, Any]:
        """The figures as plain values, for JSON."""
        return {
            "track": self.track.name,
            "seed": self.seed,
            "trials": len(self.trials),
            "mean_completion": self.mean_completion,
            "completion_interval": list(self.completion_interval),
            "laps_begun": self.laps_begun,
            "laps_completed": self.laps_completed,
            "laps_clean": self.laps_clean,
            "clean_lap_rate": self.clean_lap_rate,
            "clean_lap_interval": list(self.clean_lap_interval),
            "best_lap_seconds": self.best_lap,
            "mean_lap_seconds": self.mean_lap,
            "total_seconds": self.total_time,
            "off_track_count": sum(lap.off_track_count for lap in self.laps()),
            "crash_count": sum(lap.crash_count for lap in self.laps()),
            "immobilized_count": sum(lap.immobilized_count for lap in self.laps()),
            "reversed_count": sum(lap.reversed_count for lap in self.laps()),
            "resets": sum(lap.resets for lap in self.laps()),
            "penalty_seconds": math.fsum(lap.penalty_seconds for lap in self.laps()),
        }

    def report(self) -> dict[str, Any]:
        """The figures and the lap times of each trial, without the seed: for who entered a race that is not over."""
        figures = {name: value for name, value in self.summary().items() if name != "seed"}
        return {**figures, "lap_seconds": [list(trial.lap_times) for trial in self.trials]}

    def _lap_times(self) -> list[float]:
        return [time for trial in self.trials for time in trial.lap_times]
