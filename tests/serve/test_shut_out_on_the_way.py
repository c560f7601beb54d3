"""Who is shut out in the moment in which they come in, by card, password or provider, is not in afterwards."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from racecraft.serve.app import create_app
from racecraft.serve.people.keys import Keys
from racecraft.serve.people.people import add_person
from racecraft.serve.provider.provider import Provider
from racecraft.serve.provider_settings import ProviderSettings
from racecraft.serve.settings import ServeSettings

SCHOOL = ProviderSettings(issuer="http://127.0.0.1:9", client="league", label="Hill School")
PASSWORD = "correct horse"


@pytest.fixture
def app(tmp_path: Path) -> Iterator[FastAPI]:
    app = create_app(ServeSettings(runs=tmp_path / "runs", league=True, provider=SCHOOL), hosts={"league"})
    yield app
    app.state.context.database.close()


@pytest.fixture
def ada(app: FastAPI) -> int:
    with app.state.context.database.transaction() as session:
        return add_person(session, "Ada")


def knock(app: FastAPI, path: str, told: dict[str, str]) -> httpx.Response:
    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://league") as client:
            return await client.post(f"/api/door/{path}", json=told)

    return asyncio.run(ask())


def by_card(app: FastAPI, ada: int, _: pytest.MonkeyPatch) -> tuple[str, dict[str, str]]:
    return "card", {"secret": app.state.consoles.keys.print_card(ada)}


def by_password(app: FastAPI, ada: int, _: pytest.MonkeyPatch) -> tuple[str, dict[str, str]]:
    assert app.state.consoles.people.set_password(ada, PASSWORD, old="")
    return "sign-in", {"name": "Ada", "password": PASSWORD}


def by_provider(app: FastAPI, ada: int, monkeypatch: pytest.MonkeyPatch) -> tuple[str, dict[str, str]]:
    app.state.consoles.identities.link(ada, SCHOOL.issuer, "7")
    whom = SimpleNamespace(issuer=SCHOOL.issuer, subject="7", session="")
    monkeypatch.setattr(Provider, "arrive", lambda *_, **__: (whom, False))
    return "provider/arrival", {"code": "any", "state": "any"}


Shut = Callable[[FastAPI, int], Any]
OUT: dict[str, Shut] = {
    "locked out": lambda app, ada: app.state.consoles.keys.revoke(ada),
    "gone": lambda app, ada: app.state.consoles.people.remove(ada),
}


@pytest.mark.costly
@pytest.mark.parametrize("out", OUT)
@pytest.mark.parametrize("way", [by_card, by_password, by_provider])
def test_who_is_shut_out_on_the_way_in_has_no_session(
    app: FastAPI, ada: int, monkeypatch: pytest.MonkeyPatch, way: Any, out: str
) -> None:
    meet(app, ada, monkeypatch, OUT[out], *way(app, ada, monkeypatch))


@pytest.mark.costly
def test_nor_who_comes_by_a_card_or_a_password_that_is_another_by_then(
    app: FastAPI, ada: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    meet(
        app, ada, monkeypatch, lambda app, ada: app.state.consoles.keys.print_card(ada), *by_card(app, ada, monkeypatch)
    )
    reset = app.state.consoles.keys.make_reset(ada)
    told = by_password(app, ada, monkeypatch)
    meet(app, ada, monkeypatch, lambda app, _: app.state.consoles.keys.use_reset(reset, "another's hash"), *told)


def meet(app: FastAPI, ada: int, monkeypatch: pytest.MonkeyPatch, shut: Shut, path: str, told: dict[str, str]) -> None:
    """Come in, which works; and once more, while somebody is shut out after what they show was looked at."""
    assert knock(app, path, told).status_code == 200
    opened = Keys.open_session

    def late(keys: Keys, user_id: int, **settings: Any) -> str:
        shut(app, ada)
        return opened(keys, user_id, **settings)

    with monkeypatch.context() as patch:
        patch.setattr(Keys, "open_session", late)
        reply = knock(app, path, told)
    assert (reply.status_code, "locked out" in reply.text) == (401, True)
    assert not reply.cookies
    assert len(app.state.consoles.keys.sessions(ada, this="")) <= 1, "no more than the one of before"
    (line,) = app.state.consoles.audit.latest(1)
    assert line.what.endswith("_failed")
