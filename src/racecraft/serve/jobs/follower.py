"""Brings to the console's machine what other machines do: checkpoints, results, and cars while somebody looks."""

from __future__ import annotations

import logging
import threading
import time
from typing import Final

from sqlalchemy.exc import SQLAlchemyError

from racecraft.errors import RunError
from racecraft.serve.jobs.queue import ENDED, JobQueue, folder_of
from racecraft.serve.live.cars import write_live
from racecraft.serve.settings import INCOMING, OWNER, STATE_FOLDER, ServeSettings, runs_of
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.tables import Job

BEAT: Final = 0.25  # s between two looks at cars
BEATS: Final = 4  # between two looks at runs
PATIENCE: Final = 3.0  # s after which nobody looks any more
MAX_ENDED: Final = 10_000
SEEN: Final = 15.0  # s that somebody waits for what another machine made; a store may not answer for minutes
AT_ONCE: Final = 4  # jobs whose results are brought for who waits
_LOG: Final = logging.getLogger("racecraft.serve")


class Follower:
    """One per console, for everybody's jobs; without a store it does nothing.

    Args:
        artifacts: The store, or None.
        settings: Of the console.
        queue: Of jobs.
    """

    def __init__(self, artifacts: Artifacts | None, *, settings: ServeSettings, queue: JobQueue) -> None:
        self._artifacts, self._settings, self._queue = artifacts, settings, queue
        self._looks: dict[tuple[int, str], float] = {}  # by person and run
        self._followed: dict[str, Job] = {}
        self._ended: set[str] = set()  # jobs whose results are here
        self._shown: dict[tuple[int, str], bytes] = {}
        self._bringing: dict[str, float] = {}  # since when, by jobs whose results are on their way
        self._brought = threading.Condition()
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

    def look_at(self, run: str, *, user_id: int = OWNER) -> None:
        """Somebody looks at the cars of a person's run."""
        self._looks[user_id, run] = time.monotonic()

    def see(self, job: Job) -> Job:
        """Before somebody is told that a job has ended: have here what another machine made of it.

        Who asks waits for a moment, and not at all while the store lets others wait: it is told all the same, and
        brought later.
        """
        if self._artifacts is None or not job.travels or job.state not in ENDED or job.id in self._ended:
            return job
        with self._brought:
            until = time.monotonic() + SEEN
            while job.id not in self._bringing and len(self._bringing) >= AT_ONCE and self._waits(until):
                pass
            if job.id not in self._bringing and len(self._bringing) < AT_ONCE and job.id not in self._ended:
                self._bringing[job.id] = time.monotonic()
                # of its own, as neither requests nor the server's end wait for a store
                threading.Thread(target=self._see, args=(self._artifacts, job), name="bring", daemon=True).start()
            while job.id in self._bringing and self._waits(until):
                pass
        return job

    def _waits(self, until: float) -> bool:
        """Wait for something to be brought; False at the end of somebody's patience, or where another's has ended."""
        oldest = min(self._bringing.values()) + SEEN
        left = min(until, oldest) - time.monotonic()
        if left > 0:
            self._brought.wait(left)
        return left > 0

    def _see(self, artifacts: Artifacts, job: Job) -> None:
        try:
            if job.machine != self._settings.machine:
                self._bring(artifacts, job)
            if (folder := folder_of(job)) is not None:  # it is here for good
                artifacts.of(job.user_id).shelf(folder[0]).forget(folder[1])
            if len(self._ended) >= MAX_ENDED:
                self._ended.clear()
            self._ended.add(job.id)
        except (RunError, OSError) as error:
            _LOG.error("%s", error)
        finally:
            with self._brought:
                del self._bringing[job.id]
                self._brought.notify_all()

    def _follow(self, artifacts: Artifacts) -> None:
        """Bring what is new of every job that is being done elsewhere, and once more when that has ended."""
        before = self._followed
        self._followed = {job.id: job for job in self._queue.elsewhere(self._settings.machine)}
        for job in (before | self._followed).values():
            self._bring(artifacts, job)
        for job in self._followed.values():
            if self._is_looked_at(job):
                self._queue.watch(job.id)

    def _look(self, artifacts: Artifacts) -> None:
        """Show the cars of other machines as if they drove here."""
        for job in filter(self._is_looked_at, self._followed.values()):
            live = artifacts.of(job.user_id).shown(job.run)
            if live != self._shown.get((job.user_id, job.run)):
                self._shown[job.user_id, job.run] = live
                write_live(runs_of(self._settings.runs, job.user_id) / job.run, live)

    def _is_looked_at(self, job: Job) -> bool:
        looked = self._looks.get((job.user_id, job.run), float("-inf"))
        return folder_of(job) is None and time.monotonic() - looked < PATIENCE

    def _bring(self, artifacts: Artifacts, job: Job) -> None:
        own, runs = artifacts.of(job.user_id), runs_of(self._settings.runs, job.user_id)
        incoming, folder = runs / STATE_FOLDER / INCOMING, folder_of(job)
        if folder is not None:
            shelf, name = folder
            (runs / STATE_FOLDER / shelf).mkdir(parents=True, exist_ok=True)
            own.shelf(shelf).bring(name, runs / STATE_FOLDER / shelf, incoming=incoming, missing_ok=True)
        elif (runs / job.run / "run.json").is_file():  # else it was removed meanwhile
            own.bring(job.run, runs, incoming=incoming)
