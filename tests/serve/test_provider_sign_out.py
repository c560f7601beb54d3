"""A provider says that it has signed somebody out: only it can, and only those who came through it are."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
import sqlalchemy as sa
from hostile_providers import CLIENT, Hostile, by_another_key, by_public_key, by_unknown_key, hostile_provider, unsigned

from racecraft.serve.people.identities import Identities
from racecraft.serve.people.keys import Keys
from racecraft.serve.people.people import add_person
from racecraft.serve.problems import NotLetIn
from racecraft.serve.provider.logout_token import EVENT, MAX_AGE, SignedOut
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Session

HOUR = 3600


@pytest.fixture
def hostile() -> Iterator[Hostile]:
    with hostile_provider() as provider:
        yield provider


def claims_of(hostile: Hostile, **other: Any) -> dict[str, Any]:
    """Of a token that is good, but for what is told; None leaves something out."""
    now = int(time.time())
    good = {"iss": hostile.issuer, "aud": CLIENT, "iat": now, "exp": now + 120, "jti": "1", "sub": "7", "sid": "s"}
    return {name: value for name, value in {**good, "events": {EVENT: {}}, **other}.items() if value is not None}


def test_who_tells_the_truth_is_believed(hostile: Hostile) -> None:
    league, now = hostile.league(), datetime.now(UTC)
    told = league.signed_out(hostile.sign(claims_of(hostile)))
    assert (told.subject, told.session) == ("7", "s")
    assert timedelta(seconds=55) < told.before - now < timedelta(seconds=65), "two clocks may differ by a minute"
    for more in ({"sid": None}, {"sub": None}, {"aud": ["another", CLIENT]}, {"exp": None}):
        assert isinstance(league.signed_out(hostile.sign(claims_of(hostile, **more))), SignedOut)


@pytest.mark.parametrize(
    ("claims", "sentence"),
    [
        ({"iss": "https://elsewhere.example"}, "another iss than it should"),
        ({"aud": "another"}, "another aud than it should"),
        ({"aud": None}, "another aud than it should"),
        ({"iat": None}, "another iat than it should"),
        ({"iat": "now"}, "another iat than it should"),
        ({"iat": int(time.time()) + HOUR}, "another iat than it should"),
        ({"iat": int(time.time()) - MAX_AGE - 120}, "no longer good"),
        ({"iat": float("nan")}, "cannot be read|another iat"),
        ({"iat": -1e300}, "cannot be read|no longer good"),
        ({"exp": int(time.time()) - HOUR}, "no longer good"),
        ({"jti": None}, "another jti than it should"),
        ({"jti": 7}, "another jti than it should"),
        ({"events": None}, "is no logout token"),
        ({"events": {}}, "is no logout token"),
        ({"events": {EVENT: 7}}, "is no logout token"),
        ({"events": [EVENT]}, "is no logout token"),
        ({"nonce": "n"}, "is no logout token"),
        ({"sub": None, "sid": None}, "names nobody"),
        ({"sub": "", "sid": ""}, "names nobody"),
        ({"sub": 7}, "another sub|cannot be read"),
        ({"sid": ["s"]}, "cannot be read"),
        ({"sid": "s" * 256}, "cannot be read"),
        ({"sub": "7\n"}, "cannot be read"),
    ],
)
def test_what_it_says_is_verified(hostile: Hostile, claims: dict[str, Any], sentence: str) -> None:
    with pytest.raises(NotLetIn, match=sentence):
        hostile.league().signed_out(hostile.sign(claims_of(hostile, **claims)))


@pytest.mark.parametrize("sign", [unsigned, by_public_key, by_another_key, by_unknown_key])
def test_who_signed_it_is_verified(hostile: Hostile, sign: Callable[[Any], Any]) -> None:
    with pytest.raises(NotLetIn, match="is not signed"):
        hostile.league().signed_out(sign(claims_of(hostile)))


@pytest.mark.parametrize("token", [None, "", 7, "ä.b.c", "x" * 20_000])
def test_what_is_no_token_costs_no_question(hostile: Hostile, token: Any) -> None:
    with pytest.raises(NotLetIn, match="no logout token"):
        hostile.league().signed_out(token)
    assert hostile.asked == []


def test_an_id_token_signs_nobody_out(hostile: Hostile) -> None:
    league = hostile.league()
    answer, browser = hostile.go(league)
    league.arrive(answer, browser=browser, user_id=None)
    with pytest.raises(NotLetIn):
        league.signed_out(hostile.says("/token_endpoint")["id_token"])


class Browsers:
    """Of Ada and Bob, who have come through a provider and in other ways."""

    def __init__(self, database: Database) -> None:
        self.keys, self.database = Keys(database), database
        with database.transaction() as session:
            self.ada, self.bob = (add_person(session, name, role="racer") for name in ("Ada", "Bob"))
        for user, subject in ((self.ada, "7"), (self.bob, "8")):
            Identities(database).link(user, "https://hill.example", subject)
        self.by_name = {
            name: self.keys.open_session(user, provider_session=came)
            for name, user, came in (
                ("card", self.ada, None),
                ("home", self.ada, "s1"),
                ("lab", self.ada, "s2"),
                ("nameless", self.ada, ""),
                ("bob", self.bob, "s3"),
            )
        }

    def end(self, *, issuer: str = "https://hill.example", **told: Any) -> tuple[list[int], set[str]]:
        """Whose ended, and which are left."""
        told = {"subject": "", "provider_session": "", "before": datetime.now(UTC), **told}
        ended = self.keys.end_provider_sessions(issuer, **told)
        left = self.keys.open_sessions(self.by_name.values())
        return ended, {name for name, secret in self.by_name.items() if secret in left}


@pytest.fixture
def browsers(database: Database) -> Browsers:
    return Browsers(database)


def test_all_that_somebody_has_there_ends_and_nothing_else(browsers: Browsers) -> None:
    assert browsers.end(subject="7") == ([browsers.ada], {"card", "bob"})
    assert browsers.end(subject="7") == ([], {"card", "bob"})


def test_one_sign_in_ends(browsers: Browsers) -> None:
    assert browsers.end(provider_session="s2") == ([browsers.ada], {"card", "home", "nameless", "bob"})


def test_a_browser_whose_sign_in_has_no_name_ends_with_each_of_theirs(browsers: Browsers) -> None:
    assert browsers.end(subject="7", provider_session="s2") == ([browsers.ada], {"card", "home", "bob"})


@pytest.mark.parametrize(
    "told",
    [
        {"subject": "9"},
        {"subject": "8", "provider_session": "s1", "issuer": "https://other.example"},
        {"provider_session": "s9"},
        {"issuer": "https://other.example", "subject": "7"},
        {"subject": "7", "before": datetime.now(UTC) - timedelta(hours=1)},
    ],
)
def test_what_means_somebody_else_or_another_time_ends_nothing(browsers: Browsers, told: dict[str, Any]) -> None:
    assert browsers.end(**told) == ([], set(browsers.by_name))


def test_a_name_that_another_guesses_ends_only_ones_own(browsers: Browsers) -> None:
    assert browsers.end(subject="8", provider_session="s1") == ([], set(browsers.by_name))
    with browsers.database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Session)) == len(browsers.by_name)
