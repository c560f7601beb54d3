"""The kinds of jobs, a line each: where they queue, and the function that does them in a process of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

Slot = Literal["training", "other"]


@dataclass(frozen=True, kw_only=True)
class JobKind:
    """What the queue and the supervisor have to know about jobs of a kind."""

    slot: Slot
    """Which of the console's places it takes; `ServeSettings` says how many there are."""
    work: str
    """``module:function``, imported only where it runs; it takes a `Task` and returns the job's result as JSON.

    A job may be started again at any moment, so the function goes on where it was, or finds that all is done.
    """
    progress: str = "{run}/checkpoints/manifest.json"
    """File below the runs folder that changes whenever something is kept for good."""


KINDS: Final[Mapping[str, JobKind]] = {
    "train": JobKind(slot="training", work="racecraft.serve.tasks:train"),
    "tune": JobKind(
        slot="training", work="racecraft.serve.tuning_tasks:tune", progress=".racecraft/tunings/{tuning}/result.json"
    ),
    "evaluate": JobKind(slot="other", work="racecraft.serve.tasks:evaluate"),
    "race": JobKind(slot="other", work="racecraft.serve.tasks:race"),
    "store": JobKind(slot="other", work="racecraft.serve.tasks:store"),
}


def kinds_of(slot: Slot) -> tuple[str, ...]:
    """The kinds that take such a place."""
    return tuple(name for name, kind in KINDS.items() if kind.slot == slot)
