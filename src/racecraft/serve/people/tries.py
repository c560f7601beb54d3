"""How often somebody may try to get in.

Counted are failures, by account and, far more loosely, by address: a class of thirty shares one. What succeeds costs
nothing, so nobody is kept out by doing everything right.
"""

from __future__ import annotations

from racecraft.serve.problems import TooMany


class Tries:
    """Failures of the last minutes, in memory: who restarts the server forgives all."""

    def __init__(self) -> None:
        from limits import RateLimitItemPerMinute, storage, strategies  # consoles without accounts do without

        self._limiter = strategies.MovingWindowRateLimiter(storage.MemoryStorage())
        self._limits = {
            "account": RateLimitItemPerMinute(10, 10),
            "address": RateLimitItemPerMinute(200, 10),
            "beginning": RateLimitItemPerMinute(600, 10),
        }

    def check(self, *, account: str, address: str) -> None:
        """Before a try.

        Args:
            account: Whom it is about; empty for a secret that names nobody.
            address: Where it comes from.

        Raises:
            TooMany: There were too many failures.
        """
        for kind, who in (("account", account), ("address", address)):
            if who and not self._limiter.test(self._limits[kind], kind, who):
                raise TooMany(
                    "There were too many wrong tries.", hint="Wait ten minutes, or ask whoever holds the league."
                )

    def failed(self, *, account: str, address: str) -> None:
        """After one that failed."""
        for kind, who in (("account", account), ("address", address)):
            if who:
                self._limiter.hit(self._limits[kind], kind, who)

    def begins(self, *, address: str) -> None:
        """Somebody goes to the provider; each takes a place in memory, so these are counted, if they fail or not.

        Raises:
            TooMany: There were too many.
        """
        if not self._limiter.hit(self._limits["beginning"], "beginning", address):
            raise TooMany("Too many sign-ins were begun from here.", hint="Wait ten minutes, or come in another way.")
