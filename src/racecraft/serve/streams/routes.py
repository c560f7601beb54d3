"""Live data: one Server-Sent Events stream per tab.

id: <offset>  event: points   points of the curves; Last-Event-ID goes on after them
              event: live     poses and the policy's mind; never repeated, so without an id
              event: eye      what the first car sees, for who asks for it (``?eye=true``), at most four a second
              event: jobs     the model's newest jobs, whenever one changes
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from typing import Final

from fastapi import APIRouter, Header
from sse_starlette import EventSourceResponse, ServerSentEvent

from racecraft.serve.context import Context, InContext

router = APIRouter(prefix="/api/events", tags=["events"])

TICK: Final = 1 / 12  # s between two looks
SLOW: Final = 4  # ticks between two looks at curves and jobs


@router.get("/{name}")
async def follow(
    name: str, context: InContext, offset: int = 0, eye: bool = False, last_event_id: str | None = Header(None)
) -> EventSourceResponse:
    """Follow a model: curves from an offset on, cars while it trains, with `eye` what the first one sees, its jobs."""
    context.garage.folder(name)
    if last_event_id is not None and last_event_id.isascii() and last_event_id.isdigit() and len(last_event_id) < 19:
        offset = int(last_event_id)
    return EventSourceResponse(_stream(context, name, offset, eye=eye), ping=15)


async def _stream(context: Context, name: str, offset: int, *, eye: bool) -> AsyncIterator[ServerSentEvent | bytes]:
    sequence, seen, jobs_seen, tick = -1, -1, "", 0
    while True:  # the response cancels it when the tab is gone
        if tick % SLOW == 0:
            if (points := await context.hub.points(name, after=offset)) is not None:
                offset, event = points
                yield event
            if (jobs := await context.hub.jobs(name)) != jobs_seen:
                jobs_seen = jobs
                yield ServerSentEvent(jobs, event="jobs")
        context.follower.look_at(name, user_id=context.queue.user_id)
        look = context.hub.live(name, after=sequence)
        if look is not None:
            sequence, event = look
            yield event
        if eye and (picture := context.hub.eye(name, after=seen)) is not None:
            seen, event = picture
            yield event
        tick += 1
        # All tabs at the same moments, so that what one of them had made serves the others.
        await asyncio.sleep(TICK - time.monotonic() % TICK)
