"""What comes behind a request's head: only so much, and not for ever.

A body that a stranger drips byte by byte would keep a connection, and where files arrive a place among the few of
everybody. So it has to come at a least rate, which the slowest line of a school has many times over; only time in which
the server waits for it counts.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Final

from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

from racecraft.serve.people.keys import OUT

LEAST_RATE: Final = 1000.0  # bytes a second
SOON: Final = 0.5
"""s within which a body is there whose sender is not looked at again."""
PAUSE: Final = 30.0
"""s without any of it that are waited for, at the beginning and where it came faster meanwhile."""


def too_large(most: int) -> str:
    """What to say of a request that holds more."""
    return (
        f"A request may have at most {most >> 20} MB." if most >= 1 << 20 else f"It may have at most {most >> 10} kB."
    )


def too_slow(rate: float) -> str:
    """What to say of a request that comes at less."""
    return f"The request came at less than {rate:,.0f} bytes a second, and no more of it is waited for; send it again."


class Body:
    """A request's body as the application asks for it.

    Args:
        receive: What the browser says.
        most: Bytes that it may have.
        is_still_in: Asks whether who sent it would still be let in, once it is there; None for who need not be.
    """

    def __init__(
        self, receive: Receive, most: int, *, is_still_in: Callable[[], Awaitable[bool]] | None = None
    ) -> None:
        self._receive, self._most, self._is_still_in = receive, most, is_still_in
        self._begun = time.monotonic()
        self._taken = 0
        self._patience = PAUSE
        self._is_whole = False
        self.is_given_up = False
        """Whether no more of it is waited for."""

    async def receive(self) -> Message:
        """What comes next.

        Raises:
            HTTPException: It is too large (413), comes too slowly (408), or who sent it was shut out meanwhile (401).
        """
        if self._is_whole:  # whoever is gone is waited for without an end
            return await self._receive()
        begun = time.monotonic()
        try:
            async with asyncio.timeout(self._patience):
                message = await self._receive()
        except TimeoutError:
            self.is_given_up = True
            raise HTTPException(408, too_slow(LEAST_RATE)) from None
        size = len(message.get("body", b""))
        self._taken += size
        if self._taken > self._most:
            raise HTTPException(413, too_large(self._most))
        self._patience = min(PAUSE, self._patience - (time.monotonic() - begun) + size / LEAST_RATE)
        self._is_whole = not message.get("more_body", False)
        took_long = self._taken > 0 and time.monotonic() - self._begun > SOON
        if self._is_whole and took_long and self._is_still_in is not None and not await self._is_still_in():
            raise HTTPException(401, OUT)
        return message
