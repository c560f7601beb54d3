"""What all tabs that look at a model are sent, made once for all of them: twenty viewers cost little more than one."""

from __future__ import annotations

import asyncio
import base64
import json
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sse_starlette import ServerSentEvent

from racecraft.run.history import read_history
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.schemas import job_info
from racecraft.serve.live.cars import LiveReader, Look
from racecraft.serve.store.tables import Job
from racecraft.sim.objects import OBJECT_KINDS

FRESH: Final = 0.3  # s that a look at the jobs is good for
MAX_MODELS: Final = 64  # that are remembered
GLANCE: Final = 1 / 24  # s that a look at the cars is good for: half a tick of a stream
BLINK: Final = 0.24  # s between two pictures: every third tick of a stream
MAX_SHARED: Final = 1 << 16  # bytes of points that are kept for the next tab; a new one reads all there are by itself


@dataclass
class _Seen:
    """What is known of one model."""

    reader: LiveReader
    sequence: int = -1
    is_live: bool = False
    live_until: float = 0.0
    live: bytes = b""
    look: Look | None = None
    """The moment that `live` shows."""
    eye: tuple[int, bytes] = (-1, b"")
    """The newest picture as an event, and the number of its moment."""
    eye_until: float = 0.0
    points: dict[int, tuple[int, bytes]] = field(default_factory=dict)
    """The newest points as an event, and their end, by where they begin."""
    points_until: float = 0.0
    points_lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    jobs: str = ""
    jobs_until: float = 0.0
    jobs_lock: asyncio.Lock = field(default_factory=asyncio.Lock)


class Hub:
    """The newest events of each model; used from the event loop only.

    Args:
        runs: Folder of the runs.
        queue: Of jobs.
        see: Is given each job before tabs hear of it.
    """

    def __init__(self, runs: Path, queue: JobQueue, *, see: Callable[[Job], Job] = lambda job: job) -> None:
        self._runs, self._queue, self._see = runs, queue, see
        self._seen: OrderedDict[str, _Seen] = OrderedDict()

    def live(self, name: str, *, after: int) -> tuple[int, bytes] | None:
        """The cars as they are now, as an event, and its number; None when there is nothing after number `after`."""
        seen = self._of(name)
        if time.monotonic() >= seen.live_until:
            look, seen.is_live = seen.reader.look(after=seen.sequence), seen.reader.is_live
            seen.live_until = time.monotonic() + GLANCE
        else:
            look = None
        if look is not None:
            event = ServerSentEvent(json.dumps(_document(look), separators=(",", ":")), event="live")
            seen.sequence, seen.live, seen.look = look.sequence, event.encode(), look
        return (seen.sequence, seen.live) if seen.sequence not in (-1, after) and seen.is_live else None

    def eye(self, name: str, *, after: int) -> tuple[int, bytes] | None:
        """What the first car saw at the newest moment that `live` gave, and its number; pictures are made now and then.

        None when there is nothing but the one with number `after`.
        """
        seen = self._of(name)
        if seen.look is not None and seen.eye[0] != seen.sequence and time.monotonic() >= seen.eye_until:
            event = ServerSentEvent(json.dumps(_picture(seen.look), separators=(",", ":")), event="eye")
            seen.eye, seen.eye_until = (seen.sequence, event.encode()), time.monotonic() + BLINK
        return seen.eye if seen.eye[0] not in (-1, after) and seen.is_live else None

    async def points(self, name: str, *, after: int) -> tuple[int, bytes] | None:
        """The points of the curves behind an offset, as an event, and where they end; None when there are none."""
        seen = self._of(name)
        async with seen.points_lock:
            if time.monotonic() >= seen.points_until:
                seen.points.clear()
                seen.points_until = time.monotonic() + FRESH / 2
            found = seen.points.get(after)
            if found is None:
                found = await asyncio.to_thread(self._points, name, after)
            if len(found[1]) <= MAX_SHARED:
                seen.points[after] = found
        return found if found[1] else None

    def _points(self, name: str, after: int) -> tuple[int, bytes]:
        points, end = read_history(self._runs / name / "metrics" / "history.jsonl", offset=after)
        if not points:
            return after, b""
        return end, ServerSentEvent(json.dumps(points), event="points", id=str(end)).encode()

    async def jobs(self, name: str) -> str:
        """A model's newest jobs, as JSON, at most `FRESH` seconds old."""
        seen = self._of(name)
        async with seen.jobs_lock:
            if time.monotonic() >= seen.jobs_until:
                seen.jobs = await asyncio.to_thread(self._jobs, name)
                seen.jobs_until = time.monotonic() + FRESH
        return seen.jobs

    def _jobs(self, name: str) -> str:
        listed = [self._see(job) for job in self._queue.list(run=name, limit=5)]
        infos = [job_info(job, behind=self._queue.before(job)) for job in listed]
        return json.dumps([info.model_dump(mode="json") for info in infos])

    def _of(self, name: str) -> _Seen:
        if name not in self._seen:
            self._seen[name] = _Seen(LiveReader(self._runs / name))
            if len(self._seen) > MAX_MODELS:
                self._seen.popitem(last=False)
        self._seen.move_to_end(name)
        return self._seen[name]


def _document(look: Look) -> dict[str, Any]:
    """Millimetres and milliradians as whole numbers: a third of the bytes."""
    poses = (look.poses * 1000).round().astype(int)
    return {
        "step": look.step,
        "poses": poses.tolist(),
        "steps": look.steps.tolist(),
        "objects": _objects(look),
        "policy": look.policy.round(4).tolist(),
        "is_discrete": look.is_discrete,
    }


def _picture(look: Look) -> dict[str, Any]:
    """Ten times the bytes of all poses: for those alone who show it."""
    return {"frame": base64.b64encode(look.frame.tobytes()).decode(), "frame_shape": list(look.frame.shape)}


def _objects(look: Look) -> list[list[int | str]]:
    """Name of its kind, and place, of what is on the road; cars that have left the race are not."""
    return [
        [OBJECT_KINDS[int(kind)], *(round(1000 * float(value)) for value in place)]
        for kind, *place in look.objects
        if OBJECT_KINDS[int(kind)] != "gone_racer"
    ]
