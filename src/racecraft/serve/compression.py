"""What is sent small: the scripts of the pages and the API's JSON, where a browser takes it."""

from __future__ import annotations

import asyncio
import functools
import gzip
import re
from pathlib import Path
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LEAST: Final = 1024
"""Bytes of JSON below which a packet less is not worth the work."""
LEVEL: Final = 4
"""Of gzip: a megabyte of curves in some 15 ms, to a tenth more than the best level would."""


def accepts(header: str, coding: str) -> bool:
    """Whether a browser that sent this ``Accept-Encoding`` takes a coding; ``q=0`` refuses it (RFC 9110, 12.5.3)."""
    for part in header.split(","):
        name, _, weight = part.partition(";")
        if name.strip().lower() == coding:
            return weight.strip().lower().removeprefix("q=").rstrip("0") not in ("", ".") or not weight.strip()
    return False


TELLS_SECRETS: Final = re.compile(r"/api/(door|account|invitations|groups)(/.*)?")
"""Replies of these may hold a card, a token or a code beside names that others chose; how long they are when compressed
together tells who listens which of their guesses is in there (BREACH, 2013)."""


@functools.lru_cache(maxsize=64)
def gzipped(path: Path) -> bytes:
    """A file that stays as it is, compressed once.

    Brotli would save another seventh, over https and on this machine alone, and make the wheel a tenth larger.
    """
    return gzip.compress(path.read_bytes(), 9, mtime=0)


class Compressed:
    """An application whose JSON replies are compressed; all others go through as they are, streams above all.

    What may hold a secret is not compressed.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        takes_gzip = accepts(Headers(scope=scope).get("accept-encoding", ""), "gzip")
        takes_gzip = takes_gzip and not TELLS_SECRETS.fullmatch(scope["path"])
        begun: Message | None = None  # held back until its body is known

        async def send_small(message: Message) -> None:
            nonlocal begun
            if message["type"] == "http.response.start" and _is_json(message):
                begun = message
                return
            if begun is not None:
                start, begun = begun, None
                body = message.get("body", b"")
                headers = MutableHeaders(scope=start)
                headers.add_vary_header("Accept-Encoding")
                if takes_gzip and len(body) >= LEAST and not message.get("more_body", False):
                    body = await asyncio.to_thread(gzip.compress, body, LEVEL, mtime=0)
                    headers["Content-Encoding"], headers["Content-Length"] = "gzip", str(len(body))
                    message = {**message, "body": body}
                await send(start)
            await send(message)

        await self._app(scope, receive, send_small)


def _is_json(start: Message) -> bool:
    headers = Headers(raw=start["headers"])
    return headers.get("content-type", "").startswith("application/json") and "content-encoding" not in headers
