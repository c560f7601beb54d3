"""The page as `make site` built it, from a host that knows nothing but files, and what its tests need."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from chromium import CHROMIUM, launched
from few_frames import FEW_FRAMES

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]
SITE = ROOT / "build" / "site"
AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
PATIENCE = 180_000  # ms; the machine may be busy

NEEDS_THE_PAGE = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SITE / "data" / "plan.json").exists(), reason="the page is not built: make site"),
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here"),
]


class Files(http.server.SimpleHTTPRequestHandler):
    """A static host, below a path of its own."""

    def log_message(self, *_: object) -> None:
        """Says nothing."""


@contextmanager
def hosted(folder: Path = SITE.parent, files: type[Files] = Files) -> Iterator[str]:
    """The address of the page, while a host serves the folder that its site lies in."""
    host = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(files, directory=str(folder)))
    threading.Thread(target=host.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{host.server_port}/site/"
    finally:
        host.shutdown()
        host.server_close()


@contextmanager
def opened_page(**context: Any) -> Iterator[Page]:
    """The page in English, without motion and with few frames; what it complains of fails whoever opened it."""
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted() as address, sync_playwright() as playwright:
        here = launched(playwright).new_context(base_url=address, locale="en-US", reduced_motion="reduce", **context)
        here.set_default_timeout(PATIENCE)
        here.add_init_script(FEW_FRAMES)
        page = here.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto("./")
        yield page
        here.close()
    assert complaints == []
