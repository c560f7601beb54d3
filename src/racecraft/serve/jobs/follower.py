"""Brings to the console's machine what other machines do: checkpoints, results, and cars while somebody looks."""

from __future__ import annotations

import logging
import threading
import time
from pathlib import Path
from typing import Final

from sqlalchemy.exc import SQLAlchemyError

from racecraft.errors import RunError
from racecraft.serve.jobs.queue import ENDED, JobQueue
from racecraft.serve.live.cars import write_live
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.tables import Job

BEAT: Final = 0.25  # s between two looks at cars
BEATS: Final = 4  # between two looks at runs
PATIENCE: Final = 3.0  # s after which nobody looks any more
MAX_ENDED: Final = 10_000
_LOG: Final = logging.getLogger("racecraft.serve")


class Follower:
    """One per console; without a store it does nothing.

    Args:
        artifacts: The store, or None.
        settings: Of the console.
        queue: Of jobs.
    """

    def __init__(self, artifacts: Artifacts | None, *, settings: ServeSettings, queue: JobQueue) -> None:
        self._artifacts, self._settings, self._queue = artifacts, settings, queue
        self._looks: dict[str, float] = {}
        self._followed: dict[str, str] = {}  # jobs by run
        self._ended: set[str] = set()  # jobs whose results are here
        self._shown: dict[str, bytes] = {}
        self._is_stopped = threading.Event()

    def run(self) -> None:
        """A thread's work, which `end` ends."""
        if self._artifacts is None:
            return
        beat = 0
        while not self._is_stopped.wait(BEAT):
            try:
                if beat % BEATS == 0:
                    self._follow(self._artifacts)
                self._look(self._artifacts)
            except (RunError, SQLAlchemyError, OSError) as error:
                _LOG.error("Other machines cannot be followed: %s", str(error).splitlines()[0])
                self._is_stopped.wait(BEATS * BEAT)
            beat += 1

    def end(self) -> None:
        """Follow no longer."""
        self._is_stopped.set()

    def look_at(self, run: str) -> None:
        """Somebody looks at the cars of a run."""
        self._looks[run] = time.monotonic()

    def see(self, job: Job) -> Job:
        """Before somebody is told that a job has ended: have here what another machine made of it."""
        is_away = job.travels and job.machine != self._settings.machine and job.state in ENDED
        if self._artifacts is not None and is_away and job.id not in self._ended:
            try:
                self._bring(self._artifacts, job.run)
            except (RunError, OSError) as error:  # it is told all the same, and brought later
                _LOG.error("%s", error)
                return job
            if len(self._ended) >= MAX_ENDED:
                self._ended.clear()
            self._ended.add(job.id)
        return job

    def _follow(self, artifacts: Artifacts) -> None:
        """Bring what is new of every run that is being worked on elsewhere, and once more when that has ended."""
        before = self._followed
        self._followed = {job.run: job.id for job in self._queue.elsewhere(self._settings.machine)}
        for run in {*before, *self._followed}:
            self._bring(artifacts, run)
        for run, job in self._followed.items():
            if self._is_looked_at(run):
                self._queue.watch(job)

    def _look(self, artifacts: Artifacts) -> None:
        """Show the cars of other machines as if they drove here."""
        for run in filter(self._is_looked_at, self._followed):
            live = artifacts.shown(run)
            if live != self._shown.get(run):
                self._shown[run] = live
                write_live(self._settings.runs / run, live)

    def _is_looked_at(self, run: str) -> bool:
        return time.monotonic() - self._looks.get(run, float("-inf")) < PATIENCE

    def _bring(self, artifacts: Artifacts, run: str) -> None:
        if Path(self._settings.runs / run / "run.json").is_file():  # else it was removed meanwhile
            artifacts.bring(run, self._settings.runs, incoming=self._settings.incoming)
