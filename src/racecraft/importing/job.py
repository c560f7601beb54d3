"""From AWS's settings of a training job to ours, and what of them has no effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from racecraft.run.training_params import TrainingParams
from racecraft.sim import Start
from racecraft.training import Until

MAX_TRIALS: Final = 100
LAPS: Final = 5
"""Evaluation laps that end the training, or fewer where an evaluation has fewer."""


@dataclass(frozen=True)
class JobSettings:
    """Settings of a training."""

    values: dict[str, Any]
    """Fields of `TrainSettings`."""
    used: dict[str, str]
    """What was given, and what it became."""
    unused: dict[str, str]
    """What was given, and why it has no effect."""


def job_settings(params: TrainingParams, given: Mapping[str, str]) -> JobSettings:
    """Our settings for a job of AWS's; the track apart.

    Args:
        params: The job.
        given: Its fields that were really given, and as what: ``{"reverse_dir": "REVERSE_DIR: true"}``.
    """
    trials = min(params.min_eval_trials, MAX_TRIALS)
    direction = "reverse" if params.reverse_dir else "forward"
    direction = "alternate" if params.alternate_driving_direction else direction
    start = Start(
        mode="advance" if params.change_start_position else "fixed",
        offset=params.start_position_offset,
        advance=params.round_robin_advance_dist,
        spread=params.change_start_position,
    )
    values = {
        "direction": direction,
        "start": start,
        "evaluation_trials": trials,
        "until": Until(laps=min(LAPS, trials)),
    }
    becomes = {
        "reverse_dir": f"direction {direction}",
        "alternate_driving_direction": f"direction {direction}",
        "change_start_position": "starts move on" if params.change_start_position else "every start at one place",
        "round_robin_advance_dist": f"starts move on by {100 * start.advance:g} % of a lap",
        "start_position_offset": f"first start at {100 * start.offset:g} % of the lap",
        "min_eval_trials": f"{trials} evaluation trials",
    }
    unused = {
        "race_type": "nothing else is on the track yet: it trains as a time trial",
        "enable_domain_randomization": "light and colours stay as they are",
        "best_model_metric": "the best checkpoint completes most of the lap, then is the fastest",
    }
    if params.race_type == "TIME_TRIAL":
        becomes["race_type"] = "time trial"
    if not params.enable_domain_randomization:
        becomes["enable_domain_randomization"] = "light and colours stay as they are"
    if params.best_model_metric == "progress":
        becomes["best_model_metric"] = unused["best_model_metric"]
    return JobSettings(
        values=values,
        used={label: becomes[field] for field, label in given.items() if field in becomes},
        unused={label: unused[field] for field, label in given.items() if field in unused and field not in becomes},
    )
