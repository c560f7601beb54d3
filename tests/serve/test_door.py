"""Who gets in: the link once, the right host and origin, the cookie; everybody gets the headers."""

from __future__ import annotations

import httpx
import pytest
from running_consoles import PATIENCE, RunningConsole, plain_client


@pytest.mark.costly
def test_the_link_works_once(console: RunningConsole) -> None:
    with plain_client(console.client.base_url) as stranger:
        assert stranger.get(console.link).status_code == 303
        reply = stranger.get("/api/models")
        assert reply.status_code == 401
        assert reply.json()["error"]["code"] == "NotSignedIn"


@pytest.mark.parametrize("cookie", ["", "x", "ü".encode("latin-1").decode("latin-1"), "a" * 4000])
def test_a_made_up_cookie_is_refused(console: RunningConsole, cookie: str) -> None:
    headers = {"cookie": f"racecraft_session={cookie}".encode("latin-1")}
    assert httpx.get(f"{console.client.base_url}/api/models", headers=headers, timeout=PATIENCE).status_code == 401


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "localhost:1", ""])
def test_another_name_for_this_machine_is_refused(console: RunningConsole, host: str) -> None:
    assert console.client.get("/api/models", headers={"host": host}).status_code == 421


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1"])
def test_another_sites_page_is_refused(console: RunningConsole, origin: str) -> None:
    assert console.client.post("/api/models", json={}, headers={"origin": origin}).status_code == 403
    assert console.client.get("/api/models", headers={"origin": origin}).status_code == 403


def test_an_origin_that_only_begins_like_ours_is_refused(console: RunningConsole) -> None:
    own = str(console.client.base_url).rstrip("/")
    for origin in (f"{own}0", f"{own}.evil.example", f"{own}@evil.example", own.replace("http:", "https:"), own[:-1]):
        assert console.client.post("/api/models", json={}, headers={"origin": origin}).status_code == 403, origin


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE"])
def test_what_another_sites_page_would_change_is_refused_even_if_its_origin_is_not_told(
    console: RunningConsole, method: str
) -> None:
    """A browser says where a request comes from also where it sends no origin."""
    reply = console.client.request(method, "/api/models", headers={"sec-fetch-site": "cross-site"})
    assert reply.status_code == 403
    assert reply.json()["error"]["code"] == "Refused"
    for site in ("same-origin", "none"):
        assert console.client.request(method, "/api/models", headers={"sec-fetch-site": site}).status_code in (405, 422)


@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_a_link_on_another_sites_page_may_lead_here(console: RunningConsole, method: str) -> None:
    assert console.client.request(method, "/garage", headers={"sec-fetch-site": "cross-site"}).status_code != 403


def test_our_own_origin_is_let_in(console: RunningConsole) -> None:
    origin = str(console.client.base_url).rstrip("/")
    assert console.client.get("/api/models", headers={"origin": origin}).status_code == 200


def test_large_requests_are_refused(console: RunningConsole) -> None:
    reply = console.client.post("/api/models", content=b"x" * (9 << 20))
    assert reply.status_code == 413
    assert console.client.post("/api/models", json={"reward": "x" * 140_001}).status_code == 422

    def chunks() -> object:
        for _ in range(9):
            yield b"x" * (1 << 20)

    assert console.client.post("/api/models", content=chunks()).status_code == 413


def test_every_reply_carries_the_headers(console: RunningConsole) -> None:
    for path in ("/", "/api/models", "/api/nothing", "/assets/none.js", "/garage"):
        headers = console.client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]


def test_nothing_outside_the_pages_is_handed_out(console: RunningConsole) -> None:
    for path in ("/assets/..%2f..%2fapp.py", "/assets/%2e%2e/app.py", "/assets/app.py"):
        reply = console.client.get(path)
        assert "create_app" not in reply.text


def test_unknown_addresses_below_api_are_errors_in_the_one_shape(console: RunningConsole) -> None:
    for method, path, status in (("GET", "/api/nothing", 404), ("PUT", "/api/models", 405)):
        reply = console.client.request(method, path)
        assert reply.status_code == status
        assert set(reply.json()) == {"error"}


@pytest.mark.costly
def test_no_reply_waits_for_an_acknowledgement(console: RunningConsole) -> None:
    """Headers and body are sent one after the other: with Nagle's algorithm on, the second waits some 40 ms."""
    seconds = [console.client.get("/api/nothing").elapsed.total_seconds() for _ in range(20)]
    assert min(seconds[1:]) < 0.03
