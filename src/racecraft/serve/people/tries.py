"""How often somebody may try to get in.

Counted are failures, by account and, far more loosely, by where they come from: a class of thirty shares one address.
A try counts as one while it is under way, so that a hundred at once are no way around, and is forgiven if it succeeds:
nobody is kept out by doing everything right. Secrets of 128 bits and more (cards, links, programs) nobody guesses; they
are looked up first, and only wrong ones are counted, apart, so that whoever shows a hundred keeps out nobody else.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from typing import Final, Literal, NoReturn

from racecraft.serve.problems import TooMany

MINUTES: Final = 10
MOST: Final = {"account": 10, "code": 200, "password": 200, "secret": 200, "program": 200, "provider": 600}
"""Failures in ten minutes of an account, and from an address each way in; of programs and providers what is begun."""
NETWORK_BITS: Final = 64
"""Of an IPv6 address: the rest of it whoever has one chooses at will."""


@dataclass
class Attempt:
    """A try that is under way."""

    is_wrong: bool = False

    def fail(self) -> None:
        """It was wrong, and stays counted."""
        self.is_wrong = True


class Tries:
    """Failures of the last minutes, in memory: who restarts the server forgives all."""

    def __init__(self) -> None:
        from limits import RateLimitItemPerMinute, storage, strategies  # consoles without accounts do without

        self._limiter = strategies.MovingWindowRateLimiter(storage.MemoryStorage())
        self._limits = {kind: RateLimitItemPerMinute(most, MINUTES) for kind, most in MOST.items()}
        self._under_way: Counter[tuple[str, str]] = Counter()
        self._lock = threading.Lock()

    @contextmanager
    def attempt(
        self, *, account: str = "", address: str = "", way: Literal["code", "password"] = "password"
    ) -> Iterator[Attempt]:
        """A try at something that could be guessed, as long as the block runs; it says so if it fails.

        Args:
            account: Whom it is about; empty for what names nobody.
            address: Where it comes from; empty where only the account counts.
            way: What is guessed.

        Raises:
            TooMany: There were too many failures, those counted that may become some.
        """
        counted = [(kind, who) for kind, who in (("account", account), (way, network_of(address))) if who]
        with self._lock:
            for kind, who in counted:
                if not self._limiter.test(self._limits[kind], kind, who, cost=self._under_way[kind, who] + 1):
                    _refuse()
            self._under_way.update(counted)
        attempt = Attempt()
        try:
            yield attempt
        finally:
            with self._lock:
                for kind, who in counted:
                    self._under_way[kind, who] -= 1
                    if not self._under_way[kind, who]:
                        del self._under_way[kind, who]
                    if attempt.is_wrong:
                        self._limiter.hit(self._limits[kind], kind, who)

    def wrong_secret(self, *, address: str) -> None:
        """Somebody showed what nobody guesses, and it is worth nothing.

        Raises:
            TooMany: There were too many.
        """
        if not self._limiter.hit(self._limits["secret"], "secret", network_of(address)):
            _refuse()

    def begins(self, what: Literal["program", "provider"], *, address: str) -> None:
        """A program waits to be let in, or somebody goes to the provider: each takes a place in memory.

        These are counted, if they fail or not.

        Raises:
            TooMany: There were too many.
        """
        if not self._limiter.hit(self._limits[what], what, network_of(address)):
            raise TooMany("Too many sign-ins were begun from here.", hint="Wait ten minutes, or come in another way.")


def network_of(address: str) -> str:
    """Where an address is counted: IPv4 by itself, also inside IPv6; IPv6 by the network that one is given whole."""
    try:
        found = ip_address(address)
    except ValueError:
        return address
    if not isinstance(found, IPv6Address):
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    host_bits = found.max_prefixlen - NETWORK_BITS
    return f"{IPv6Address(int(found) >> host_bits << host_bits)}/{NETWORK_BITS}"


def _refuse() -> NoReturn:
    raise TooMany("There were too many wrong tries.", hint="Wait ten minutes, or ask whoever holds the league.")
