"""Every page of a league has a title of its own, in the browser's tabs, its history, and to who hears it read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from browsers import needs_browser, needs_pages
from leagues import ok, running_league
from running_consoles import PATIENCE

from chromium import launched

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


def test_pages_of_a_league_have_titles_of_their_own(tmp_path: Path) -> None:
    from playwright.sync_api import expect, sync_playwright

    with running_league(tmp_path / "runs") as league, sync_playwright() as playwright:
        group = league.group("Class 9b")
        race = ok(league.owner.post(f"/api/groups/{group}/races", json={"title": "Spring cup", "track": "oval"}), 201)[
            "id"
        ]
        browser = launched(playwright)
        try:
            for locale, ours in (("en-GB", ("League", "Audit log")), ("de-DE", ("Liga", "Protokoll"))):
                page = browser.new_context(locale=locale).new_page()
                page.set_default_timeout(1000 * PATIENCE)
                cookie = {"name": "racecraft_session", "value": league.owner.cookies["racecraft_session"]}
                address = str(league.owner.base_url).rstrip("/")
                page.context.add_cookies([{**cookie, "url": address}])
                page.route("**/api/tracks", lambda route: None)  # whose answer is slow: no card says a name meanwhile
                for path in ("/league", f"/league/{race}"):
                    page.goto(address + path)
                    expect(page.locator("main")).to_contain_text(re.compile("Paperclip"), timeout=30_000)
                    assert not re.search(r"\boval\b", page.locator("main").inner_text())
                page.unroute("**/api/tracks")
                for path, title in (
                    ("/league", ours[0]),
                    (f"/league/{race}", "Spring cup"),
                    (f"/league/{race}/screen", "Spring cup"),
                    (f"/groups/{group}", "Class 9b"),
                    (f"/groups/{group}/season", r".+: Class 9b"),
                    ("/league/audit", ours[1]),
                ):
                    page.goto(address + path)
                    expect(page).to_have_title(re.compile(rf"^{title} · Racecraft$"), timeout=30_000)
                page.go_back(wait_until="commit")
                expect(page).to_have_title(re.compile(r".+: Class 9b · Racecraft$"), timeout=30_000)
        finally:
            browser.close()
