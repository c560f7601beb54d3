"""Who may talk to the console: a browser that came with the one-time link, from the console's own pages.

Other pages in the same browser, other names for this machine (DNS rebinding) and other users' programs are refused.
"""

from __future__ import annotations

import hashlib
import secrets
from typing import Final

import sqlalchemy as sa
from fastapi import Request, Response
from fastapi.responses import RedirectResponse
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from racecraft.serve.problems import problem
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Session, User

COOKIE: Final = "racecraft_session"
MAX_BODY: Final = 8 << 20  # bytes
LARGE: Final = {"/api/models/import": 1 << 30}
"""Addresses that take more, as much as an archive may have; they write to disk what comes, as it comes."""
SAFE: Final = ("GET", "HEAD", "OPTIONS")
HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


def content_policy(nonce: str) -> str:
    """What a page of ours may load: our own files and nothing else; styles that carry the page's nonce."""
    return (
        f"default-src 'none'; script-src 'self'; style-src 'self' 'nonce-{nonce}'; img-src 'self' data: blob:; "
        "media-src 'self'; font-src 'self'; connect-src 'self'; worker-src 'self' blob:; form-action 'self'; "
        "base-uri 'none'; frame-ancestors 'none'"
    )


class Guard:
    """Lets the right browsers in.

    Args:
        database: Holds the sessions.
        hosts: Names with ports that the console may be called by.
    """

    def __init__(self, database: Database, hosts: set[str]) -> None:
        self._database, self._hosts = database, hosts
        self._tickets: set[str] = set()
        self._known: dict[str, int] = {}

    def ticket(self) -> str:
        """A secret that opens the console once."""
        ticket = secrets.token_urlsafe(32)
        self._tickets.add(ticket)
        return ticket

    def middleware(self, app: ASGIApp) -> ASGIApp:
        """Stand before an application: refuse, let in, or pass on; every reply gets its headers."""

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] != "http":
                await app(scope, receive, send)
                return
            is_api = scope["path"].startswith("/api/")
            most = LARGE.get(scope["path"], MAX_BODY)
            taken = 0

            async def send_with_headers(message: Message) -> None:
                if message["type"] == "http.response.start":
                    headers = MutableHeaders(scope=message)
                    for name, value in HEADERS.items():
                        headers.setdefault(name, value)
                    headers.setdefault("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'")
                    if is_api:
                        headers.setdefault("Cache-Control", "no-store")
                await send(message)

            async def receive_so_much() -> Message:
                nonlocal taken
                message = await receive()
                taken += len(message.get("body", b""))
                if taken > most:
                    raise HTTPException(413, f"A request may have at most {most >> 20} MB.")
                return message

            answer = self._refuse(Request(scope)) or app
            await answer(scope, receive_so_much, send_with_headers)

        return guarded

    def _refuse(self, request: Request) -> Response | None:
        if request.headers.get("host", "") not in self._hosts:
            return problem(421, "Refused", "The console answers only at the address that it printed.")
        origin = request.headers.get("origin")
        if origin is not None and origin not in {f"http://{host}" for host in self._hosts}:
            return problem(403, "Refused", "Another site's pages may not use the console.")
        if request.headers.get("sec-fetch-site", "same-origin") == "cross-site" and request.method not in SAFE:
            return problem(403, "Refused", "Another site's pages may not use the console.")
        length = request.headers.get("content-length") or "0"
        most = LARGE.get(request.url.path, MAX_BODY)
        if not (length.isascii() and length.isdigit() and len(length) < 16) or int(length) > most:
            return problem(413, "TooLarge", f"A request may have at most {most >> 20} MB.")
        if request.url.path == "/" and (ticket := request.query_params.get("ticket")):
            return self._let_in(request, ticket)
        if request.url.path.startswith("/api/") and self._user(request) is None:
            return problem(
                401, "NotSignedIn", "This browser is not known.", "Open the link that racecraft serve prints."
            )
        return None

    def _let_in(self, request: Request, ticket: str) -> Response:
        """Exchange a ticket for a cookie; a browser that has one already just goes on."""
        if ticket in self._tickets:
            self._tickets.discard(ticket)
            secret = secrets.token_urlsafe(32)
            with self._database.transaction() as session:
                user = session.scalar(sa.select(User.id).order_by(User.id).limit(1))
                session.add(Session(digest=_digest(secret), user_id=user))
            response = RedirectResponse("/", status_code=303)
            response.set_cookie(COOKIE, secret, httponly=True, samesite="strict", path="/", max_age=30 * 86400)
            return response
        return RedirectResponse("/", status_code=303)

    def _user(self, request: Request) -> int | None:
        secret = request.cookies.get(COOKIE)
        if not secret:
            return None
        digest = _digest(secret)
        if digest not in self._known:
            with self._database.transaction() as session:
                user = session.scalar(sa.select(Session.user_id).where(Session.digest == digest))
            if user is None:
                return None
            self._known[digest] = user
        request.state.user_id = self._known[digest]
        return self._known[digest]


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
