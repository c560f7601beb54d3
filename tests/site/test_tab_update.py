"""A site published anew while a browser keeps the one before: tabs stay whole, and the next visit has the new one.

Needs `make site`, and skips where that was not run.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from built_page import NEEDS_THE_PAGE, PATIENCE, SITE, Files, hosted

from chromium import launched
from few_frames import FEW_FRAMES
from racecraft.site.__main__ import write_files
from until_true import until_true

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext

pytestmark = NEEDS_THE_PAGE

VERSIONS = "caches.keys().then((names) => names.length)"
MADE = "meta[name=made]"


class Cached(Files):
    """A host whose files browsers may keep for an hour, as many hosts say."""

    def end_headers(self) -> None:
        self.send_header("Cache-Control", "max-age=3600")
        super().end_headers()


def publish_anew(site: Path) -> None:
    """The same page, built another time: its parts have other names, and the old ones are gone."""
    assets = site / "assets"
    names = [path.name for path in assets.iterdir()]
    new = {name: f"anew-{name}" for name in names}
    for path in [*assets.glob("*.js"), *site.glob("*.html")]:
        text = path.read_text(encoding="utf-8")
        for name in names:
            text = text.replace(f"/{name}", f"/{new[name]}")
        path.write_text(text.replace("<head>", '<head><meta name="made" content="anew" />'), encoding="utf-8")
    for name in names:
        (assets / name).rename(assets / new[name])
    write_files(site)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("host") / "site"
    shutil.copytree(SITE, folder, ignore=shutil.ignore_patterns("docs", "lessons", "python"))
    write_files(folder)
    return folder


@pytest.fixture(scope="module")
def visitor(site: Path) -> Iterator[BrowserContext]:
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted(site.parent, Cached) as address, sync_playwright() as playwright:
        browser = launched(playwright)
        context = browser.new_context(base_url=address)
        context.set_default_timeout(PATIENCE)
        context.add_init_script(FEW_FRAMES)
        context.on("weberror", lambda error: complaints.append(str(error.error)))
        yield context
        browser.close()
    assert complaints == []


def test_a_tab_keeps_its_version_and_the_last_tab_takes_the_new_one_when_it_is_loaded_again(
    visitor: BrowserContext, site: Path
) -> None:
    first = visitor.new_page()
    first.goto("./")
    until_true(first, "navigator.serviceWorker.controller !== null")
    publish_anew(site)
    second = visitor.new_page()
    second.goto("./")
    until_true(second, f"{VERSIONS}.then((count) => count === 2)")  # the new one is there, and waits
    assert second.locator(MADE).count() == 0
    first.get_by_role("button", name="Draw a track").click()
    first.get_by_role("dialog").get_by_role("button", name="Back").click()  # what the host has no more
    first.close()
    second.goto("./#replay")
    began = time.monotonic()
    while not second.locator(MADE).count():  # a tab that was closed may be there for another moment
        assert time.monotonic() - began < PATIENCE / 1000
        second.reload()
        second.get_by_role("button", name="Train", exact=True).wait_for()
    until_true(second, f"{VERSIONS}.then((count) => count === 1)")
    assert second.url.endswith("#replay")
    second.get_by_role("button", name="Draw a track").click()
    second.get_by_role("dialog").get_by_role("button", name="Back").click()
    assert second.evaluate("crossOriginIsolated")
    second.close()
