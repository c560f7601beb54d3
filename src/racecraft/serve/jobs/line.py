"""A line to a console's server, for a program that has a token: short questions, and bytes there and back.

It goes to one address and nowhere else: no redirections, no proxy of the environment. Nothing is read that is larger
than it may be.
"""

from __future__ import annotations

import json
import re
import ssl
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from racecraft.errors import ConfigError, RunError
from racecraft.json_file import read_text
from racecraft.serve.jobs.office import OfficeAway
from racecraft.serve.store.objects import Content

PATIENCE: Final = 10.0  # s for a word of the server; a job is given up twice as long after the last one
MOST: Final = 1 << 20  # bytes of an answer
MAX_OBJECT: Final = 1 << 27
"""Bytes of a file that a worker fetches or sends."""
CHUNK: Final = 1 << 18
RESTARTING: Final = (429, 500, 502, 503, 504)
"""Said by a server, or the proxy before it, that will answer again."""
_TOKEN: Final = re.compile(r"[!-~]{1,200}")


class Refused(RunError):
    """The server said no, and would again."""

    def __init__(self, message: str, *, hint: str = "", status: int = 0) -> None:
        super().__init__(message, hint=hint)
        self.status = status


class Line:
    """One per process; any of its threads may use it.

    Args:
        url: ``https://NAME`` or ``http://NAME:PORT``.
        token_file: Its only word is the token; read anew each time, so that it can be replaced.

    Raises:
        ConfigError: The address is none, or there is no token.
    """

    def __init__(self, url: str, token_file: Path) -> None:
        parts = urlsplit(url)
        try:
            self._place = parts.hostname or "", parts.port
        except ValueError:
            self._place = "", None
        if parts.scheme not in ("http", "https") or not self._place[0] or parts.path not in ("", "/") or parts.username:
            raise ConfigError(f"The console's address is {url[:80]!r}; allowed are https://NAME and http://NAME:PORT.")
        self.url, self._token_file = f"{parts.scheme}://{parts.netloc}", token_file
        self._safety = ssl.create_default_context() if parts.scheme == "https" else None
        self._threads = threading.local()
        self._token()

    def ask(self, method: str, path: str, document: Any = None) -> Any:
        """A question and its answer, as JSON.

        Raises:
            OfficeAway: Nobody answers.
            Refused: The answer is no.
        """
        data = b"" if document is None else json.dumps(document).encode()
        reply = self._say(method, path, data, kind="application/json")
        told = self._all_of(reply, MOST)
        try:
            return json.loads(told) if told else None
        except (ValueError, RecursionError) as error:
            raise self._odd("it is no JSON") from error

    def send(self, path: str, data: bytes) -> None:
        """Have bytes there, as `ask`."""
        self._all_of(self._say("PUT", path, data, kind="application/octet-stream"), MOST)

    def fetch(self, path: str) -> Content:
        """Have bytes from there, as `ask`."""
        reply = self._say("GET", path, b"", kind="application/json")
        size = reply.length
        if size is None or size > MAX_OBJECT:
            self._hang_up()
            raise self._odd("a file without a size, or with too much of it")
        return Content(size, self._chunks(reply))

    def _chunks(self, reply: HTTPResponse) -> Iterator[bytes]:
        is_whole = False
        try:
            while chunk := reply.read(CHUNK):
                yield chunk
            is_whole = not reply.length
        except (OSError, HTTPException) as error:
            raise self._away(error) from error
        finally:
            if not is_whole:  # what is left of it would be taken for the next answer
                self._hang_up()

    def _say(self, method: str, path: str, data: bytes, *, kind: str) -> HTTPResponse:
        """An answer of which nothing has been read; a line that had been hung up meanwhile is tried once more."""
        try:
            token = self._token()
        except ConfigError as error:  # it was there, and is being replaced
            raise OfficeAway(str(error)) from error
        headers = {"Authorization": f"Bearer {token}", "Content-Type": kind, "Accept-Encoding": "identity"}
        for is_last in (getattr(self._threads, "line", None) is None, True):
            try:
                connection = self._connection()
                connection.request(method, path, body=data or None, headers=headers)
                reply = connection.getresponse()
                break
            except (OSError, HTTPException) as error:
                self._hang_up()
                if is_last:
                    raise self._away(error) from error
        if reply.status < 300:
            return reply
        raise self._refusal(reply.status, self._all_of(reply, MOST))

    def _all_of(self, reply: HTTPResponse, most: int) -> bytes:
        try:
            told = reply.read(most + 1)
        except (OSError, HTTPException) as error:
            self._hang_up()
            raise self._away(error) from error
        if len(told) > most:
            self._hang_up()
            raise self._odd("it is too long")
        return told

    def _connection(self) -> HTTPConnection:
        """This thread's."""
        found: HTTPConnection | None = getattr(self._threads, "line", None)
        if found is None:
            name, port = self._place
            if self._safety is None:
                found = HTTPConnection(name, port, timeout=PATIENCE)
            else:
                found = HTTPSConnection(name, port, timeout=PATIENCE, context=self._safety)
            self._threads.line = found
        return found

    def _hang_up(self) -> None:
        if (found := getattr(self._threads, "line", None)) is not None:
            found.close()
            self._threads.line = None

    def _token(self) -> str:
        token = read_text(self._token_file, max_bytes=1 << 10, name=f"The token's file {self._token_file}").strip()
        if not _TOKEN.fullmatch(token):
            raise ConfigError(
                f"{self._token_file} holds no token.", hint="It is one word, which begins with rc_, and nothing else."
            )
        return token

    def _refusal(self, status: int, told: bytes) -> RunError:
        try:
            error = json.loads(told)["error"]
            message, hint = str(error["message"])[:500], str(error.get("hint") or "")[:500]
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            message, hint = str(self._odd(f"status {status}")), ""
        return OfficeAway(message, hint=hint) if status in RESTARTING else Refused(message, hint=hint, status=status)

    def _away(self, error: Exception) -> OfficeAway:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        return OfficeAway(f"{self.url} does not answer: {str(reason)[:200].rstrip('.')}.")

    def _odd(self, what: str) -> Refused:
        return Refused(f"{self.url} does not answer as a console does: {what}.")
