"""Sign-in through a school's provider in a real browser, which takes the provider and the league for two sites."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest
from browsers import THEMES, Visit, needs_axe, needs_browser, needs_pages, violations_by_theme
from identity_providers import CLIENT, SECRET, identity_provider, needs_identity_provider
from leagues import RunningLeague, ok, running_league
from running_consoles import PATIENCE

from chromium import launched

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = [pytest.mark.slow, needs_pages, needs_browser, needs_identity_provider]

NAME = "Hill School"


class School:
    """A league and its provider, and browsers that know neither."""

    def __init__(self, league: RunningLeague, browser: Browser) -> None:
        self.league, self._browser = league, browser
        self.complaints: list[str] = []

    def visit(self, *, locale: str = "en-GB") -> Visit:
        context = self._browser.new_context(locale=locale)
        context.route("**/*googleapis*", lambda route: route.abort())  # letters of the provider's pages
        page = context.new_page()
        page.set_default_timeout(1000 * PATIENCE)
        visit = Visit(self.league.console, page)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        return visit


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[School]:
    from playwright.sync_api import sync_playwright

    folder = tmp_path_factory.mktemp("school")
    (folder / "secret").write_text(SECRET)
    with identity_provider() as issuer, sync_playwright() as playwright:
        told = {"": issuer, "-client": CLIENT, "-secret-file": str(folder / "secret"), "-name": NAME, "-group": "1"}
        told["-domain"] = "school.example"
        options = [part for name, value in told.items() for part in (f"--provider{name}", value)]
        with running_league(folder / "runs", *options) as league:
            browser = launched(playwright)
            assert league.group("Class 7b") == 1
            school = School(league, browser)
            yield school
            browser.close()
            assert school.complaints == []


def sign_in_there(page: Page, name: str) -> None:
    """At the provider, from its first form to the way back."""
    page.locator("[name=login]").fill(name)
    page.locator("[name=password]").fill("x")
    page.get_by_role("button", name="Sign-in").click()
    agree_there(page)


def agree_there(page: Page) -> None:
    """Of who is known there already no more is asked."""
    page.get_by_role("button", name="Continue").click()


def newcomer(school: School, name: str, chosen: str, *, locale: str = "en-GB") -> Visit:
    visit = school.visit(locale=locale)
    page = visit.open("/")
    page.get_by_role("button", name=NAME).click()
    sign_in_there(page, name)
    page.locator("input[autocomplete=nickname]").fill(chosen)
    page.locator("form button.primary").click()
    page.get_by_role("link", name="Class 7b").first.wait_for()
    return visit


def test_in_and_out_and_in_again(school: School) -> None:
    page = newcomer(school, "ada", "Comet").page
    assert page.evaluate("location.pathname + location.search") == "/league"
    page.goto(f"{school.league.owner.base_url}/me")
    page.get_by_text("You have no other way in.").wait_for()
    page.get_by_role("button", name="Sign out", exact=True).click()
    page.get_by_role("button", name=f"Come in through {NAME}").click()
    agree_there(page)
    page.get_by_role("link", name="Class 7b").first.wait_for()
    page.go_back()  # what it brought is gone from where one was
    page.wait_for_url(lambda url: "code=" not in url)


def test_a_card_is_linked_and_unlinked(school: School) -> None:
    visit = school.visit()
    page = visit.page
    secret = ok(school.league.owner.post("/api/groups/1/members", json={"people": [{"name": "Turbo"}]}), 201)[0]["link"]
    page.goto(secret)
    page.get_by_role("link", name="Class 7b").first.wait_for()
    page.goto(f"{school.league.owner.base_url}/me")
    page.get_by_role("button", name="Link it").click()
    sign_in_there(page, "bob")
    page.get_by_text(f"From now on you come in through {NAME}, too.").wait_for()
    page.get_by_role("heading", name="Turbo").wait_for()
    page.get_by_role("button", name="Unlink it").click()
    page.get_by_role("button", name="Link it").wait_for()


def test_who_is_refused_is_told_why_and_may_begin_again(school: School) -> None:
    page = school.visit(locale="de-DE").open("/")
    page.get_by_role("button", name=f"Rein über {NAME}").click()
    sign_in_there(page, "eve-elsewhere")
    page.get_by_text("gehört nicht zu denen, die diese Liga hereinlässt").wait_for()
    page.get_by_role("button", name="Noch einmal").wait_for()
    page.get_by_role("link", name="Anders hereinkommen").click()
    page.get_by_role("button", name="Passwort").wait_for()


def test_a_teacher_locks_out_and_lets_in_again(school: School) -> None:
    pupil = newcomer(school, "carl", "Rocket").page
    ok(school.league.owner.post("/api/groups/1/members", json={"people": [{"name": "Wheel"}]}), 201)
    teacher = school.visit()
    cookie = {"name": "racecraft_session", "value": school.league.owner.cookies["racecraft_session"]}
    teacher.page.context.add_cookies([{**cookie, "url": str(school.league.owner.base_url)}])
    page = teacher.open("/groups/1")
    row = page.get_by_role("region", name="People").get_by_role("row", name="Rocket")
    row.get_by_text(f"through {NAME}").wait_for()
    assert row.get_by_role("button", name="Print a card").count() == 0
    row.get_by_role("button", name="Lock out").click()
    row.get_by_text("locked out").wait_for()
    pupil.goto(f"{school.league.owner.base_url}/league")
    pupil.get_by_role("button", name=f"Come in through {NAME}").click()
    agree_there(pupil)
    pupil.get_by_role("alert").get_by_text("You are locked out.").wait_for()
    row.get_by_role("button", name="Let in again").click()
    row.get_by_role("button", name="Lock out").wait_for()
    page.get_by_role("button", name=re.compile("Print [0-9]+ cards")).click()
    page.get_by_text("No card for").get_by_text("Rocket").wait_for()
    assert "Wheel" in page.locator(".sheet").inner_text()
    page.get_by_role("button", name="Done").click()
    pupil.get_by_role("button", name="Begin again").click()
    agree_there(pupil)
    pupil.get_by_role("link", name="Class 7b").first.wait_for()


@pytest.fixture(scope="module")
def flaws(school: School) -> dict[str, dict[str, Any]]:
    """What axe finds in each theme on narrow German pages that are opened once for both; none sticks out."""
    found: dict[str, dict[str, Any]] = {theme: {} for theme in THEMES}

    def look(what: str, visit: Visit) -> None:
        visit.page.set_viewport_size({"width": 390, "height": 844})
        assert visit.overflow() == 0, what
        for theme, there in violations_by_theme(visit.page).items():
            found[theme] |= {what: there} if there else {}

    visit = school.visit(locale="de-DE")
    page = visit.open("/")
    page.get_by_role("button", name=NAME).wait_for()
    look("the door", visit)
    page.get_by_role("button", name=NAME).click()
    sign_in_there(page, "dora")
    page.locator("input[autocomplete=nickname]").wait_for()
    look("a name", visit)
    page.locator("input[autocomplete=nickname]").fill("Nova")
    page.locator("form button.primary").click()
    page.get_by_role("link", name="Class 7b").first.wait_for()
    page.goto(f"{school.league.owner.base_url}/me")
    page.get_by_role("heading", name=NAME).wait_for()
    look("an account", visit)
    page.goto(f"{school.league.owner.base_url}/oidc?error=access_denied&state=x")
    page.get_by_role("alert").wait_for()
    look("a refusal", visit)
    return found


@needs_axe
@pytest.mark.parametrize("theme", THEMES)
def test_axe_finds_nothing_serious_and_nothing_sticks_out(flaws: dict[str, dict[str, Any]], theme: str) -> None:
    assert flaws[theme] == {}
