"""Who sends a request byte by byte is waited for as long as a slow line may take, and no longer."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
from uvicorn.config import Config
from uvicorn.server import ServerState

from racecraft.serve.app import create_app
from racecraft.serve.door import bodies, prompt
from racecraft.serve.door.prompt import PromptProtocol
from racecraft.serve.settings import ServeSettings

PAUSE = 0.4
SIGN_IN = b'{"name": "nobody", "password": "long enough"}'


@asynccontextmanager
async def a_league(folder: Path) -> AsyncIterator[tuple[str, int]]:
    """A server of a league; yields where it listens."""
    app = create_app(ServeSettings(runs=folder / "runs", league=True), hosts={"league"})
    config, state = Config(app, lifespan="off", log_level="critical", timeout_keep_alive=60), ServerState()
    config.load()
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: PromptProtocol(config, state, {}), "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()
    finally:
        server.close()
        app.state.context.database.close()


async def dripped(at: tuple[str, int], path: str, *, length: int | None, parts: Sequence[bytes], every: float) -> str:
    """What is answered to a body in parts, until the server hangs up; empty where it never does."""
    reader, writer = await asyncio.open_connection(*at)
    framing = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    head = f"POST {path} HTTP/1.1\r\nHost: league\r\nContent-Type: application/json\r\n{framing}\r\n\r\n"
    writer.write(head.encode())

    async def drip() -> None:
        with suppress(ConnectionError):
            for part in parts:
                writer.write(part if length is not None else b"%x\r\n%b\r\n" % (len(part), part))
                await writer.drain()
                await asyncio.sleep(every)

    dripping = asyncio.ensure_future(drip())
    heard = b""
    try:
        async with asyncio.timeout(10.0):
            with suppress(ConnectionError):
                while said := await reader.read(4096):
                    heard += said
        return heard.decode()
    except TimeoutError:
        return ""
    finally:
        dripping.cancel()
        writer.close()


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bodies, "PAUSE", PAUSE)
    monkeypatch.setattr(prompt, "PATIENCE", PAUSE)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("length", [30_000, None], ids=["of a length", "in chunks"])
@pytest.mark.parametrize(
    "parts",
    [[b""], [b"{"] + [b" "] * 600, [SIGN_IN[:20] + b" " * 20_000] + [b" "] * 600],
    ids=["nothing", "byte by byte", "much and then little"],
)
@pytest.mark.costly
def test_a_body_that_does_not_end_is_not_waited_for(tmp_path: Path, length: int | None, parts: list[bytes]) -> None:
    async def ask() -> str:
        async with a_league(tmp_path) as at:
            shown = [part for part in parts if part or length is not None]  # an empty chunk is the end
            return await dripped(at, "/api/door/sign-in", length=length, parts=shown, every=0.05)

    heard = asyncio.run(ask())
    assert heard.startswith("HTTP/1.1 408")
    assert "send it again" in heard
    assert "connection: close" in heard.lower()


@pytest.mark.usefixtures("impatient")
def test_the_rest_of_a_request_that_is_refused_at_once_is_not_waited_for(tmp_path: Path) -> None:
    async def ask() -> str:
        async with a_league(tmp_path) as at:
            return await dripped(at, "/api/models", length=1000, parts=[b" "] * 600, every=0.05)

    assert asyncio.run(ask()).startswith("HTTP/1.1 401")


@pytest.mark.costly
@pytest.mark.usefixtures("impatient")
def test_a_slow_line_gets_everything_through(tmp_path: Path) -> None:
    """It takes several times the pause, at ten times the least rate."""
    body = SIGN_IN + b" " * (20_000 - len(SIGN_IN))
    parts = [body[begin : begin + 500] for begin in range(0, len(body), 500)]

    async def answer() -> str:
        async with a_league(tmp_path) as at:
            reader, writer = await asyncio.open_connection(*at)
            writer.write(b"POST /api/door/sign-in HTTP/1.1\r\nHost: league\r\nContent-Type: application/json\r\n")
            writer.write(b"Content-Length: %d\r\n\r\n" % len(body))
            for part in parts:
                writer.write(part)
                await asyncio.sleep(0.05)
            try:
                return (await asyncio.wait_for(reader.readuntil(b"\r\n"), 10.0)).decode()
            finally:
                writer.close()

    assert asyncio.run(answer()).startswith("HTTP/1.1 401")
