"""Passwords: hashed with argon2id, at most two at once, as each takes 64 MB and tens of milliseconds."""

from __future__ import annotations

import threading
from functools import cache
from typing import TYPE_CHECKING, Final

from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from pwdlib import PasswordHash

MOST_AT_ONCE: Final = 2
MIN_LENGTH: Final = 10
MAX_LENGTH: Final = 256  # characters; longer ones cost the same and are somebody's joke
_PLACES: Final = threading.BoundedSemaphore(MOST_AT_ONCE)


def hash_password(password: str) -> str:
    """What is kept of a password.

    Raises:
        ConfigError: It is too short or too long.
    """
    if not MIN_LENGTH <= len(password) <= MAX_LENGTH:
        raise ConfigError(f"A password has {MIN_LENGTH} to {MAX_LENGTH} characters; yours has {len(password)}.")
    with _PLACES:
        return _hasher().hash(password)


def is_password(password: str, kept: str) -> bool:
    """Whether it is the one; where nothing is kept it takes as long, so that nobody learns which names there are."""
    with _PLACES:
        is_right = _hasher().verify(password[:MAX_LENGTH], kept or _nothing())
    return is_right and bool(kept)


@cache
def _hasher() -> PasswordHash:
    from pwdlib import PasswordHash  # consoles without accounts do without

    return PasswordHash.recommended()


@cache
def _nothing() -> str:
    return _hasher().hash("nobody has this password")
