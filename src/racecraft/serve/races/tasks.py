"""The job of a race: a model drives by the race's rules, and its replay is driven again."""

from __future__ import annotations

from typing import Any

from racecraft.race.rules import RaceRules
from racecraft.serve.jobs.task import Task
from racecraft.sim.objects import Objects


def race(task: Task) -> dict[str, Any]:
    """Drive a model's entry in a race by the race's rules, and drive its replay again."""
    from racecraft.judging.evaluation import evaluate_run
    from racecraft.replay.replay import read_replay
    from racecraft.replay.verification import verify

    payload = task.job.payload
    rules = RaceRules.from_dict(payload["rules"])
    outcome = evaluate_run(
        task.folder.path,
        track=payload["track"],
        rules=rules,
        direction=rules.direction,
        num_trials=1,
        checkpoint=payload["checkpoint"],
        vehicle=payload["vehicle"] or None,
        objects=Objects.from_dict(payload["objects"]),
        seed=payload["seed"],
    )
    found = verify(read_replay(outcome.files["replay"]))
    verdict = found.difference.sentence if found.difference is not None else ""
    return {**outcome.to_dict(), "verification": {"is_genuine": found.is_genuine, "verdict": verdict}}
