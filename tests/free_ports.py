"""Ports for programs that have to be told one before they listen."""

from __future__ import annotations

import random
import socket

BELOW = range(20_000, 32_000)
"""Of these the system gives none to who asks for any, as all other tests' servers and browsers do meanwhile."""


def free_port() -> int:
    """One of this machine's on which nobody listens."""
    for port in random.sample(BELOW, len(BELOW)):
        with socket.socket() as taken:
            try:
                taken.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError("Every port is taken.")
