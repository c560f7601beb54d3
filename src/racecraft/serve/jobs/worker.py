"""A job from beginning to end: it keeps its lease, works, and says how it ended.

The server may die meanwhile: the job goes on, and the next server finds it running. When the job's own process dies,
its lease runs out and somebody starts it again; a training then continues from its last checkpoint.
"""

from __future__ import annotations

import importlib
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from racecraft.errors import RacecraftError, RunError, printable_lines
from racecraft.moved import move
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.courier import Courier
from racecraft.serve.jobs.office import AWAY, Answer, Office
from racecraft.serve.jobs.outcome import check_outcome
from racecraft.serve.jobs.queue import KINDS, LEASE, function_named
from racecraft.serve.jobs.task import Task
from racecraft.serve.settings import OWNER, runs_of
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job

HEARTBEAT: Final = 1.0  # s
LATE: Final = ("agent.metadata_file", "training.algorithms", "training.evaluator")
"""What a training itself imports late, as who types a command waits for its first step."""


def work(task: Task) -> dict[str, Any]:
    """Do a job.

    Raises:
        RacecraftError: It cannot be done.
    """
    if task.job.kind not in KINDS:
        raise RunError(f"Jobs of kind {task.job.kind!r} are not known here.", hint="Update Racecraft.")
    result: dict[str, Any] = function_named(KINDS[task.job.kind].work)(task)
    is_copied = task.job.user_id == OWNER and not task.job.travels
    if task.artifacts is not None and task.job.run and is_copied:
        try:
            task.artifacts.keep(task.folder)
        except RunError as error:  # what was done is done; the next server copies what is missing
            if task.job.kind == "store":
                raise
            result = {**result, "not_stored": f"{error} {error.hint}".strip()}
    return result


def load() -> None:
    """Import what any job may need."""
    for kind in KINDS.values():
        function_named(kind.work)
    for name in LATE:
        importlib.import_module(f"racecraft.{name}")


class Worker:
    """One job from beginning to end.

    Args:
        office: Where the job is from.
        job: Claimed by `owner`.
        owner: This process, by the name that it was started under.
        runs: Folder of the owner's runs; those of others lie within.
        artifacts: Where runs are copied to.
        database: That of the console, where it can be reached from here.
    """

    def __init__(
        self,
        office: Office,
        job: Job,
        *,
        owner: str,
        runs: Path,
        artifacts: Artifacts | None = None,
        database: Database | None = None,
    ) -> None:
        self._office = office
        self._job, self._owner = job, owner
        self._stops: list[Callable[[], None]] = []
        self._is_cancelled = False  # by the user
        self._leaving = threading.Event()  # the server is going down
        self._telling, self._is_told = threading.Lock(), False  # how it ended
        kind = KINDS.get(job.kind, KINDS["train"])
        home, runs = runs, runs_of(runs, job.user_id)
        self._kept = runs / kind.progress.format(run=job.run, tuning=job.payload.get("tuning", ""))
        self._task = Task(
            job=job, runs=runs, home=home, database=database, artifacts=artifacts, on_stop=self._stops.append
        )
        self._courier: Courier | None = None
        if artifacts is not None and job.travels:
            self._courier = Courier(artifacts, job, runs, kept=self._kept)

    def run(self) -> bool:
        """Do it, and say how it ended; whether this process may do another one."""
        signal.signal(signal.SIGTERM, lambda *_: self._leaving.set())
        try:
            self._do()
        finally:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            self._stops.clear()  # the heart may beat once more, and would keep what they stop to the end of the process
        kind = KINDS.get(self._job.kind)
        return kind is not None and kind.stays and not self._leaving.is_set()

    def _do(self) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which then tells us
        threading.Thread(target=self._keep, name="heartbeat", daemon=True).start()
        try:
            move(self._courier.fetch() if self._courier is not None else {})  # not where another job's were
            result = work(self._task)
            if self._courier is not None:
                self._courier.deliver()
            check_outcome(result)
        except Exception as error:
            described = _described(error)
            self._report(lambda: self._finish("failed", error=described))
            return
        if result.get("reason") == "interrupted" and not self._is_cancelled:
            self._report(lambda: self._office.hand_back(self._owner))  # it continues later
        else:
            self._report(lambda: self._finish("done", result=result))

    def _keep(self) -> None:
        """Keep the lease, and hear of being cancelled."""
        kept, begun = time.monotonic(), self._progress()
        while True:
            with self._telling:
                if self._is_told:
                    return
                try:
                    answer = self._office.heartbeat(
                        self._job.id, owner=self._owner, has_progressed=self._progress() != begun
                    )
                    kept = time.monotonic()
                except AWAY:  # the database is being restarted, say
                    answer = Answer("go on")
            if self._courier is not None:
                self._courier.is_watched = answer.is_watched
            if answer.word == "lost" or time.monotonic() - kept > LEASE.total_seconds():
                os._exit(3)  # it is another's now: touch nothing
            if answer.word == "stop":
                self._is_cancelled = True
            if answer.word in ("stop", "rest") or self._leaving.is_set():
                self._stop()
            self._leaving.wait(HEARTBEAT)
            if self._leaving.is_set():
                time.sleep(0.1)

    def _stop(self) -> None:
        for call in self._stops:
            call()
        if self._stops:
            return
        with self._telling:  # nothing to be saved
            if self._is_told:
                return
            if self._is_cancelled:
                self._finish("cancelled")
            else:
                self._office.hand_back(self._owner)
            os._exit(0)

    def _finish(self, state: str, **outcome: Any) -> None:
        self._office.finish(self._job.id, owner=self._owner, state=state, **outcome)

    def _report(self, tell: Callable[[], None]) -> None:
        """Say how it ended; while the database is away, try again until the lease has run out."""
        while True:
            try:
                with self._telling:
                    tell()
                    self._is_told = True
                return
            except AWAY:
                time.sleep(HEARTBEAT)

    def _progress(self) -> float:
        """Changes whenever something is kept for good, so that the next attempt does not begin at the start."""
        try:
            return self._kept.stat().st_mtime
        except OSError:
            return 0.0


def _described(error: Exception) -> dict[str, Any]:
    is_expected = isinstance(error, RacecraftError | OSError)
    if not is_expected:
        traceback.print_exception(error)
    return {
        "code": type(error).__name__,
        "message": printable_lines(str(error)),  # a file's name may hold what no database keeps
        "hint": printable_lines(getattr(error, "hint", "")) if is_expected else "This is a bug in Racecraft.",
        "line": getattr(error, "line", None),
    }


def do_job(job_id: str, *, owner: str, runs: Path, access: Access) -> bool:
    """Do a job that was claimed by `owner`, if it still is; whether this process may do another one."""
    with access.opened() as (office, database):
        job = office.held(owner)
        if job is None or job.id != job_id:  # it was taken for dead before it was there
            return False
        artifacts = access.artifacts_of(job, owner)
        return Worker(office, job, owner=owner, runs=runs, artifacts=artifacts, database=database).run()
