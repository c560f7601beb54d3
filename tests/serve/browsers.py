"""A real headless Chromium, signed in to a running console, that notes every complaint of a page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
from running_consoles import PATIENCE, RunningConsole, running_console

from chromium import CHROMIUM, launched
from few_frames import FEW_FRAMES

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]
AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"
THEMES: Final = ("light", "dark")
needs_pages = pytest.mark.skipif(
    not (ROOT / "src" / "racecraft" / "serve" / "pages" / "index.html").exists(),
    reason="the pages are not built: make console builds them",
)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
needs_axe = pytest.mark.skipif(not AXE.exists(), reason="web/node_modules is not installed")


@dataclass
class Visit:
    """A tab."""

    console: RunningConsole
    page: Page
    complaints: list[str] = field(default_factory=list)

    def open(self, path: str, *, width: int = 1440, height: int = 900) -> Page:
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.goto(f"{self.console.client.base_url}{path}")
        self.page.locator("h1").wait_for()
        return self.page

    def look(self, theme: str, language: str = "en") -> None:
        """From the next page on."""
        if not self.page.url.startswith(str(self.console.client.base_url)):
            self.page.goto(f"{self.console.client.base_url}/settings")
        self.page.evaluate(
            "([theme, language]) => { localStorage.setItem('racecraft-theme', theme);"
            " localStorage.setItem('racecraft-language', language); }",
            [theme, language],
        )

    def violations(self) -> list[Any]:
        """What axe finds."""
        return violations(self.page)

    def overflow(self) -> int:
        """Pixels that the page is wider than the window."""
        return int(self.page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth"))

    def flaws(self, path: str) -> dict[str, Any]:
        """What axe finds on a wide and on a narrow page, and by how much it is too wide, by path and width."""
        found: dict[str, Any] = {}
        page = self.open(path)
        for width in (1440, 390):
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(600)
            if there := self.violations():
                found[f"{path} {width}"] = there
            if (pixels := self.overflow()) > 0:
                found[f"{path} {width} is too wide"] = pixels
        return found


def violations(page: Page) -> list[Any]:
    """What axe finds on a page."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text())
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
    return [(one["id"], [node["html"][:160] for node in one["nodes"][:3]]) for one in found]


def violations_by_theme(page: Page) -> dict[str, list[Any]]:
    """The same of a page that looks as the system does, in both themes."""
    found = {}
    for theme in THEMES:
        page.emulate_media(color_scheme=theme)
        page.locator(f"html[data-theme={theme}]").wait_for(state="attached")
        page.evaluate("Promise.all(document.getAnimations().map(one => one.finished.catch(() => {})))")
        found[theme] = violations(page)
    return found


def make_untrained(route: Any) -> None:
    """The same request, for a model that is made and not trained."""
    asked = route.request
    route.continue_(
        **({"post_data": json.dumps(asked.post_data_json | {"train": False})} if asked.method == "POST" else {})
    )


def complaints_of(message: Any) -> list[str]:
    """What a page's console says of an error, and of which address."""
    return [f"{message.text} {message.location['url']}"] if message.type == "error" else []


@contextmanager
def visiting(console: RunningConsole) -> Iterator[Visit]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = launched(playwright)
        context = browser.new_context()
        context.add_init_script(FEW_FRAMES)  # of every tab
        context.set_default_timeout(1000 * PATIENCE)
        page = context.new_page()
        cookie = console.client.cookies["racecraft_session"]
        page.context.add_cookies([{"name": "racecraft_session", "value": cookie, "url": str(console.client.base_url)}])
        visit = Visit(console, page)
        page.on("console", lambda message: visit.complaints.extend(complaints_of(message)))
        page.on("pageerror", lambda error: visit.complaints.append(str(error)))
        yield visit
        browser.close()


@contextmanager
def visiting_two_drivers(runs: Path) -> Iterator[Visit]:
    """A tab of a console whose models `ada` and `bob` have learned a little; nothing may have complained at the end."""
    with running_console(runs) as console, visiting(console) as visit:
        for name in ("ada", "bob"):
            console.create(name=name, track="oval", until="3000 steps", seed=ord(name[0]))
        for job in console.client.get("/api/jobs").json():
            assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        yield visit
        assert visit.complaints == []
