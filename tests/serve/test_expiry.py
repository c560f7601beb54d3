"""When what opens a league's door is over, to the second, and how soon whoever is shut out is gone."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa
from starlette.responses import PlainTextResponse, StreamingResponse

from racecraft.serve.door.guard import Guard
from racecraft.serve.groups import groups
from racecraft.serve.groups.groups import Groups
from racecraft.serve.people import keys as keys_module
from racecraft.serve.people import passwords, people
from racecraft.serve.people.keys import RESET_HOURS, SESSION_DAYS, Keys
from racecraft.serve.settings import COOKIE, ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Session, Token, User, now

ADA = 2
SECOND = timedelta(seconds=1)
HOST = "league.test"


class Clock:
    """Says what time it is to all that looks whether something is over."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.moment = now()
        for module in (keys_module, groups, people):
            monkeypatch.setattr(module, "now", lambda: self.moment)

    def at(self, moment: datetime) -> None:
        self.moment = moment


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    with database.transaction() as session:
        session.add(User(id=ADA, name="Ada", handle="ada", role="admin"))
        session.add(Group(id=1, title="Class"))
    yield database
    database.close()


@pytest.fixture
def keys(database: Database) -> Keys:
    return Keys(database)


@pytest.fixture
def make_guard(keys: Keys, tmp_path: Path) -> Callable[[], Guard]:
    """What stands at a league's door: one for every event loop, as a server has."""
    return lambda: Guard(keys, ServeSettings(runs=tmp_path / "runs", league=True), {HOST})


@pytest.fixture
def guard(make_guard: Callable[[], Guard]) -> Guard:
    return make_guard()


def asked(guard: Guard, *, cookie: str = "", token: str = "") -> httpx.Response:
    """What the door says to somebody who wants their models."""
    headers = {"cookie": f"{COOKIE}={cookie}"} if cookie else {"authorization": f"Bearer {token}"}

    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(guard.middleware(PlainTextResponse("in")))
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            return await client.get("/api/models", headers=headers)

    return asyncio.run(ask())


# ---- the end of a time


def test_a_session_lasts_thirty_days_and_no_second_longer(
    keys: Keys, guard: Guard, database: Database, clock: Clock
) -> None:
    began = clock.moment
    secret = keys.open_session(ADA)
    clock.at(began + timedelta(days=SESSION_DAYS) - SECOND)
    assert keys.session_user(secret) == ADA
    assert keys.open_sessions({secret}) == {secret}
    assert len(keys.sessions(ADA, this=secret)) == 1
    assert asked(guard, cookie=secret).text == "in"
    clock.at(began + timedelta(days=SESSION_DAYS))
    assert keys.session_user(secret) is None
    assert keys.open_sessions({secret}) == set(), "open streams end, too"
    assert keys.sessions(ADA, this=secret) == []
    reply = asked(guard, cookie=secret)
    assert reply.status_code == 401
    assert "not signed in" in reply.json()["error"]["message"]
    clock.at(began + timedelta(days=SESSION_DAYS) + SECOND)
    keys.open_session(ADA)
    with database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Session)) == 1, "what is over is not kept"


@pytest.mark.parametrize("scopes", [["read"], ["worker"]])
def test_a_token_lasts_as_many_days_as_it_was_made_for(
    keys: Keys, guard: Guard, database: Database, clock: Clock, scopes: list[Any]
) -> None:
    began = clock.moment
    number, secret = keys.make_token(ADA, title="", scopes=scopes, days=7)
    is_worker = scopes == ["worker"]
    clock.at(began + timedelta(days=7) - SECOND)
    bearer = keys.bearer(secret)
    assert bearer is not None
    assert (bearer.user_id, bearer.scopes) == (ADA, scopes)
    assert keys.worker_tokens() == ({number} if is_worker else set())
    assert asked(guard, token=secret).status_code == (403 if is_worker else 200)
    clock.at(began + timedelta(days=7))
    assert keys.bearer(secret) is None
    assert keys.worker_tokens() == set(), "a worker's jobs go to others"
    assert keys.tokens(ADA) == []
    reply = asked(guard, token=secret)
    assert reply.status_code == 401
    assert "no longer good" in reply.json()["error"]["message"]
    clock.at(began + timedelta(days=7) + SECOND)
    keys.make_token(ADA, title="", scopes=["read"], days=1)
    with database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Token)) == 1, "what is over is not kept"


def test_an_invitation_ends_with_its_hour(database: Database, clock: Clock) -> None:
    classes, began = Groups(database), clock.moment
    code = classes.open(1, role="racer", uses=40, hours=2).code
    clock.at(began + timedelta(hours=2) - SECOND)
    assert classes.join(code, "In time") is not None
    found = classes.joining(1)
    assert found is not None
    assert found.uses_left == 39
    clock.at(began + timedelta(hours=2))
    assert classes.join(code, "Too late") is None
    assert classes.joining(1) is None


def test_a_link_for_a_new_password_lasts_a_day(keys: Keys, clock: Clock) -> None:
    began = clock.moment
    secret = keys.make_reset(ADA)
    clock.at(began + timedelta(hours=RESET_HOURS) - SECOND)
    assert keys.reset_user(secret) == ADA
    clock.at(began + timedelta(hours=RESET_HOURS))
    assert keys.reset_user(secret) is None
    assert keys.use_reset(secret, "a hash") is None


def test_a_printed_card_is_good_until_it_is_revoked(keys: Keys, clock: Clock) -> None:
    secret, browser = keys.print_card(ADA), keys.open_session(ADA)
    _, token = keys.make_token(ADA, title="", scopes=["read"], days=365)
    clock.at(clock.moment + timedelta(days=SESSION_DAYS) - SECOND)
    assert keys.card_user(secret) == ADA
    keys.revoke(ADA)
    assert (keys.card_user(secret), keys.session_user(browser), keys.bearer(token)) == (None, None, None)
    assert keys.card_user(keys.print_card(ADA)) == ADA


# ---- within a second


@pytest.mark.costly
def test_who_is_shut_out_is_refused_at_once_and_their_streams_end_within_a_second(
    keys: Keys, make_guard: Callable[[], Guard]
) -> None:
    """Streams that were opened at different times between two looks; a machine that was busy may try three times."""
    took = [asyncio.run(_shut_out(keys, make_guard())) for _ in range(3)]
    assert min(took) < 1.0, took


async def _shut_out(keys: Keys, guard: Guard) -> float:
    """How long the last of six streams, three of a browser and three of a program, outlives being revoked, in s."""

    async def endless() -> AsyncIterator[str]:
        while True:
            yield "data: \n\n"
            await asyncio.sleep(0.02)

    async def follow(headers: dict[str, str]) -> float:
        app = guard.middleware(StreamingResponse(endless()))
        scope = {"type": "http", "method": "GET", "path": "/api/events/hers", "query_string": b"", "scheme": "http"}
        encoded = [(name.encode(), value.encode()) for name, value in {"host": HOST, **headers}.items()]
        open_end: asyncio.Future[Any] = asyncio.get_running_loop().create_future()

        async def receive() -> Any:
            return await asyncio.shield(open_end)

        async def send(_: Any) -> None:
            return None

        await app({**scope, "headers": encoded, "client": ("127.0.0.1", 1)}, receive, send)
        return time.monotonic()

    async def later(seconds: float, headers: dict[str, str]) -> float:
        await asyncio.sleep(seconds)
        return await follow(headers)

    cookie, (_, token) = keys.open_session(ADA), keys.make_token(ADA, title="", scopes=["read"], days=1)
    both = {"cookie": f"{COOKIE}={cookie}"}, {"authorization": f"Bearer {token}"}
    streams = [asyncio.create_task(later(0.17 * turn, headers)) for turn in range(3) for headers in both]
    await asyncio.sleep(0.51)
    assert not any(stream.done() for stream in streams)
    revoked = time.monotonic()
    keys.revoke(ADA)
    assert keys.session_user(cookie) is None
    assert keys.bearer(token) is None
    return max(await asyncio.wait_for(asyncio.gather(*streams), 30)) - revoked


# ---- passwords


def test_at_most_two_passwords_are_hashed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each takes 64 MB: thirty people who sign in at once would take two gigabytes."""

    class Hasher:
        def __init__(self) -> None:
            self.lock, self.now, self.most, self.all = threading.Lock(), 0, 0, 0

        def _work(self) -> None:
            with self.lock:
                self.now, self.all = self.now + 1, self.all + 1
                self.most = max(self.most, self.now)
            time.sleep(0.01)
            with self.lock:
                self.now -= 1

        def hash(self, _: str) -> str:
            self._work()
            return "kept"

        def verify(self, _: str, kept: str) -> bool:
            self._work()
            return kept == "kept"

    hasher = Hasher()
    monkeypatch.setattr(passwords, "_hasher", lambda: hasher)
    monkeypatch.setattr(passwords, "_nothing", lambda: "nobody's")
    with ThreadPoolExecutor(30) as pool:
        hashed = [pool.submit(passwords.hash_password, "a long password") for _ in range(10)]
        right = [pool.submit(passwords.is_password, "a long password", "kept") for _ in range(10)]
        nobody = [pool.submit(passwords.is_password, "a long password", "") for _ in range(10)]
        assert [one.result() for one in hashed] == ["kept"] * 10
        assert [one.result() for one in right] == [True] * 10
        assert [one.result() for one in nobody] == [False] * 10
    assert hasher.all == 30
    assert hasher.most == passwords.MOST_AT_ONCE == 2
