"""Who connects and asks nothing keeps no place in the server for long."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from uvicorn.config import Config
from uvicorn.server import ServerState

from racecraft.serve.door import prompt
from racecraft.serve.door.prompt import PromptProtocol

HEAD = b"GET / HTTP/1.1\r\nHost: x\r\n"


async def answer(scope: Any, receive: Any, send: Any) -> None:
    await asyncio.sleep(0.3)  # longer than a head may take
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


async def said_within(seconds: float, *parts: bytes) -> bytes | None:
    """What a server answers to these, one after the other; None where it leaves the connection open."""
    config = Config(answer, lifespan="off", log_level="critical", timeout_keep_alive=60)
    state = ServerState()
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: PromptProtocol(config, state, {}), "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
    heard = b""
    try:
        for part in parts:
            writer.write(part)
            await asyncio.sleep(0.05)
        async with asyncio.timeout(seconds):
            while said := await reader.read(1000):
                heard += said
        return heard
    except TimeoutError:
        return None
    finally:
        writer.close()
        server.close()


@pytest.mark.parametrize(
    "parts",
    [(), (HEAD,), (b"G", b"E", b"T"), (HEAD + b"\r\n", HEAD), (HEAD + b"\r\n", *[b""] * 10, HEAD)],
    ids=["nothing", "half a head", "byte by byte", "a second one at once", "a second one"],
)
def test_a_request_that_does_not_come_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, parts: tuple[bytes, ...]
) -> None:
    monkeypatch.setattr(prompt, "PATIENCE", 0.2)
    heard = asyncio.run(said_within(30.0, *parts))
    assert heard is not None, "it is still waited for"
    assert heard.count(b"200 OK") == any(b"\r\n\r\n" in part for part in parts)


def test_a_slow_answer_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prompt, "PATIENCE", 0.1)
    heard = asyncio.run(said_within(2.0, HEAD + b"Connection: close\r\n\r\n"))
    assert heard is not None
    assert heard.endswith(b"ok")
