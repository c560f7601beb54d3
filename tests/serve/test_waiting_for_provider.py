"""A provider that hangs while a whole school wants in: everybody else's requests are answered as ever."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import httpx
import pytest

from racecraft.serve.app import create_app
from racecraft.serve.provider import provider as providers
from racecraft.serve.provider.discovery import Discovery
from racecraft.serve.provider.fetch import NoAnswer
from racecraft.serve.provider_settings import ProviderSettings
from racecraft.serve.settings import ServeSettings

SCHOOL = 60  # more than the server has threads
SOON = 20.0  # s
SIGN_IN = {"name": "nobody", "password": "long enough"}
OUT = {"logout_token": "e30.e30.e30"}


def test_who_waits_for_a_provider_takes_no_thread_from_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    provider = ProviderSettings(issuer="http://127.0.0.1:9", client="league", label="Hill School")
    app = create_app(ServeSettings(runs=tmp_path / "runs", league=True, provider=provider), hosts={"league"})
    monkeypatch.setattr(providers, "PATIENCE", 100 * SOON)
    lock, answers, asking, most = threading.Lock(), threading.Event(), 0, 0

    def hang(_: object, **__: object) -> None:
        nonlocal asking, most
        with lock:
            asking += 1
            most = max(most, asking)
        answers.wait(10 * SOON)
        with lock:
            asking -= 1
        raise NoAnswer("it hung")

    monkeypatch.setattr(Discovery, "endpoints", hang)
    monkeypatch.setattr(Discovery, "keys", hang)

    async def attack() -> None:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://league") as client:
            begun = [client.post("/api/door/provider") for _ in range(SCHOOL)]
            begun += [client.post("/api/door/provider/sign-out", data=OUT) for _ in range(SCHOOL)]
            going = [asyncio.create_task(one) for one in begun]
            try:
                while most == 0:
                    await asyncio.sleep(0.01)
                async with asyncio.timeout(SOON):
                    assert (await client.post("/api/door/sign-in", json=SIGN_IN)).status_code == 401
                assert not any(one.done() for one in going)
            finally:
                answers.set()
            told = [reply.status_code for reply in await asyncio.gather(*going)]
            assert set(told) == {502}
            assert 1 <= most <= providers.AT_ONCE

    try:
        asyncio.run(attack())
    finally:
        app.state.context.database.close()


def test_who_gets_no_place_is_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    provider = ProviderSettings(issuer="http://127.0.0.1:9", client="league", label="Hill School")
    app = create_app(ServeSettings(runs=tmp_path / "runs", league=True, provider=provider), hosts={"league"})
    monkeypatch.setattr(providers, "PATIENCE", 0.05)

    async def attack() -> None:
        there = app.state.consoles.provider
        places = [there.place() for _ in range(providers.AT_ONCE)]
        for place in places:
            await place.__aenter__()
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://league") as client:
            reply = await client.post("/api/door/provider")
            assert (reply.status_code, "Too many people sign in" in reply.text) == (429, True)
            for place in places:
                await place.__aexit__(None, None, None)
            assert (await client.post("/api/door/provider")).status_code == 502

    try:
        asyncio.run(attack())
    finally:
        app.state.context.database.close()
