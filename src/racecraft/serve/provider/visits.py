"""Sign-ins that are under way at the provider, and newcomers who choose a name.

    begin ──▶ a visit: a state for the address, a secret for the browser ──the way back──▶ take, once, by that browser
    somebody whom nobody knows yet ──▶ meet ──their name──▶ an account

Kept in memory: who restarts the server has people begin anew.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from racecraft.serve.people.keys import digest_of
from racecraft.serve.problems import NotLetIn

SECONDS: Final = 600
"""How long somebody may be away, and take to choose a name."""
MOST: Final = 5000
"""At the same time; the oldest makes room."""

T = TypeVar("T")


@dataclass(frozen=True)
class Visit:
    """Somebody is at the provider."""

    browser: str
    """The digest of what only the browser knows that began."""
    nonce: str
    verifier: str
    """Of which the provider was shown a hash, so that its code is of no use to others."""
    back: str
    """The address that the provider sends them to: ours, whatever they say."""
    user_id: int | None
    """Who adds the provider to the account that they have; None for who comes in."""


@dataclass(frozen=True)
class Whom:
    """Somebody as the provider knows them."""

    issuer: str
    subject: str
    """Its name for them, which never changes; e-mail addresses do, and are given to others."""
    real_name: str
    session: str = ""
    """Its name for this sign-in, by which it can end it; empty if it has none."""


class Visits:
    """All visits."""

    def __init__(self) -> None:
        self._waiting: _Waiting[Visit] = _Waiting()

    def begin(self, *, back: str, user_id: int | None) -> tuple[str, str, Visit]:
        """A state for the address, a secret for the browser, and what is kept of them."""
        state, browser = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        visit = Visit(digest_of(browser), secrets.token_urlsafe(32), secrets.token_urlsafe(48), back, user_id)
        self._waiting.put(digest_of(state), visit)
        return state, browser, visit

    def take(self, state: str, browser: str) -> Visit:
        """What began with a state, once.

        Raises:
            NotLetIn: Nothing did, it took too long, it was taken before, or another browser began it.
        """
        mine = digest_of(browser)
        found = self._waiting.take(digest_of(state), lambda visit: visit.browser == mine)
        if found is None:
            raise NotLetIn("This sign-in is over, or was used already.", hint="Begin again.")
        if found.browser != mine:
            raise NotLetIn("This sign-in began in another browser.", hint="Begin again in this one.")
        return found


class Newcomers:
    """Those who were found true and have no account yet."""

    def __init__(self) -> None:
        self._waiting: _Waiting[Whom] = _Waiting()

    def meet(self, browser: str, whom: Whom) -> None:
        """Remember who a browser's secret stands for, until they have a name."""
        self._waiting.put(digest_of(browser), whom)

    def who(self, browser: str) -> Whom:
        """Who it is.

        Raises:
            NotLetIn: Nobody, or they took too long.
        """
        found = self._waiting.take(digest_of(browser), lambda _: False)
        if found is None:
            raise NotLetIn("This sign-in is over, or was used already.", hint="Begin again.")
        return found

    def forget(self, browser: str) -> None:
        """They have a name."""
        self._waiting.take(digest_of(browser), lambda _: True)


class _Waiting(Generic[T]):
    """Things by a digest, for a while."""

    def __init__(self) -> None:
        self._things: dict[str, tuple[float, T]] = {}  # oldest first
        self._lock = threading.Lock()

    def put(self, digest: str, thing: T) -> None:
        with self._lock:
            self._forget()
            while len(self._things) >= MOST:
                del self._things[next(iter(self._things))]
            self._things.pop(digest, None)
            self._things[digest] = (time.monotonic() + SECONDS, thing)

    def take(self, digest: str, is_taken: Callable[[T], bool]) -> T | None:
        """What there is, which stays where it is not taken."""
        with self._lock:
            self._forget()
            found = self._things.get(digest)
            if found is None:
                return None
            if is_taken(found[1]):
                del self._things[digest]
            return found[1]

    def _forget(self) -> None:
        now = time.monotonic()
        while self._things and next(iter(self._things.values()))[0] <= now:
            del self._things[next(iter(self._things))]
