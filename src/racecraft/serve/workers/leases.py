"""Jobs that workers have by a token: taken from the same queue, each known by the token and the name of who has it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, Literal

import sqlalchemy as sa

from racecraft.serve.jobs.office import Answer, Slot
from racecraft.serve.jobs.queue import KINDS, JobQueue
from racecraft.serve.people.keys import Keys
from racecraft.serve.problems import Conflict
from racecraft.serve.settings import MAX_MACHINE
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.version import VERSION

_OWNER: Final = re.compile(r"w([0-9]+)-[0-9a-f]{16}")
MARK: Final = "w"
"""What the owners of such jobs begin with, and no others, which are hexadecimal."""


class Leases:
    """Of all tokens.

    Args:
        database: Of the console.
        queue: Its jobs.
    """

    def __init__(self, database: Database, queue: JobQueue) -> None:
        self._database, self._queue = database, queue

    def of(self, token: int, worker: str) -> Lease:
        """What a worker has, or may take."""
        return Lease(self._queue, token=token, worker=worker)

    def end_without_token(self, keys: Keys) -> None:
        """Give to others what was taken by a token that is worth nothing any more."""
        held = sa.select(Job.owner).where(Job.state == "running", Job.owner.startswith(MARK))
        with self._database.transaction() as session:
            found = [match for owner in session.scalars(held) if (match := _OWNER.fullmatch(owner))]
        if not found:
            return
        good = keys.worker_tokens()
        for match in found:
            if int(match[1]) not in good:
                self._queue.hand_back(match[0])


class Lease:
    """What one worker has: at most one job at a time.

    Args:
        queue: Of the console.
        token: Number of the token that the worker showed.
        worker: Its name.
    """

    def __init__(self, queue: JobQueue, *, token: int, worker: str) -> None:
        self._queue, self._token = queue, token
        self._owner = f"{MARK}{token}-{worker}"

    def take(self, slot: Slot, kinds: list[str], *, machine: str, places: int, of_version: str) -> Job | None:
        """The next job that travels; the same again for who did not hear the answer.

        Raises:
            Conflict: The worker is another Racecraft.
        """
        if of_version != VERSION:
            raise Conflict(
                f"The console is Racecraft {VERSION}, this worker is {of_version}.",
                hint="Install the same version of Racecraft on both machines.",
            )
        if (job := self._queue.held(self._owner)) is not None:
            return job
        doable = tuple(name for name, kind in KINDS.items() if name in kinds and kind.travels and kind.slot == slot)
        # machines of one token are told apart by their names, those of two tokens in any case
        mark = f"#{self._token}"
        name = machine[-(MAX_MACHINE - len(mark)) :] + mark
        return self._queue.take(slot, doable, owner=self._owner, machine=name, places=places, is_home=False)

    def held(self) -> Job | None:
        """The job."""
        return self._queue.held(self._owner)

    def required(self) -> Job:
        """The job.

        Raises:
            Conflict: There is none.
        """
        job = self.held()
        if job is None:
            raise _none()
        return job

    @contextmanager
    def holding(self, job: Job) -> Iterator[None]:
        """A block before whose end nobody else gets the job.

        Raises:
            Conflict: Somebody else has it.
        """
        with self._queue.holding(job.id, owner=self._owner) as is_held:
            if not is_held:
                raise _none()
            yield

    def heartbeat(self, job_id: str, *, has_progressed: bool) -> Answer:
        """Keep it, and hear whether to go on."""
        return self._queue.heartbeat(job_id, owner=self._owner, has_progressed=has_progressed)

    def finish(self, job_id: str, state: str, *, result: dict[str, Any] | None, error: dict[str, Any] | None) -> None:
        """End it.

        Raises:
            Conflict: This worker does not have it.
        """
        if not self._queue.finish(job_id, owner=self._owner, state=state, result=result, error=error):
            raise _none()

    def release(self, why: Literal["asked", "died", "all died"]) -> None:
        """Let go of it."""
        if why == "asked":
            self._queue.hand_back(self._owner)
        else:
            self._queue.release(self._owner, has_company=why == "all died")


def _none() -> Conflict:
    return Conflict("This worker does not have this job.")
