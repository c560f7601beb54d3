"""Who may talk to the console: a browser that came with the one-time link, from the console's own pages.

Other pages in the same browser, other names for this machine (DNS rebinding) and other users' programs are refused. In
a league people come with a session that `racecraft.serve.door.routes` gave them, and programs with a token.
"""

from __future__ import annotations

import asyncio
import functools
import re
import secrets
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Final
from urllib.parse import urlsplit

from fastapi import Request, Response
from fastapi.responses import RedirectResponse
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from racecraft.serve.door.bodies import Body, too_large
from racecraft.serve.jobs.line import MAX_OBJECT
from racecraft.serve.jobs.remote import ROOM
from racecraft.serve.people.keys import WORKER, Keys
from racecraft.serve.replies import problem
from racecraft.serve.settings import COOKIE, LOOPBACK, OWNER, PROVIDER_COOKIE, ServeSettings

MAX_BODY: Final = 8 << 20  # bytes
MAX_AT_DOOR: Final = 1 << 16
"""What strangers say, who are many: a hundred that never finish hold no more than one request of somebody known."""
MAX_SUBMISSION: Final = 32 << 20
MAX_TOLD: Final = 1 << 20
"""What a worker says in words."""
LARGE: Final = {"/api/models/import": 1 << 30}
"""Addresses that take more, as much as an archive may have; they write to disk what comes, as it comes."""
SAFE: Final = ("GET", "HEAD", "OPTIONS")
DEVICES: Final = ("/api/door/devices", "/api/door/devices/token")
PROVIDER: Final = tuple(f"/api/door/provider{way}" for way in ("", "/arrival", "/newcomer", "/sign-out"))
OPEN: Final = (
    *("/api/door", "/api/door/sign-in", "/api/door/card", "/api/door/join", "/api/door/reset"),
    *DEVICES,
    *PROVIDER,
)
"""What a league answers to strangers, beside the boards of public races."""
HEALTH: Final = "/api/health"
"""What a supervisor asks, of any console; it tells nothing but that it works."""
BOARDS: Final = "/api/boards/"
STREAMS: Final = "/api/events/"
SUBMIT: Final = re.compile(r"/api/league/races/[0-9]{1,10}/submissions")
"""Where programs send what they submit."""
PARCEL: Final = re.compile(rf"{ROOM}/[0-9a-f]{{16}}/objects/")
"""Where workers send files."""
LOOK: Final = 0.5  # s between two looks whether who follows a stream still may
COOKIE_S: Final = 30 * 86400
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


def most_bytes(path: str) -> int:
    """How much a request to an address may hold."""
    if path.startswith(f"{ROOM}/"):
        return MAX_OBJECT if PARCEL.match(path) else MAX_TOLD
    if path in OPEN:
        return MAX_AT_DOOR
    return MAX_SUBMISSION if SUBMIT.fullmatch(path) else LARGE.get(path, MAX_BODY)


class Guard:
    """Lets the right browsers in.

    Args:
        keys: What opens the door.
        settings: Of the console.
        hosts: Names with ports that the console may be called by, beside the league's address.
    """

    def __init__(self, keys: Keys, settings: ServeSettings, hosts: set[str]) -> None:
        self._keys, self._is_league = keys, settings.league
        address = urlsplit(settings.address)
        self._hosts = hosts | ({address.netloc} if address.netloc else set())
        self._origins = {f"http://{host}" for host in hosts}
        if address.netloc:
            self._origins.add(f"{address.scheme}://{address.netloc}")
        self.is_secure = address.scheme == "https"
        self._needs_encryption = settings.needs_encryption
        self._tickets: set[str] = set()
        self._known: set[str] = set()
        self._listeners = Listeners(keys)

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

            async def is_still_in() -> bool:
                request = Request(scope)
                before = getattr(request.state, "user_id", None)
                return before is None or await asyncio.to_thread(self._user, request) == before

            changes = self._is_league and scope["method"] not in SAFE
            body = Body(receive, most_bytes(scope["path"]), is_still_in=is_still_in if changes else None)

            async def send_with_headers(message: Message) -> None:
                if message["type"] == "http.response.start":
                    headers = MutableHeaders(scope=message)
                    for name, value in HEADERS.items():
                        headers.setdefault(name, value)
                    headers.setdefault("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'")
                    if is_api:
                        headers.setdefault("Cache-Control", "no-store")
                    if body.is_given_up:
                        headers["Connection"] = "close"
                await send(message)

            answer = self._refuse(Request(scope)) or app
            if self._is_league and scope["path"].startswith(STREAMS) and answer is app:
                stream = Listening(body.receive, may_stay=self._may_stay(Request(scope)))
                with self._listeners.one_more(Request(scope).cookies.get(COOKIE)):
                    await app(scope, stream.receive, send_with_headers)
                if stream.has_left:
                    await send({"type": "http.response.body", "body": b"", "more_body": False})
            else:
                await answer(scope, body.receive, send_with_headers)

        return guarded

    def _refuse(self, request: Request) -> Response | None:
        if request.headers.get("host", "") not in self._hosts:
            return problem(421, "Refused", "The console answers only at the address that it printed.")
        if self._needs_encryption and request.url.scheme != "https" and caller(request) not in LOOPBACK:
            return problem(403, "Refused", "This league is called by https only.")
        origin = request.headers.get("origin")
        if origin is not None and origin not in self._origins:
            return problem(403, "Refused", "Another site's pages may not use the console.")
        if request.headers.get("sec-fetch-site", "same-origin") == "cross-site" and request.method not in SAFE:
            return problem(403, "Refused", "Another site's pages may not use the console.")
        length = request.headers.get("content-length") or "0"
        most = most_bytes(request.url.path)
        if not (length.isascii() and length.isdigit() and len(length) < 16) or int(length) > most:
            return problem(413, "TooLarge", too_large(most))
        if request.url.path == "/" and (ticket := request.query_params.get("ticket")):
            return self._let_in(request, ticket)
        if request.url.path.startswith("/api/"):
            return self._refuse_stranger(request)
        return None

    def _refuse_stranger(self, request: Request) -> Response | None:
        path = request.url.path
        if path == HEALTH and request.method in SAFE:
            return None
        if self._user(request) is None:
            if self._is_league and (path in OPEN or (path.startswith(BOARDS) and request.method in SAFE)):
                request.state.user_id = None
                return None
            if self._is_league and "authorization" in request.headers:
                return problem(401, "NotSignedIn", "This token is no longer good.", "Make a new one.")
            if self._is_league:
                return problem(401, "NotSignedIn", "You are not signed in.", "Sign in, or show your card.")
            return problem(
                401, "NotSignedIn", "This browser is not known.", "Open the link that racecraft serve prints."
            )
        if (scopes := request.state.scopes) is not None:
            is_own = path.startswith(("/api/account", f"{ROOM}/")) or path == ROOM
            may_read = "read" in scopes and request.method in SAFE and not is_own
            may_submit = "submit" in scopes and request.method == "POST" and SUBMIT.fullmatch(path)
            may_work = WORKER in scopes and (path == ROOM or path.startswith(f"{ROOM}/"))
            if not may_read and not may_submit and not may_work:
                return problem(403, "Refused", "This token is not for that.", "Make one with the scope that it needs.")
        return None

    def _let_in(self, request: Request, ticket: str) -> Response:
        """Exchange a ticket for a cookie; a browser that has one already just goes on."""
        response = RedirectResponse("/", status_code=303)
        if ticket in self._tickets:
            self._tickets.discard(ticket)
            days = COOKIE_S // 86400 if self._is_league else None
            self.give_cookie(response, self._keys.open_session(OWNER, days=days))
        return response

    def give_cookie(self, response: Response, secret: str) -> None:
        """Have a browser keep its session."""
        response.set_cookie(
            COOKIE, secret, httponly=True, samesite="strict", path="/", max_age=COOKIE_S, secure=self.is_secure
        )

    def send_away(self, response: Response, secret: str, *, seconds: int) -> None:
        """Have a browser keep what it is known by when it comes back from a provider."""
        response.set_cookie(
            PROVIDER_COOKIE,
            secret,
            httponly=True,
            samesite="strict",
            path="/api/door/provider",
            max_age=seconds,
            secure=self.is_secure,
        )

    def _may_stay(self, request: Request) -> Callable[[], Awaitable[bool]]:
        """Asks whether who follows a stream still may: browsers all together, programs one by one."""
        secret = request.cookies.get(COOKIE)

        async def program_may() -> bool:
            return await asyncio.to_thread(self._user, request) is not None

        if secret is None or request.headers.get("authorization", "").startswith("Bearer "):
            return program_may
        return functools.partial(self._listeners.may_stay, secret)

    def _user(self, request: Request) -> int | None:
        """Who asks; of a league's people it is looked up every time, so that they are out as soon as they are."""
        request.state.scopes = None
        if self._is_league and (bearer := request.headers.get("authorization", "")).startswith("Bearer "):
            found = self._keys.bearer(bearer.removeprefix("Bearer "))
            if found is None:
                return None
            request.state.user_id, request.state.scopes, request.state.token = found.user_id, found.scopes, found.token
            return found.user_id
        secret = request.cookies.get(COOKIE)
        if not secret:
            return None
        if not self._is_league and secret in self._known:
            user: int | None = OWNER
        else:
            user = self._keys.session_user(secret)
            if not self._is_league and user != OWNER:  # of a time when there were others
                return None
            if user is not None and not self._is_league:
                self._known.add(secret)
        request.state.user_id = user
        return user


class Listeners:
    """The browsers that follow streams: a hundred of them cost one question to the database now and then.

    Args:
        keys: What opens the door.
    """

    def __init__(self, keys: Keys) -> None:
        self._keys = keys
        self._here: Counter[str] = Counter()
        self._good: set[str] = set()
        self._until = 0.0
        self._lock = asyncio.Lock()

    @contextmanager
    def one_more(self, secret: str | None) -> Iterator[None]:
        """A stream of a browser that was just let in, as long as the block runs."""
        if secret is None:
            yield
            return
        self._here[secret] += 1
        self._good.add(secret)
        try:
            yield
        finally:
            self._here[secret] -= 1
            if not self._here[secret]:
                del self._here[secret]

    async def may_stay(self, secret: str) -> bool:
        """Whether a browser's session is still good; the answer is at most half a `LOOK` old."""
        async with self._lock:
            if time.monotonic() >= self._until:
                asked = set(self._here)
                good = await asyncio.to_thread(self._keys.open_sessions, asked)
                self._good = good | (set(self._here) - asked)  # who came meanwhile
                self._until = time.monotonic() + LOOK / 2
        return secret in self._good


class Listening:
    """Somebody who follows a stream, until their session ends: to have it open is no way to stay.

    Args:
        receive: What the browser says.
        may_stay: Whether they still may.
    """

    def __init__(self, receive: Receive, *, may_stay: Callable[[], Awaitable[bool]]) -> None:
        self._receive, self._may_stay = receive, may_stay
        self.has_left = False

    async def receive(self) -> Message:
        """What the browser says next, or that it is gone."""
        coming = asyncio.ensure_future(self._receive())
        try:
            while not coming.done():
                await asyncio.wait([coming], timeout=LOOK)
                if not coming.done() and not await self._may_stay():
                    self.has_left = True
                    return {"type": "http.disconnect"}
            return coming.result()
        finally:
            coming.cancel()


def caller(request: Request) -> str:
    """The address that a request comes from; behind a trusted proxy the one that it tells."""
    return request.client.host if request.client is not None else ""
