"""Live data: one Server-Sent Events stream per tab.

id: <offset>  event: points   points of the curves; Last-Event-ID goes on after them
              event: live     poses, the policy's mind and what it sees; never repeated, so without an id
              event: jobs     the model's newest jobs, whenever one changes
"""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import AsyncIterator
from typing import Any, Final

from fastapi import APIRouter, Header, Request
from sse_starlette import EventSourceResponse, ServerSentEvent

from racecraft.run.history import read_history
from racecraft.serve.context import Context, InContext
from racecraft.serve.live import LiveReader, Look
from racecraft.serve.routes.jobs import job_info

router = APIRouter(prefix="/api/events", tags=["events"])

TICK: Final = 1 / 15  # s between two looks
SLOW: Final = 5  # ticks between two looks at curves and jobs


@router.get("/{name}")
async def follow(
    name: str, request: Request, context: InContext, offset: int = 0, last_event_id: str | None = Header(None)
) -> EventSourceResponse:
    """Follow a model: curves from an offset on, cars while it trains, its jobs."""
    context.garage.folder(name)
    if last_event_id is not None and last_event_id.isdigit():
        offset = int(last_event_id)
    return EventSourceResponse(_stream(context, name, offset, request), ping=15)


async def _stream(context: Context, name: str, offset: int, request: Request) -> AsyncIterator[ServerSentEvent]:
    folder = context.garage.runs / name
    reader, sequence, jobs_seen, tick = LiveReader(folder), -1, "", 0
    while not await request.is_disconnected():
        if tick % SLOW == 0:
            points, end = await asyncio.to_thread(read_history, folder / "metrics" / "history.jsonl", offset=offset)
            if points:
                offset = end
                yield ServerSentEvent(json.dumps(points), event="points", id=str(end))
            jobs = await asyncio.to_thread(_jobs, context, name)
            if jobs != jobs_seen:
                jobs_seen = jobs
                yield ServerSentEvent(jobs, event="jobs")
        look = reader.look(after=sequence)
        if look is not None:
            sequence = look.sequence
            yield ServerSentEvent(json.dumps(_live(look)), event="live")
        tick += 1
        await asyncio.sleep(TICK)


def _jobs(context: Context, name: str) -> str:
    listed = context.queue.list(run=name, limit=5)
    return json.dumps([job_info(job).model_dump(mode="json") for job in listed])


def _live(look: Look) -> dict[str, Any]:
    """Millimetres and milliradians as whole numbers: a third of the bytes."""
    poses = (look.poses * 1000).round().astype(int)
    return {
        "step": look.step,
        "poses": poses.tolist(),
        "steps": look.steps.tolist(),
        "policy": look.policy.round(4).tolist(),
        "is_discrete": look.is_discrete,
        "frame": base64.b64encode(look.frame.tobytes()).decode(),
        "frame_shape": list(look.frame.shape),
    }
