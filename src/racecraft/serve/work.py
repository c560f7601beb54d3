"""A job's process: ``python -m racecraft.serve.work URL JOB OWNER RUNS``.

It keeps its lease, works, and says how it ended.

The server may die meanwhile: the job goes on, and the next server finds it running. When the job's own process dies,
its lease runs out and somebody starts it again; a training then continues from its last checkpoint.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from racecraft.errors import RacecraftError
from racecraft.race.policy import NetworkPolicy
from racecraft.run import RunFolder
from racecraft.serve import race_tasks
from racecraft.serve.database import Database
from racecraft.serve.jobs import JobQueue
from racecraft.serve.live import LiveWriter
from racecraft.serve.tables import Job
from racecraft.sim import Simulation
from racecraft.training import IterationReport, SilentReporter, TrainResult, Until
from racecraft.training.job import Training

HEARTBEAT = 1.0  # s


class LiveReporter(SilentReporter):
    """Shows a training's cars to whoever looks."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: LiveWriter | None = None

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Open the window."""
        self._writer = LiveWriter(self._folder, simulation, policy)
        self._writer.look(step=0)

    def iteration(self, report: IterationReport) -> None:
        """Move the cars."""
        if self._writer is not None:
            self._writer.look(step=report.stats.total_steps)


def work(job: Job, *, runs: Path, on_stop: Callable[[Callable[[], None]], None]) -> dict[str, Any]:
    """Do a job.

    Args:
        job: What to do.
        runs: Folder of the runs.
        on_stop: Is given what to call when the job is to end early.

    Returns:
        Its result, as JSON.

    Raises:
        RacecraftError: It cannot be done.
    """
    folder = RunFolder.open(runs / job.run)
    if job.kind == "train":
        until = job.payload.get("until")
        training = Training(folder, until=Until.parse(until) if until else None, reporter=LiveReporter(folder.path))
        on_stop(training.stop)
        result: TrainResult = training.run()
        return result.to_dict()
    if job.kind == "race":
        return race_tasks.race(folder, job.payload)
    from racecraft.race.run_evaluation import evaluate_run

    return evaluate_run(folder.path, **job.payload).to_dict()


def main(url: str, job_id: str, owner: str, runs: str) -> int:
    """Do one job from beginning to end; the exit status is 0 unless the process itself failed."""
    database = Database(url)
    queue = JobQueue(database)
    job = queue.get(job_id)
    if job is None or job.owner != owner:
        return 0
    stops: list[Callable[[], None]] = []
    asked = threading.Event()

    def stop(*_: object) -> None:
        asked.set()
        for call in stops:
            call()

    def keep() -> None:
        while True:
            answer = queue.heartbeat(job_id, owner=owner)
            if answer == "lost":
                os._exit(3)  # it is another's now: touch nothing
            if answer == "stop" and not asked.is_set():
                if not stops:  # nothing to be saved
                    queue.finish(job_id, owner=owner, state="cancelled")
                    os._exit(0)
                stop()
            time.sleep(HEARTBEAT)

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which then tells us
    threading.Thread(target=keep, name="heartbeat", daemon=True).start()
    try:
        result = work(job, runs=Path(runs), on_stop=stops.append)
        if result.get("reason") == "interrupted" and not asked.is_set():
            queue.release(owner)  # the server is going down: the next one continues
        else:
            queue.finish(job_id, owner=owner, state="done", result=result)
    except Exception as error:
        is_expected = isinstance(error, RacecraftError | OSError)
        if not is_expected:
            traceback.print_exc()
        described = {
            "code": type(error).__name__,
            "message": str(error),
            "hint": getattr(error, "hint", "") if is_expected else "This is a bug in Racecraft.",
            "line": getattr(error, "line", None),
        }
        queue.finish(job_id, owner=owner, state="failed", error=described)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
