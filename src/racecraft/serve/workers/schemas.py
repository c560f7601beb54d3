"""What a worker and the server tell each other."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from racecraft.serve.jobs.office import MAX_CODE, MAX_TOLD, Slot
from racecraft.serve.schemas import Message
from racecraft.serve.settings import MAX_MACHINE

Text = Annotated[str, Field(max_length=MAX_TOLD)]


class Welcome(Message):
    """What a worker has to know before it begins."""

    version: str


class News(Message):
    """Whether there is something new in the queue."""

    number: int
    """Another one than before where there is."""


class Take(Message):
    """A place is free, or all are taken."""

    slot: Slot
    kinds: list[Annotated[str, Field(max_length=16)]] = Field(max_length=32)
    """Of jobs that can be done there."""
    machine: str = Field(min_length=1, max_length=MAX_MACHINE, pattern=r"^[ -~]+$")
    places: int = Field(ge=1, le=64)
    version: str = Field(max_length=64)


class Lease(Message):
    """A job that a worker has."""

    id: str
    kind: str
    run: str
    user_id: int
    payload: dict[str, Any]
    cargo: dict[str, Any]
    travels: bool
    attempts: int


class Beat(Message):
    """A worker keeps its job."""

    job: str = Field(max_length=32)
    has_progressed: bool = False


class BeatAnswer(Message):
    """Whether to go on."""

    word: Literal["go on", "rest", "stop", "lost"]
    is_watched: bool


class JobError(Message):
    """Why a job failed."""

    code: str = Field(max_length=MAX_CODE)
    message: Text
    hint: Text = ""
    line: int | None = None


class End(Message):
    """How a job ended."""

    job: str = Field(max_length=32)
    state: Literal["done", "failed", "cancelled"]
    result: dict[str, Any] | None = None
    error: JobError | None = None


class Release(Message):
    """A job is let go of: asked to, or because what did it has died, alone or with all else there."""

    why: Literal["asked", "died", "all died"]
