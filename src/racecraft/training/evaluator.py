"""The deterministic evaluations during a training, and which checkpoint is the best.

Every evaluation has the same starts, so that two of them can be compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.evaluation import Completion, completion, trial_simulation
from racecraft.race.policy import NetworkPolicy
from racecraft.race.recording import REFERENCE_AHEAD
from racecraft.race.rules import RULE_SETS
from racecraft.run import Episode, EpisodeCounter
from racecraft.run.evolution import MAX_POSES, Drive, is_kept
from racecraft.sim import CONTROL_DT, Simulation
from racecraft.sim.camera import CAMERAS
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import NO_OBJECTS
from racecraft.track import Track
from racecraft.training.progress import EvaluationReport
from racecraft.training.regimes import regime_of
from racecraft.training.settings import TrainSettings
from racecraft.training.stop import settled

SLOWEST: Final = 0.3  # m/s; an evaluation does not wait for a car that needs longer for its lap
SEED: Final = 0x6576616C  # evaluation starts never coincide with training's
NO_LAP: Final = 1e6  # s, in a score, where no lap was completed
SURE: Final = 15 / 16
"""Mean completion on many roads beyond which an evaluation tells nothing: a lap or two of 48 are luck."""
_POSE: Final = [ROW_COLUMNS.index(name) for name in ("x", "y", "heading")]


class Evaluator:
    """Judges the policy while it learns.

    Args:
        policy: What drives; it sees new weights as soon as they are learned.
        tracks: Where; of many, as many as there are trials, evenly chosen, and every other one reversed where training
            drives both ways.
        settings: Of the run.
    """

    def __init__(self, policy: NetworkPolicy, tracks: Sequence[Track], settings: TrainSettings) -> None:
        self.policy = policy
        self._seed = (settings.seed + SEED) % 2**32
        direction = "reverse" if settings.direction == "reverse" else "forward"
        self._rules = replace(RULE_SETS["first_lap"], direction=direction)
        self._is_of_many = len(tracks) > 1
        self._driven = _evenly(tracks, settings) if self._is_of_many else tracks[:1]
        self._settings = settings
        self._patience = max(track.length for track in self._driven) / SLOWEST
        self._alone: Simulation | None = None  # for looks, made with the first
        self._good = regime_of(objects=settings.objects).good
        self.last: EvaluationReport | None = None
        self.drive: Drive | None = None
        """What the first car drove in the last evaluation or look, where `racecraft.run.evolution` keeps it."""
        self._looked_at = 0
        self._later_is_better = self._is_of_many and settings.algorithm == "distill" and settings.objects == NO_OBJECTS
        self.best_score: tuple[float, ...] | None = None
        self.best_rank: tuple[float, ...] | None = None
        self.most_completion = 0.0
        """Mean fraction of the lap, of the evaluation with most of it."""
        self._counts_laps = settings.objects != NO_OBJECTS
        self.gained_at = 0
        """Camera steps of training behind the first evaluation that was as good as the best."""
        self.best_lap: float | None = None

    @cached_property
    def _trials(self) -> Simulation:
        """Made with the first evaluation, as the first step of training does not wait for it."""
        return self._simulation(self._settings.evaluation_trials)

    @property
    def evaluated_at(self) -> int:
        """Camera steps of training behind the last evaluation."""
        return self.last.step if self.last is not None else 0

    @property
    def score(self) -> tuple[float, ...] | None:
        """How good the last evaluation was, most important first: completion, then a fast lap.

        Among objects, whose places differ from lap to lap, the share of whole laps comes before both: where a lap ended
        is luck, that it did is not. On several tracks a lap of one says nothing of the others, so there it is the mean
        of all laps.
        """
        if self.last is None:
            return None
        laps = self.last.lap_times
        lap = float(np.mean(laps)) if self._is_of_many and laps else self.last.best_lap
        whole = (len(laps) / len(self.last.completions),) if self._counts_laps else ()
        return (*whole, self.last.completion, -(lap or NO_LAP))

    @property
    def rank(self) -> tuple[float, ...] | None:
        """What makes a checkpoint the best: the score, and of equal ones the later.

        A student of many free roads that completes nearly all it is judged on gets faster as its steps get smaller,
        and no less sure than such an evaluation could tell; there, the later one is the best.
        """
        if self.last is not None and self._later_is_better:
            return (min(self.last.completion, SURE),)
        return self.score

    @property
    def was_good(self) -> bool:
        """Whether some evaluation so far completed every lap; among objects, enough of the way."""
        return self.most_completion >= self._good

    @property
    def has_settled(self) -> bool:
        """Whether every lap of some evaluation was complete, and for a good while none has been better."""
        return settled(self.best_score, self.evaluated_at, self.gained_at)

    def evaluate(self, *, step: int, seconds: float, counter: EpisodeCounter) -> list[Episode]:
        """Drive the trials; the outcome is in `last`.

        Args:
            step: Camera steps of training so far.
            seconds: Wall clock since the start.
            counter: Gives the trials their places on the run's simulated clock.

        Returns:
            The trials as episodes, for the metrics.
        """
        outcome = self._drive(self._trials, step)
        lap_times = tuple(outcome.lap_times[np.isfinite(outcome.lap_times)].tolist())
        self.last = EvaluationReport(
            step=step,
            seconds=seconds,
            completions=tuple(outcome.completions.tolist()),
            lap_times=lap_times,
            is_best=False,
        )
        score, rank = self.score, self.rank
        assert score is not None
        assert rank is not None
        if self.best_score is None or score > self.best_score:
            self.best_score, self.gained_at = score, step
        if self.best_rank is None or rank >= self.best_rank:
            self.best_rank = rank
            self.last = replace(self.last, is_best=True)
        self.most_completion = max(self.most_completion, self.last.completion)
        self.best_lap = min((lap for lap in (self.best_lap, *lap_times) if lap is not None), default=None)
        return self._episodes(outcome, counter)

    def look(self, step: int) -> None:
        """See what one car drives, where that is to be kept; it is in `drive`, and judges nothing."""
        self.drive = None
        if self._keeps(step):
            self._alone = self._alone or self._simulation(1)
            self._drive(self._alone, step)

    def _keeps(self, step: int) -> bool:
        return not self._is_of_many and is_kept(step, max(self.evaluated_at, self._looked_at))

    def _drive(self, simulation: Simulation, step: int) -> Completion:
        rows: list[NDArray[np.float64]] = []
        keeps = self._keeps(step)
        outcome = completion(
            self.policy,
            simulation,
            rules=self._rules,
            seed=self._seed,
            sensors=self.policy.sensors,
            max_seconds=self._patience,
            on_row=(lambda row: rows.append(row[_POSE])) if keeps else None,
        )
        self.drive = _lap_of(step, np.array(rows), outcome) if 2 <= len(rows) <= MAX_POSES else None
        self._looked_at = step
        return outcome

    def _simulation(self, num_trials: int) -> Simulation:
        settings, sensors = self._settings, self.policy.sensors
        return trial_simulation(
            self._driven,
            rules=self._rules,
            num_trials=num_trials,
            vehicle=settings.vehicle,
            randomize=settings.randomize,
            objects=settings.objects,
            camera=sensors.camera(CAMERAS[settings.camera]),
            has_lidar=bool(sensors.lidar_name),
            num_threads=settings.num_threads,
        )

    def _episodes(self, outcome: Completion, counter: EpisodeCounter) -> list[Episode]:
        return [
            Episode(
                number=counter.number,
                env=trial,
                steps=round(duration / CONTROL_DT),
                reward=float(outcome.rewards[trial]),
                progress=float(outcome.completions[trial]),
                status=outcome.statuses[trial],
                start_time=counter.place(duration),
                duration=duration,
            )
            for trial, duration in enumerate(self._trials.column("time").tolist())
        ]

    def state(self) -> dict[str, Any]:
        """What a resumed run needs, as JSON."""
        last = None if self.last is None else asdict(self.last)
        return {
            "last": last,
            "best_score": self.best_score,
            "best_rank": self.best_rank,
            "most_completion": self.most_completion,
            "best_lap": self.best_lap,
            "gained_at": self.gained_at,
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Continue from what `state` gave; KeyError or TypeError where it is not that."""
        last, score, lap = state["last"], state["best_score"], state["best_lap"]
        rank = state.get("best_rank", score)
        if last is not None:
            self.last = EvaluationReport.from_dict(last)
        self.best_score = None if score is None else tuple(map(float, score))
        self.best_rank = None if rank is None else tuple(map(float, rank))
        self.best_lap = None if lap is None else float(lap)
        # Runs of earlier versions have less, and go on by the score that they began with.
        self.gained_at = int(state.get("gained_at", 0))
        begun = self.best_score[0] if self.best_score is not None else 0.0
        self.most_completion = float(state.get("most_completion", begun))
        self._counts_laps &= self.best_score is None or len(self.best_score) == 3
        self._later_is_better &= self.best_rank is None or len(self.best_rank) == 1


def _lap_of(step: int, rows: NDArray[np.float64], outcome: Completion) -> Drive:
    """The first car's lap, from x and y [m] of the point that rows speak of and its heading [rad]  (T, 3)."""
    heading, lap_time = rows[:, 2], float(outcome.lap_times[0])
    origins = rows[:, :2] - REFERENCE_AHEAD * np.column_stack([np.cos(heading), np.sin(heading)])
    return Drive(
        step=step,
        lap_time=lap_time if np.isfinite(lap_time) else None,
        completion=float(outcome.completions[0]),
        poses=np.rint(1000.0 * np.column_stack([origins, heading])).astype(np.int64),
    )


def _evenly(tracks: Sequence[Track], settings: TrainSettings) -> list[Track]:
    """A track for each trial, in the direction it is driven in."""
    trials = settings.evaluation_trials
    chosen = [tracks[trial * len(tracks) // trials] for trial in range(trials)]
    if settings.direction != "alternate":
        return chosen
    return [track.reversed() if trial % 2 else track for trial, track in enumerate(chosen)]
