"""A provider that lies, is slow or talks too much, and who brings what is not theirs: each gets its sentence."""

from __future__ import annotations

import math
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler
from typing import Any

import pytest
from hostile_providers import (
    CLIENT,
    KEY,
    OTHER,
    Hostile,
    by_another_key,
    by_public_key,
    by_unknown_key,
    hostile_provider,
    reply,
    unsigned,
)
from joserfc.jwk import RSAKey

from racecraft.errors import ConfigError
from racecraft.serve.problems import NotLetIn, Unreachable
from racecraft.serve.provider import discovery, fetch, visits
from racecraft.serve.provider.provider import Answer, Provider
from racecraft.serve.provider.visits import Whom
from racecraft.serve.provider_settings import SECRET, ProviderSettings, claim_of, secret_of

DOCUMENT = "/.well-known/openid-configuration"
HOUR = 3600


def weak_key() -> dict[str, Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it says that it is weak
        return dict(RSAKey.generate_key(1024, {"kid": "one"}).as_dict(private=False))


@pytest.fixture
def hostile() -> Iterator[Hostile]:
    with hostile_provider() as provider:
        yield provider


def come(hostile: Hostile, league: Provider) -> Whom:
    answer, browser = hostile.go(league)
    return league.arrive(answer, browser=browser, user_id=None)[0]


def test_who_tells_the_truth_is_believed(hostile: Hostile) -> None:
    league = hostile.league()
    assert come(hostile, league) == Whom(hostile.issuer, "7", "")
    assert come(hostile, league).subject == "7"
    assert sorted(hostile.asked) == [DOCUMENT, "/jwks_uri", "/token_endpoint", "/token_endpoint"], (
        "what is known is kept"
    )


@pytest.mark.parametrize(
    ("claims", "sentence"),
    [
        ({"iss": "https://elsewhere.example"}, "of another provider than Hill School"),
        ({"aud": "another"}, "meant for somebody else"),
        ({"aud": "another", "azp": CLIENT}, "meant for somebody else"),
        ({"aud": [CLIENT, "another"], "azp": "another"}, "meant for somebody else"),
        ({"aud": [CLIENT, "another"]}, "meant for somebody else"),
        ({"nonce": "of yesterday"}, "belongs to another sign-in"),
        ({"nonce": None}, "belongs to another sign-in"),
        ({"exp": int(time.time()) - HOUR, "iat": int(time.time()) - 2 * HOUR}, "of another time"),
        ({"iat": int(time.time()) + HOUR}, "of another time"),
        ({"exp": None}, "of another time"),
        ({"exp": "soon"}, "of another time"),
        *(({name: number}, "of another time") for name in ("exp", "iat", "nbf") for number in (math.inf, math.nan)),
        ({"aud": [[CLIENT]]}, "meant for somebody else"),
        ({"aud": {CLIENT: 1}}, "meant for somebody else"),
        ({"sub": None}, "cannot be read"),
        ({"sub": ""}, "cannot be read"),
        ({"sub": 7}, "cannot be read"),
        ({"sub": ["7"]}, "cannot be read"),
        ({"sub": "7" * 256}, "cannot be read"),
        ({"sub": "7\n"}, "cannot be read"),
        ({"sub": "7\0"}, "cannot be read"),
        ({"at_hash": "AAAA"}, "cannot be read"),
    ],
)
def test_what_it_says_is_verified(hostile: Hostile, claims: dict[str, Any], sentence: str) -> None:
    hostile.claims = claims
    with pytest.raises(NotLetIn, match=sentence):
        come(hostile, hostile.league())


@pytest.mark.parametrize(
    ("sign", "sentence"),
    [
        (unsigned, "not signed in a way that proves anything"),
        (by_public_key, "not signed in a way that proves anything"),
        (by_another_key, "not signed by Hill School"),
        (by_unknown_key, "not signed by Hill School"),
        (lambda _: "x.y.z", "not signed in a way that proves anything"),
        (lambda _: "", "not signed in a way that proves anything"),
        (lambda _: None, "did not say who you are"),
        (lambda _: {"sub": "7"}, "did not say who you are"),
    ],
)
def test_who_signed_it_is_verified(hostile: Hostile, sign: Callable[[Any], Any], sentence: str) -> None:
    hostile.sign = sign
    with pytest.raises(NotLetIn, match=sentence):
        come(hostile, hostile.league())


def test_a_new_key_is_learnt_but_not_asked_for_by_everybody(hostile: Hostile, monkeypatch: pytest.MonkeyPatch) -> None:
    league = hostile.league()
    come(hostile, league)
    two = RSAKey.import_key({**OTHER.as_dict(private=False), "kid": "two"})
    hostile.keys, hostile.sign = [two.as_dict(private=False)], by_unknown_key
    with pytest.raises(NotLetIn, match="not signed by"):  # they were looked at just now
        come(hostile, league)
    monkeypatch.setattr(discovery, "REST", 0.0)
    assert come(hostile, league).subject == "7"


@pytest.mark.parametrize(
    "keys",
    [
        [],
        [{"kty": "oct", "k": "c2VjcmV0", "kid": "one"}],
        [{**KEY.as_dict(private=False), "use": "enc"}],
        [weak_key()],
        [7, None, {"kty": "RSA", "n": "!", "e": 3}],
        {"one": 1},
    ],
)
def test_keys_that_prove_nothing_are_none(hostile: Hostile, keys: Any) -> None:
    hostile.keys = keys
    with pytest.raises(Unreachable, match="Hill School does not answer as it should"):
        come(hostile, hostile.league())


def test_a_state_works_once_and_in_its_browser_only(hostile: Hostile) -> None:
    league = hostile.league()
    answer, browser = hostile.go(league)
    _, another = hostile.go(league)
    for wrong in ("", "x", another):
        with pytest.raises(NotLetIn, match="began in another browser"):
            league.arrive(answer, browser=wrong, user_id=None)
    with pytest.raises(NotLetIn, match="is over"):
        league.arrive(Answer(code="c", state="guessed"), browser=browser, user_id=None)
    answer2, browser2 = hostile.go(league)
    league.arrive(answer2, browser=browser2, user_id=None)
    with pytest.raises(NotLetIn, match="was used already"):
        league.arrive(answer2, browser=browser2, user_id=None)
    with pytest.raises(NotLetIn, match="belongs to another sign-in"):  # a code of somebody else
        league.arrive(answer, browser=browser, user_id=None)


def test_who_takes_too_long_begins_again(hostile: Hostile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(visits, "SECONDS", 0)
    with pytest.raises(NotLetIn, match="This sign-in is over"):
        come(hostile, hostile.league())


def test_who_links_an_account_is_still_signed_in_as_it(hostile: Hostile) -> None:
    league = hostile.league()
    answer, browser = hostile.go(league, user_id=3)
    with pytest.raises(NotLetIn, match="no longer signed in"):
        league.arrive(answer, browser=browser, user_id=4)
    answer, browser = hostile.go(league, user_id=3)
    assert league.arrive(answer, browser=browser, user_id=3)[1]


@pytest.mark.parametrize(
    ("error", "problem", "sentence"),
    [
        ("access_denied", NotLetIn, "You did not sign in at Hill School"),
        ("server_error", Unreachable, "Hill School could not sign you in"),
        ("<b>call 555</b>", Unreachable, "Hill School could not sign you in"),
    ],
)
def test_what_a_browser_says_of_an_error_is_not_repeated(
    hostile: Hostile, error: str, problem: type[Exception], sentence: str
) -> None:
    league = hostile.league()
    answer, browser = hostile.go(league)
    with pytest.raises(problem, match=sentence):
        league.arrive(Answer(state=answer.state, error=error), browser=browser, user_id=None)


def test_an_answer_of_another_provider_is_noticed(hostile: Hostile) -> None:
    league = hostile.league()
    answer, browser = hostile.go(league)
    with pytest.raises(NotLetIn, match="of another provider"):
        league.arrive(Answer(code="c", state=answer.state, iss="https://x.example"), browser=browser, user_id=None)
    hostile.document = {"authorization_response_iss_parameter_supported": True}
    league = hostile.league()
    answer, browser = hostile.go(league)
    with pytest.raises(NotLetIn, match="of another provider"):  # it says that it gives its name, and did not
        league.arrive(answer, browser=browser, user_id=None)


@pytest.mark.parametrize(
    "document",
    [
        {"issuer": "https://accounts.elsewhere.example"},
        {"issuer": None},
        {"token_endpoint": "http://elsewhere.example/token"},
        {"token_endpoint": "file:///etc/passwd"},
        {"jwks_uri": None},
        {"authorization_endpoint": "javascript:alert(1)"},
        {"authorization_endpoint": "https://user:word@elsewhere.example/"},
        {"authorization_endpoint": "https://elsewhere.example/\r\nset-cookie: x"},
    ],
)
def test_what_it_says_of_itself_is_verified(hostile: Hostile, document: dict[str, Any]) -> None:
    hostile.document = document
    with pytest.raises(Unreachable, match="does not answer as it should"):
        hostile.league().begin(back="http://127.0.0.1:1/oidc", user_id=None)


def test_nobody_is_led_elsewhere(hostile: Hostile) -> None:
    with hostile_provider() as elsewhere:
        for path, status in ((DOCUMENT, "301"), ("/token_endpoint", "307"), ("/jwks_uri", "302")):
            leads = elsewhere.issuer + path
            hostile.answers = {path: lambda at, s=int(status), to=leads: reply(at, b"", status=s, location=to)}  # type: ignore[misc]
            with pytest.raises(Unreachable):
                come(hostile, hostile.league())
        assert elsewhere.asked == []


@pytest.mark.parametrize(
    ("told", "problem", "sentence"),
    [
        (b'{"error": "invalid_grant"}', NotLetIn, "is over, or was used"),
        (b'{"error": "invalid_client"}', Unreachable, "does not know this league"),
        (b'{"error": "<b>call 555</b>"}', Unreachable, "does not answer as it should"),
        (b'{"error": 7}', Unreachable, "does not answer as it should"),
        (b"no", Unreachable, "does not answer as it should"),
    ],
)
def test_why_it_refuses_is_told_where_that_is_a_word_of_the_standard(
    hostile: Hostile, told: bytes, problem: type[Exception], sentence: str, caplog: pytest.LogCaptureFixture
) -> None:
    hostile.answers = {"/token_endpoint": lambda at: reply(at, told, status=400)}
    with pytest.raises(problem, match=sentence):
        come(hostile, hostile.league())
    assert "555" not in caplog.text


def test_a_proxy_is_not_asked_for_what_is_here_and_no_clock_is_left_running(
    hostile: Hostile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")  # where nobody listens
    monkeypatch.delenv("no_proxy", raising=False)
    come(hostile, hostile.league())
    clocks = [thread for thread in threading.enumerate() if isinstance(thread, threading.Timer)]
    for clock in clocks:
        clock.join(3.0)
    assert not any(clock.is_alive() for clock in clocks)


@pytest.mark.parametrize(
    "answer",
    [
        lambda at: reply(at, b'{"issuer": "' + b"x" * fetch.MOST + b'"}'),
        lambda at: reply(at, b"<!doctype html><p>Sign in to the guest network"),
        lambda at: reply(at, b"[" * 100_000),
        lambda at: reply(at, b"[]"),
        lambda at: reply(at, b"\xff\xfe"),
        lambda at: reply(at, b'{"error": "temporarily_unavailable"}', status=503),
        lambda at: at.wfile.write(b"HTTP/1.1 nonsense\r\n\r\n"),
        lambda at: None,
    ],
)
@pytest.mark.parametrize("path", [DOCUMENT, "/token_endpoint"])
def test_answers_that_are_none(hostile: Hostile, path: str, answer: Callable[[BaseHTTPRequestHandler], None]) -> None:
    hostile.answers = {path: answer}
    with pytest.raises(Unreachable, match="does not answer as it should"):
        come(hostile, hostile.league())


def test_an_answer_without_end_is_not_read_to_its_end(hostile: Hostile) -> None:
    sent = 0

    def endless(at: BaseHTTPRequestHandler) -> None:
        nonlocal sent
        at.send_response(200)
        at.end_headers()
        with suppress(OSError):  # nobody listens any more
            while True:
                sent += at.wfile.write(b" " * 65536)

    hostile.answers = {DOCUMENT: endless}
    with pytest.raises(Unreachable):
        hostile.league().begin(back="x", user_id=None)
    assert sent < 64 << 20


@pytest.mark.parametrize("is_silent", [True, False])
def test_a_slow_provider_holds_nobody_for_long(
    hostile: Hostile, is_silent: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fetch, "WAIT", 0.3)
    monkeypatch.setattr(fetch, "ALTOGETHER", 0.6)

    def drip(at: BaseHTTPRequestHandler) -> None:
        with suppress(OSError):  # it was cut
            for _ in range(100):  # headers, one sign at a time
                at.wfile.write(b"" if is_silent else b"H")
                at.wfile.flush()
                time.sleep(0.1)

    hostile.answers = {DOCUMENT: drip}
    league, began = hostile.league(), time.monotonic()
    for _ in range(3):  # who comes at once after a failure is not made to wait for another
        with pytest.raises(Unreachable):
            league.begin(back="x", user_id=None)
    assert time.monotonic() - began < 9  # it goes on for ten
    assert hostile.asked == [DOCUMENT]


def test_whom_a_league_lets_in(hostile: Hostile) -> None:
    true = {"sub": "7", "email": "ada@School.example", "email_verified": True, "groups": ["all", "pupils"], "is": True}
    league = hostile.league(domains=("@school.example",), claims=(("groups", "pupils"), ("is", "true")))
    hostile.userinfo = true
    assert come(hostile, league).subject == "7"
    for wrong in (
        {"email": "ada@evil-school.example"},
        {"email": "ada@school.example.evil"},
        {"email": "school.example"},
        {"email": None},
        {"email_verified": False},
        {"email_verified": "true"},
        {"groups": ["all"]},
        {"groups": "pupils and others"},
        {"groups": None},
        {"is": 1},
    ):
        hostile.userinfo = {**true, **wrong}
        with pytest.raises(NotLetIn, match="not one of those that this league lets in"):
            come(hostile, league)
    hostile.userinfo = {**true, "sub": "8"}  # of somebody else
    with pytest.raises(NotLetIn, match="cannot be read"):
        come(hostile, league)


@pytest.mark.parametrize(
    ("token", "userinfo", "is_in"),
    [
        ({"email": "ada@school.example"}, {"email": "ada@home.example", "email_verified": True}, False),
        ({"email_verified": True}, {"email": "ada@school.example", "email_verified": False}, False),
        ({"email_verified": True}, {"email": "ada@school.example"}, False),
        ({"email": "ada@home.example", "email_verified": True}, {"email": "ada@school.example"}, False),
        ({"email": "ada@school.example", "email_verified": False}, {"email_verified": True}, False),
        ({"email": "ada@school.example"}, {"email": "ada@school.example", "email_verified": True}, True),
        ({"email": "ada@school.example", "email_verified": True}, {}, True),
        ({}, {"email": "ada@school.example", "email_verified": True}, True),
    ],
)
def test_who_confirms_one_address_confirms_no_other(
    hostile: Hostile, token: dict[str, Any], userinfo: dict[str, Any], is_in: bool
) -> None:
    hostile.claims, hostile.userinfo = token, {"sub": "7", **userinfo}
    league = hostile.league(domains=("@school.example",))
    if is_in:
        assert come(hostile, league).subject == "7"
    else:
        with pytest.raises(NotLetIn, match="not one of those that this league lets in"):
            come(hostile, league)


@pytest.mark.parametrize(
    "told",
    [
        {"issuer": "http://school.example", "client": "x"},
        {"issuer": "https://school.example?x=1", "client": "x"},
        {"issuer": "ftp://school.example", "client": "x"},
        {"issuer": "https://school.example:port", "client": "x"},
        {"issuer": "https://school.example", "client": ""},
        {"issuer": "https://school.example", "client": "x", "label": "x" * 41},
        {"issuer": "https://school.example", "client": "x", "domains": ("school",)},
    ],
)
def test_settings_that_cannot_be(told: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        ProviderSettings(**told)


def test_a_secret_is_in_a_file_or_in_the_environment(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    file = tmp_path / "secret"
    file.write_text("s3cret\n")
    assert secret_of(file) == "s3cret"
    monkeypatch.setenv(SECRET, "other")
    with pytest.raises(ConfigError, match="and in a file"):
        secret_of(file)
    monkeypatch.setenv(SECRET, "other")
    assert secret_of(None) == "other"
    assert SECRET not in os.environ, "no job inherits it"
    for wrong in (tmp_path / "none", tmp_path):
        with pytest.raises(ConfigError, match="cannot be read"):
            secret_of(wrong)
    file.write_text("\n")
    with pytest.raises(ConfigError, match="holds no secret"):
        secret_of(file)
    assert "s3cret" not in repr(ProviderSettings(issuer="https://x.example", client="x", secret="s3cret"))
    assert claim_of("role=pupil=1") == ("role", "pupil=1")
    with pytest.raises(ConfigError, match="NAME=VALUE"):
        claim_of("role")
