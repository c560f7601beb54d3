"""How a worker far away hears of a new job: at once, and of one that came between two questions, too."""

from __future__ import annotations

import asyncio
import time

from racecraft.serve.jobs.news import News

SOON = 30.0  # s; without a word it would be sixty


def test_who_waits_hears_at_once_and_nobody_waits_for_ever() -> None:
    async def tried() -> None:
        news = News()
        number = await news.later_than(-1, seconds=60)
        waiting = [asyncio.create_task(news.later_than(number, seconds=60)) for _ in range(3)]
        await asyncio.sleep(0)
        began = time.monotonic()
        news.tell()
        assert await asyncio.gather(*waiting) == [number + 1] * 3
        assert time.monotonic() - began < SOON

        news.tell()  # between two questions of a worker
        assert await asyncio.wait_for(news.later_than(number + 1, seconds=60), SOON) == number + 2
        assert await news.later_than(number + 2, seconds=0.01) == number + 2
        gone = asyncio.create_task(news.later_than(number + 2, seconds=60))
        await asyncio.sleep(0)
        gone.cancel()
        await asyncio.gather(gone, return_exceptions=True)
        assert not news._waiting, "who hung up is not kept"

        last = asyncio.create_task(news.later_than(number + 2, seconds=60))
        await asyncio.sleep(0)
        news.end()
        assert await asyncio.wait_for(last, SOON) == number + 3
        assert await asyncio.wait_for(news.later_than(number + 3, seconds=60), SOON) == number + 3, "the server stops"

    asyncio.run(tried())
