"""The job of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder
from racecraft.serve.jobs.task import Task
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle


def evaluate(task: Task) -> dict[str, Any]:
    """Race a model against the clock, unless this very job did so before its process was killed."""
    from racecraft.car.evaluation import evaluate_as_car
    from racecraft.judging.evaluation import evaluate_run

    folder = task.folder
    if task.job.attempts > 1 and (done := _evaluated(folder, task.job.id)) is not None:
        return done
    settings = settings_of(task.job.payload)
    judge = evaluate_as_car if settings.pop("as_car", False) else evaluate_run
    return judge(folder.path, job=task.job.id, **settings).to_dict()


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


def settings_of(payload: Mapping[str, Any]) -> dict[str, Any]:
    """What `evaluate_run` is called with; of a job from before there was a choice, less."""
    settings = dict(payload)
    if "vehicle" in payload:
        settings["vehicle"] = Vehicle(**payload["vehicle"])
    if "randomize" in payload:
        settings["randomize"] = Randomization(**payload["randomize"])
    if "objects" in payload:
        settings["objects"] = Objects.from_dict(payload["objects"])
    return settings
