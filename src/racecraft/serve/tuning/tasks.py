"""The job of a search: trials, until its time is up."""

from __future__ import annotations

from typing import Any

from racecraft.serve.jobs.task import Task
from racecraft.serve.settings import OWNER, STATE_FOLDER, TUNINGS


def tune(task: Task) -> dict[str, Any]:
    """Search until the time is up, also over several processes that were killed one after another.

    Raises:
        RacecraftError: The search cannot be made.
    """
    from racecraft.tuning import Tuning

    payload = task.job.payload
    folder = task.runs / STATE_FOLDER / TUNINGS / payload["tuning"]
    # the folder may come from another machine, which is not believed whose reward function it is
    tuning = Tuning(folder, foreign=task.job.user_id != OWNER, parents=task.runs)
    task.on_stop(tuning.stop)
    past = [trial for trial in tuning.past() if trial.state in ("complete", "pruned", "fail")]
    minutes = payload["minutes"] - tuning.seconds() / 60.0
    left = payload["trials"] - len(past)
    if minutes <= 0 or (payload["trials"] and left <= 0):
        return {"reason": "done", "trials": len(past)}
    outcome = tuning.run(minutes=minutes, max_trials=left if payload["trials"] else 0, processes=0)
    return {"reason": "interrupted" if outcome.is_interrupted else "done", "trials": len(outcome.trials)}
