"""A provider of ours that does everything wrong that a test asks it for."""

from __future__ import annotations

import hmac
import json
import threading
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final
from urllib.parse import parse_qsl, urlsplit

from joserfc import jwt
from joserfc.jwk import RSAKey

from racecraft.serve.provider.provider import Answer, Provider
from racecraft.serve.provider_settings import ProviderSettings

CLIENT: Final = "league"
KEY: Final = RSAKey.generate_key(2048, {"kid": "one", "use": "sig"})
OTHER: Final = RSAKey.generate_key(2048, {"kid": "one", "use": "sig"})
"""A key that nobody knows, under the name of one that everybody does."""


@dataclass
class Hostile:
    """The provider; a test changes what it says before somebody comes back."""

    issuer: str = ""
    document: dict[str, Any] = field(default_factory=dict)
    """What it says of itself, other than it should."""
    claims: dict[str, Any] = field(default_factory=dict)
    """What it says of somebody, other than it should; None leaves it out."""
    userinfo: dict[str, Any] = field(default_factory=lambda: {"sub": "7"})
    keys: list[Any] = field(default_factory=lambda: [KEY.as_dict(private=False)])
    sign: Callable[[dict[str, Any]], str] = lambda claims: jwt.encode({"alg": "RS256", "kid": "one"}, claims, KEY)
    answers: dict[str, Callable[[BaseHTTPRequestHandler], None]] = field(default_factory=dict)
    """By path, what it does instead of an answer."""
    asked: list[str] = field(default_factory=list)
    nonce: str = ""

    def says(self, path: str) -> Any:
        if path == "/.well-known/openid-configuration":
            told = {name: f"{self.issuer}/{name}" for name in ("authorization_endpoint", "token_endpoint", "jwks_uri")}
            return {"issuer": self.issuer, "userinfo_endpoint": f"{self.issuer}/userinfo", **told, **self.document}
        if path == "/jwks_uri":
            return {"keys": self.keys}
        if path == "/userinfo":
            return self.userinfo
        now = int(time.time())
        claims = {"iss": self.issuer, "aud": CLIENT, "sub": "7", "nonce": self.nonce, "iat": now, "exp": now + 300}
        claims = {name: value for name, value in {**claims, **self.claims}.items() if value is not None}
        return {"access_token": "a", "token_type": "Bearer", "id_token": self.sign(claims)}

    def league(self, **settings: Any) -> Provider:
        """Somebody's league that uses it."""
        told = {"client": CLIENT, "secret": "x", "label": "Hill School", **settings}
        return Provider(ProviderSettings(issuer=self.issuer, **told))

    def go(self, league: Provider, *, user_id: int | None = None) -> tuple[Answer, str]:
        """Somebody goes there and comes back: what they bring, and their browser's secret."""
        to, browser = league.begin(back="http://127.0.0.1:1/oidc", user_id=user_id)
        sent = dict(parse_qsl(urlsplit(to).query))
        self.nonce = sent["nonce"]
        return Answer(code="c", state=sent["state"]), browser


@contextmanager
def hostile_provider() -> Iterator[Hostile]:
    hostile = Hostile()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            path = urlsplit(self.path).path
            hostile.asked.append(path)
            if path in hostile.answers:
                hostile.answers[path](self)
            else:
                reply(self, json.dumps(hostile.says(path)).encode())

        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["content-length"]))
            self.do_GET()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        server.block_on_close = False
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        hostile.issuer = f"http://127.0.0.1:{server.server_address[1]}"
        yield hostile
        server.shutdown()


def reply(handler: BaseHTTPRequestHandler, body: bytes, *, status: int = 200, **headers: str) -> None:
    handler.send_response(status)
    for name, value in {"content-length": str(len(body)), **headers}.items():
        handler.send_header(name, value)
    handler.end_headers()
    handler.wfile.write(body)


def unsigned(claims: dict[str, Any]) -> str:
    """By nobody at all."""
    return f"{part({'alg': 'none', 'kid': 'one'})}.{part(claims)}."


def by_public_key(claims: dict[str, Any]) -> str:
    """By what everybody knows, as if it were a secret that is shared."""
    message = f"{part({'alg': 'HS256', 'kid': 'one'})}.{part(claims)}"
    return f"{message}.{base64url(hmac.digest(KEY.as_pem(private=False), message.encode(), 'sha256'))}"


def by_another_key(claims: dict[str, Any]) -> str:
    return jwt.encode({"alg": "RS256", "kid": "one"}, claims, OTHER)


def by_unknown_key(claims: dict[str, Any]) -> str:
    return jwt.encode({"alg": "RS256", "kid": "two"}, claims, OTHER)


def part(told: dict[str, Any]) -> str:
    return base64url(json.dumps(told).encode())


def base64url(data: bytes) -> str:
    return urlsafe_b64encode(data).rstrip(b"=").decode()
