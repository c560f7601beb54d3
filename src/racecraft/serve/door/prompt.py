"""Connections on which no request comes, or the rest of one that was answered: a thousand keep nobody out for long."""

from __future__ import annotations

import asyncio
from typing import Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE: Final = 20.0
"""s in which the lines before a request's body have to be there, or the rest of a body whose request was refused; a
proxy's connection that waits is closed before."""


class PromptProtocol(H11Protocol):
    """HTTP as usual, but for requests that do not come."""

    _giving_up: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Somebody is there."""
        super().connection_made(transport)
        self._wait()

    def data_received(self, data: bytes) -> None:
        """They say something."""
        super().data_received(data)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """They are gone."""
        self._wait_no_more()
        super().connection_lost(exc)

    def on_response_complete(self) -> None:
        """They have their answer, and may ask on."""
        super().on_response_complete()
        self._wait()

    def _wait(self) -> None:
        if not self._has_nothing_to_do() or self.transport.is_closing():
            self._wait_no_more()
        elif self._giving_up is None:
            self._giving_up = self.loop.call_later(PATIENCE, self._give_up)

    def _wait_no_more(self) -> None:
        if self._giving_up is not None:
            self._giving_up.cancel()
            self._giving_up = None

    def _give_up(self) -> None:
        self._giving_up = None
        if self._has_nothing_to_do() and not self.transport.is_closing():
            self.transport.close()

    def _has_nothing_to_do(self) -> bool:
        """Whether there is no request, or only the rest of a body that nobody reads: it was answered."""
        is_answered = self.conn.our_state is h11.DONE and self.conn.their_state is h11.SEND_BODY
        return is_answered or self.conn.their_state is h11.IDLE
