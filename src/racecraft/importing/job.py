"""From AWS's settings of a training job to ours, and what of them has no effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from racecraft.run.training_params import TrainingParams
from racecraft.sim import NO_OBJECTS, Start, has_aws_meaning, objects_from_aws
from racecraft.training import Until

MAX_TRIALS: Final = 100
LAPS: Final = 5
"""Evaluation laps that end the training, or fewer where an evaluation has fewer."""
OBJECT_AVOIDANCE: Final = "OBJECT_AVOIDANCE"
HEAD_TO_BOT: Final = "HEAD_TO_BOT"
RACES: Final = {
    "TIME_TRIAL": "time trial",
    OBJECT_AVOIDANCE: "obstacles on the track",
    HEAD_TO_BOT: "bot cars on the track",
}
ELSEWHERE: Final = {
    "OBSTACLE_TYPE": "all boxes look alike",
    "BOT_CAR_PENALTY": "the collision penalty of an evaluation counts",
}
"""Settings of objects that place none."""


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
        given: Its fields that were really given, and as what: ``{"reverse_dir": "REVERSE_DIR: true"}``; those of
            `TrainingParams.extra`, too.

    Raises:
        ConfigError: A setting of obstacles or bot cars has a value that is not allowed.
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
    objects = NO_OBJECTS
    if params.race_type in (OBJECT_AVOIDANCE, HEAD_TO_BOT):
        objects = objects_from_aws({"RACE_TYPE": params.race_type, **params.extra})
    is_random = params.enable_domain_randomization
    values = {
        "direction": direction,
        "objects": objects,
        "randomize": "aws" if is_random else "none",
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
        "race_type": "other models' cars are not on the track while one trains: it trains as a time trial",
        "best_model_metric": "the best checkpoint completes most of the lap, then is the fastest; "
        "among objects the one with most whole laps comes first",
    }
    if params.race_type in RACES:
        becomes["race_type"] = RACES[params.race_type]
    becomes["enable_domain_randomization"] = "lamps of random colours" if is_random else "light and colours stay"
    if params.best_model_metric == "progress":
        becomes["best_model_metric"] = unused["best_model_metric"]
    for name in params.extra:
        if has_aws_meaning(params.race_type, name):
            becomes[name] = "objects on the track"
        else:
            elsewhere = any(has_aws_meaning(race, name) for race in (OBJECT_AVOIDANCE, HEAD_TO_BOT))
            why = f"has no effect in a race of type {params.race_type}; kept" if elsewhere else "is not read here; kept"
            unused[name] = ELSEWHERE.get(name, why)
    return JobSettings(
        values=values,
        used={label: becomes[field] for field, label in given.items() if field in becomes},
        unused={label: unused[field] for field, label in given.items() if field in unused and field not in becomes},
    )
