"""That there is something new in the queue, for whoever waits far away: a number that grows.

worker ──after 7──▶ server ... a job is added ... ──8──▶ worker, which asks for a job at once
"""

from __future__ import annotations

import asyncio
import secrets
from contextlib import suppress


class News:
    """Of one server; any thread may tell some, its loop's tasks wait."""

    def __init__(self) -> None:
        self._number = secrets.randbelow(1 << 30)  # so that what one server said is not taken for another's
        self._waiting: set[asyncio.Event] = set()
        self._is_over = False

    def tell(self) -> None:
        """There is something new; in the loop's thread."""
        self._number += 1
        for event in self._waiting:
            event.set()

    def end(self) -> None:
        """The server stops: nobody waits any longer, so that it need not wait for them."""
        self._is_over = True
        self.tell()

    async def later_than(self, number: int, *, seconds: float) -> int:
        """The newest number, once it is another one, or after so long."""
        if number == self._number and not self._is_over:
            event = asyncio.Event()
            self._waiting.add(event)
            try:
                with suppress(TimeoutError):
                    await asyncio.wait_for(event.wait(), seconds)
            finally:
                self._waiting.discard(event)
        return self._number
