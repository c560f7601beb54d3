"""What a provider answers: JSON of bounded size, in bounded time, without being led elsewhere."""

from __future__ import annotations

import http.client
import json
import re
import socket
import ssl
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import IO, Any, Final
from urllib.error import HTTPError, URLError

MOST: Final = 1 << 18
"""Bytes of an answer; those of the large providers have a few thousand."""
WAIT: Final = 5.0  # s for each sign of life
ALTOGETHER: Final = 10.0  # s for an answer
ERROR: Final = re.compile(r"[a-z_]{1,40}")


class NoAnswer(Exception):
    """Nothing came back that can be used; why is for the log."""


class Refused(NoAnswer):
    """The provider refused; `error` is its word for it, or empty."""

    def __init__(self, status: int, error: str) -> None:
        super().__init__(f"status {status}, {error or 'without a word'}")
        self.error = error


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: object, **__: object) -> None:
        """Nobody is followed: an address that was checked leads to no other."""


class _Lines(urllib.request.HTTPSHandler, urllib.request.HTTPHandler):
    """Connections that can be cut: who sends a byte now and then would hold them for hours."""

    def __init__(self) -> None:
        super().__init__()
        self._open: list[socket.socket] = []

    def http_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        """Plain."""
        return self.do_open(self._kept(http.client.HTTPConnection), request)

    def https_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        """Encrypted, by a certificate that this machine trusts."""
        return self.do_open(self._kept(http.client.HTTPSConnection), request, context=ssl.create_default_context())

    def cut(self) -> None:
        """End them all, in the middle of whatever comes."""
        for line in self._open:
            with suppress(OSError):  # it has ended
                line.shutdown(socket.SHUT_RDWR)

    def _kept(self, kind: type[http.client.HTTPConnection]) -> Any:
        def made(host: str, **settings: Any) -> http.client.HTTPConnection:
            connection = kind(host, **settings)
            connect = connection.connect

            def connect_and_keep() -> None:
                connect()
                self._open.append(connection.sock)

            connection.connect = connect_and_keep  # type: ignore[method-assign]
            return connection

        return made


def fetch(
    url: str, *, body: str | None = None, headers: dict[str, str] | None = None, is_here: bool = False
) -> dict[str, Any]:
    """Ask a provider.

    Args:
        url: An address that was found safe.
        body: A form to send; None only looks.
        headers: More of them.
        is_here: Whether the provider is on this machine, and no proxy between.

    Raises:
        Refused: It answers that it will not.
        NoAnswer: It does not answer, or something else than a JSON object.
    """
    request = urllib.request.Request(
        url,
        data=None if body is None else body.encode(),
        headers={"Accept": "application/json", "User-Agent": "Racecraft", **(headers or {})},
    )
    lines = _Lines()
    handlers: list[urllib.request.BaseHandler] = [_NoRedirects(), lines]
    if is_here:
        handlers.append(urllib.request.ProxyHandler({}))
    try:
        with _in_time(lines), urllib.request.build_opener(*handlers).open(request, timeout=WAIT) as reply:
            return _object(_read(reply))
    except HTTPError as error:
        with error, _in_time(lines):
            raise Refused(error.code, _word(error)) from error
    except (URLError, OSError, http.client.HTTPException, ValueError) as error:
        raise NoAnswer(f"{url}: {getattr(error, 'reason', None) or error}") from error


@contextmanager
def _in_time(lines: _Lines) -> Iterator[None]:
    clock = threading.Timer(ALTOGETHER, lines.cut)
    clock.start()
    try:
        yield
    finally:
        clock.cancel()


def _read(reply: IO[bytes]) -> bytes:
    data = reply.read(MOST + 1)
    if len(data) > MOST:
        raise NoAnswer(f"more than {MOST >> 10} KB")
    return data


def _object(data: bytes) -> dict[str, Any]:
    try:
        told = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise NoAnswer("no JSON") from error
    if not isinstance(told, dict):
        raise NoAnswer("no JSON object")
    return told


def _word(reply: IO[bytes]) -> str:
    """What it calls the reason, if that can be read."""
    try:
        word = _object(_read(reply)).get("error")
    except (NoAnswer, OSError, http.client.HTTPException):
        return ""
    return word if isinstance(word, str) and ERROR.fullmatch(word) else ""
