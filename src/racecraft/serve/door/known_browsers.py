"""Browsers in which somebody gave their password before: wrong tries from elsewhere do not keep those out.

A browser keeps a mark of the account, which opens nothing: whoever shows it is only counted by themselves, so that who
tries wrong passwords under a known name locks out nobody but browsers that never were in. It is signed with what is
kept of the password, so another password ends it, and the database knows nothing of it.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import time
from typing import Final

from fastapi import Request, Response

from racecraft.serve.people.people import People
from racecraft.serve.settings import KNOWN_COOKIE

SECONDS: Final = 180 * 86400
MOST: Final = 4  # accounts that a browser is known to; the oldest makes room


def remember(request: Request, response: Response, people: People, user_id: int) -> None:
    """Have a browser keep that somebody has given their password in it, beside others who have."""
    kept = people.kept_password(user_id)
    others = [mark for mark in _marks(request) if not mark.startswith(f"{user_id}.")]
    value = "~".join([make_mark(user_id, kept), *others][:MOST])
    is_secure: bool = request.app.state.guard.is_secure
    response.set_cookie(
        KNOWN_COOKIE, value, httponly=True, samesite="strict", path="/api", max_age=SECONDS, secure=is_secure
    )


def known_as(request: Request, people: People, name: str) -> str:
    """What a browser is counted by that is known to the account of a name; empty for others."""
    marks = _marks(request)
    found = people.kept(name) if marks else None
    if found is None or not found[1]:
        return ""
    return next((mark for mark in marks if is_mark(mark, *found)), "")


def make_mark(user_id: int, kept: str) -> str:
    """A mark of an account.

    Args:
        user_id: Of the account.
        kept: What is kept of its password.
    """
    said = f"{user_id}.{int(time.time()) + SECONDS}.{secrets.token_urlsafe(12)}"
    return f"{said}.{_signature(said, kept)}"


def is_mark(mark: str, user_id: int, kept: str) -> bool:
    """Whether a mark is of an account, and not too old."""
    said, _, signature = mark.rpartition(".")
    if not hmac.compare_digest(signature.encode(errors="surrogatepass"), _signature(said, kept).encode()):
        return False
    whose, until, _ = said.split(".")  # as it was signed
    return int(whose) == user_id and int(until) > time.time()


def _marks(request: Request) -> list[str]:
    return [mark for mark in request.cookies.get(KNOWN_COOKIE, "").split("~")[:MOST] if mark]


def _signature(said: str, kept: str) -> str:
    return hmac.new(kept.encode(), said.encode(errors="surrogatepass"), hashlib.sha256).hexdigest()
