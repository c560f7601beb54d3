"""Programs that wait to be let in by somebody's browser.

    program ──begin──▶ a code on its screen ──typed by who is signed in──▶ confirm ──▶ the program takes a token

Kept in memory: who restarts the server has programs begin anew.
"""

from __future__ import annotations

import secrets
import threading
import time
from dataclasses import dataclass
from typing import Final

from racecraft.serve.people.keys import SIGNS, digest_of, plain_code
from racecraft.serve.problems import NotFound, NotLetIn, TooMany

SECONDS: Final = 600
"""How long a program waits: eight of 31 signs, and ten tries of an account meanwhile."""
CODE_LENGTH: Final = 8
MOST: Final = 500  # that wait at the same time


@dataclass
class Waiting:
    """A program that waits."""

    code: str
    until: float
    """By the clock that never goes back."""
    user_id: int | None = None
    """Who let it in."""
    session: str = ""
    """The digest of the session that they did it in."""


class Devices:
    """All programs that wait."""

    def __init__(self) -> None:
        self._waiting: dict[str, Waiting] = {}  # by the digest of what only the program knows
        self._lock = threading.Lock()

    def begin(self) -> tuple[str, str]:
        """A program's secret, and the code that it shows.

        Raises:
            TooMany: Too many wait.
        """
        secret = secrets.token_urlsafe(32)
        code = "".join(secrets.choice(SIGNS) for _ in range(CODE_LENGTH))
        with self._lock:
            self._forget()
            if len(self._waiting) >= MOST:
                raise TooMany("Too many programs wait to be let in.", hint="Try again in ten minutes.")
            self._waiting[digest_of(secret)] = Waiting(code, time.monotonic() + SECONDS)
        return secret, code

    def confirm(self, code: str, user_id: int, *, session: str) -> None:
        """Somebody lets the program in that shows this code, in a session of that digest.

        Raises:
            NotFound: None does.
        """
        typed = plain_code(code)
        with self._lock:
            self._forget()
            found = next((one for one in self._waiting.values() if one.code == typed and one.user_id is None), None)
            if found is None:
                raise NotFound("No program shows this code now.", hint="Codes are good for ten minutes.")
            found.user_id, found.session = user_id, session

    def take(self, secret: str) -> tuple[int, str] | None:
        """Who let a program in, and the digest of the session, once; None while nobody has.

        A session that is over by then lets nobody in: else who was locked out would have a key in hand.

        Raises:
            NotLetIn: It does not wait, or waited too long.
        """
        digest = digest_of(secret)
        with self._lock:
            self._forget()
            found = self._waiting.get(digest)
            if found is None:
                raise NotLetIn("Nobody typed the code in time.", hint="Begin again.")
            if found.user_id is None:
                return None
            del self._waiting[digest]
            return found.user_id, found.session

    def _forget(self) -> None:
        now = time.monotonic()
        self._waiting = {digest: one for digest, one in self._waiting.items() if one.until > now}
