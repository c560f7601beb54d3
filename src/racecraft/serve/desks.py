"""What is computed while somebody waits for the answer: a few things at a time for each, and room left for all others.

A reward function that is tried, a map of what a network looks at: such requests take a thread each for seconds. Who
waits here has none, so that somebody with forty of them at once delays only their own.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Hashable
from contextlib import asynccontextmanager
from typing import Final
from weakref import WeakValueDictionary

EACH: Final = 2
"""Of one person, or of all who have no account."""
TOGETHER: Final = 16
"""Of everybody; the server's threads are 40."""


class Desks:
    """Where requests that compute take a place; of the server's event loop."""

    def __init__(self) -> None:
        self._all = asyncio.Semaphore(TOGETHER)
        self._each: WeakValueDictionary[Hashable, asyncio.Semaphore] = WeakValueDictionary()

    @asynccontextmanager
    async def place(self, who: Hashable) -> AsyncIterator[None]:
        """To be held while something is computed for somebody."""
        own = self._each.get(who)
        if own is None:
            own = self._each[who] = asyncio.Semaphore(EACH)
        async with own, self._all:  # first among one's own, so that nobody fills what is everybody's by waiting
            yield
