"""The page in a tab, offered by the console: its files and nothing else, and nothing of the console for it."""

from __future__ import annotations

import asyncio
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from racecraft.serve import tab


class Asking:
    """Asks an application without a server."""

    def __init__(self) -> None:
        self._app = FastAPI()
        tab.offer(self._app)
        self._app.get("/{path:path}")(lambda path: "console")  # as the console answers all else

    def get(self, path: str) -> httpx.Response:
        async def ask() -> httpx.Response:
            transport = httpx.ASGITransport(self._app)
            address = "http://127.0.0.1:8000"
            async with httpx.AsyncClient(transport=transport, base_url=address, follow_redirects=True) as client:
                return await client.get(path)

        return asyncio.run(ask())


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Asking:
    site = tmp_path / "build" / "site"
    site.mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text("secret")
    (site / "files.js").write_text("self.FILES = [];")
    (site / "index.html").write_text("<h1>Watch</h1>")
    (site / "core.wasm").write_bytes(b"\0asm")
    monkeypatch.setattr(tab, "CHECKOUT", tmp_path)
    monkeypatch.setattr(tab, "SITE", site)
    return Asking()


def test_the_built_page_is_offered(client: Asking) -> None:
    reply = client.get("/tab")
    assert (reply.url.path, reply.text) == ("/tab/", "<h1>Watch</h1>")
    assert client.get("/tab/core.wasm").headers["content-type"] == "application/wasm"


def test_what_runs_in_it_may_ask_for_its_own_files_only(client: Asking) -> None:
    for path in ("/tab/", "/tab/files.js"):
        policy = client.get(path).headers["content-security-policy"]
        assert "connect-src 127.0.0.1:8000/tab/;" in policy


def test_every_file_lets_the_page_have_several_threads(client: Asking) -> None:
    for path in ("/tab/", "/tab/files.js"):
        headers = client.get(path).headers
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert headers["cross-origin-embedder-policy"] == "require-corp"


@pytest.mark.parametrize("path", ["/tab/../../pyproject.toml", "/tab/%2e%2e/%2e%2e/pyproject.toml"])
def test_nothing_outside_its_folder_is_read(client: Asking, path: str) -> None:
    assert "secret" not in client.get(path).text


def test_nothing_is_offered_where_it_is_not_built(client: Asking) -> None:
    (tab.SITE / "files.js").unlink()
    assert Asking().get("/tab").json() == "console"
