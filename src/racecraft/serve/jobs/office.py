"""Where jobs are handed out: what a supervisor and the processes that do them know of the queue, wherever that is.

`JobQueue` is one over a database, `racecraft.serve.jobs.remote.RemoteOffice` the same one through a console's server.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol

from sqlalchemy.exc import SQLAlchemyError

from racecraft.errors import RunError
from racecraft.serve.store.tables import Job

Slot = Literal["training", "other"]
MAX_CODE: Final = 64
"""Characters of what kind of error ended a job, where a console is told through its server."""
MAX_TOLD: Final = 4000
"""Characters of such an error's message, and of its hint."""


@dataclass(frozen=True)
class Answer:
    """What the owner of a job is told."""

    word: Literal["go on", "rest", "stop", "lost"]
    """``rest`` when others wait for its place; ``stop`` when somebody cancelled it; ``lost`` when another has it."""
    is_watched: bool = False
    """Whether somebody elsewhere wants to see it."""


class OfficeAway(RunError):
    """The console does not answer now."""


AWAY: Final = (SQLAlchemyError, OfficeAway)
"""What the methods of an office raise while nobody answers there: its database is being restarted, say."""


class Office(Protocol):
    """The queue, as who works knows it."""

    def take(
        self, slot: Slot, kinds: tuple[str, ...], *, owner: str, machine: str, places: int, is_home: bool
    ) -> Job | None:
        """The next job for a place of a machine; where all are taken, have somebody rest for who waits.

        Args:
            slot: The kind of place.
            kinds: Of jobs that can be done there.
            owner: The worker that is to do it.
            machine: Where that is.
            places: How many of these places there are.
            is_home: Whether it is the console's own machine, which can do what does not travel.
        """

    def listen(self) -> None:
        """Return as soon as there may be something new for workers, or after some seconds; for one thread."""

    def held(self, owner: str) -> Job | None:
        """The job that a worker has."""

    def heartbeat(self, job_id: str, *, owner: str, has_progressed: bool = False) -> Answer:
        """Keep a job, and hear whether to go on."""

    def finish(
        self,
        job_id: str,
        *,
        owner: str,
        state: str,
        result: Mapping[str, Any] | None = None,
        error: Mapping[str, Any] | None = None,
    ) -> bool:
        """End a job that this owner holds; False when it is another's now."""

    def hand_back(self, owner: str) -> None:
        """Put back what an owner was asked to let go of."""

    def release(self, owner: str, *, has_company: bool = False) -> None:
        """Put back what an owner holds that has ended without a word; `has_company` where all on its machine have."""

    def take_back_expired(self) -> None:
        """Put back what nobody keeps alive."""
