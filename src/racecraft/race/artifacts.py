"""An evaluation in AWS's files: EvaluationMetrics and sim-trace, as if one car had driven trial after trial.

AWS calls every lap a trial and an episode; so do these files.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace, DiscreteActionSpace
from racecraft.race.results import Evaluation, Lap, Trial
from racecraft.run.aws_log import AwsLog
from racecraft.run.episodes import Episode
from racecraft.run.metrics import STATUS_LABELS, write_evaluation_metrics
from racecraft.run.metrics import Trial as MetricsTrial
from racecraft.run.simtrace import SimTraceWriter
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.simulation import CONTROL_DT

_STEERING, _SPEED = ROW_COLUMNS.index("steering_angle"), ROW_COLUMNS.index("speed")
_TIME = ROW_COLUMNS.index("time")


def metrics_of(evaluation: Evaluation) -> list[MetricsTrial]:
    """One entry for every lap, in the order driven, with times in ms on one clock."""
    entries: list[MetricsTrial] = []
    for trial, began in _on_one_clock(evaluation):
        for lap in trial.laps:
            start = began + lap.start_time
            entries.append(_entry(lap, number=len(entries) + 1, start=start, end=start + lap.time))
    return entries


def write_metrics(evaluation: Evaluation, path: Path) -> None:
    """Write ``EvaluationMetrics-*.json``.

    Raises:
        RunError: The file cannot be written.
    """
    write_evaluation_metrics(path, metrics_of(evaluation))


def write_simtrace(
    evaluation: Evaluation, folder: Path, *, action_space: ActionSpace, log: AwsLog | None = None
) -> None:
    """Write ``0-iteration.csv`` with every step; rewards are AWS's default ones, 0 while a car stands.

    Args:
        evaluation: What to write.
        folder: Where to, usually ``evaluation-<time>/evaluation-simtrace``.
        action_space: That of the policy, to number its actions.
        log: Is told every step, too.

    Raises:
        RunError: The file cannot be written.
    """
    writer = SimTraceWriter(
        folder,
        num_envs=1,
        tracks=[evaluation.track],
        action_space=action_space,
        episodes_per_iteration=0,
        log=log,
    )
    number = 0
    for trial, began in _on_one_clock(evaluation):
        for lap in trial.laps:
            recording = trial.recording.lap(lap.number)
            is_driven = recording.column("status") != STATUS_NAMES.index("prepare")  # the writer adds that row
            rows, clock = recording.rows[is_driven], recording.clock[is_driven]
            actions = _actions(rows, action_space)
            rewards = recording.rewards[is_driven]
            episode = Episode(
                number=number,
                env=0,
                steps=len(recording),
                reward=float(rewards.sum()),
                progress=lap.completion,
                status=lap.status,
                start_time=began + float(clock[0] - rows[0, _TIME]),  # of the time that the rows have
                duration=lap.time,
            )
            number += 1
            last = len(rows) - 1
            for step in range(len(rows)):
                now = slice(step, step + 1)
                ended = [episode] if step == last else []
                writer.write(rows[now], actions=actions[now], rewards=rewards[now], ended=ended)
    writer.close()


def _on_one_clock(evaluation: Evaluation) -> Iterator[tuple[Trial, float]]:
    """Every trial, and when it begins if each begins a step after the one before ended, s."""
    began = 0.0
    for trial in evaluation.trials:
        yield trial, began
        began += trial.time + CONTROL_DT


def _entry(lap: Lap, *, number: int, start: float, end: float) -> MetricsTrial:
    return MetricsTrial(
        completion_percentage=int(100 * lap.completion + 1e-9),  # rounded down; forgives the last bit of a full lap
        metric_time=round(1000 * end),
        start_time=round(1000 * start),
        elapsed_time_in_milliseconds=round(1000 * end) - round(1000 * start),
        episode_status=STATUS_LABELS[lap.status],
        crash_count=lap.crash_count,
        immobilized_count=lap.immobilized_count,
        off_track_count=lap.off_track_count,
        reversed_count=lap.reversed_count,
        reset_count=lap.off_track_count + lap.crash_count + lap.immobilized_count + lap.reversed_count,
        trial=number,
    )


def _actions(rows: NDArray[np.float64], action_space: ActionSpace) -> NDArray[Any]:
    """The actions behind the commands of some rows: indices (T,), or nothing to say (T, 2)."""
    if not isinstance(action_space, DiscreteActionSpace):
        return np.zeros((len(rows), 2))
    table = action_space.to_commands(np.arange(len(action_space.table)))
    # commands come back as they were sent, so the nearest is the very one; angles and speeds are of like size
    distance = np.abs(rows[:, None, [_STEERING, _SPEED]] - table).sum(axis=2)
    return np.asarray(distance.argmin(axis=1))
