"""The lessons on a static host: their files, and a reader's way through two of them in a real browser.

The browser needs `make site`, and is left out where that was not run.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from built_page import AXE, PATIENCE, SITE, hosted

from chromium import CHROMIUM, launched
from racecraft.course import find_lesson, lessons
from racecraft.course.page import LessonFacts, LessonPage, facts_of, page_of
from racecraft.site.lessons import write_lessons

if TYPE_CHECKING:
    from playwright.sync_api import Page


def test_every_lesson_is_written_with_its_pictures(tmp_path: Path) -> None:
    write_lessons(tmp_path)
    index = json.loads((tmp_path / "index.json").read_bytes())
    assert [LessonFacts.model_validate(one) for one in index] == [facts_of(lesson) for lesson in lessons()]
    for lesson in lessons():
        page = LessonPage.model_validate_json((tmp_path / f"{lesson.path.stem}.json").read_bytes())
        assert page == page_of(lesson)
        drawn = {f"{one.name}.webp" for cell in page.cells for one in cell.outputs if one.kind == "picture"}
        for folder in (tmp_path, tmp_path / "de"):
            assert drawn == {path.name for path in (folder / page.name).iterdir()} != set()
    write_lessons(tmp_path)  # over what is there


@pytest.fixture
def page() -> Iterator[Page]:
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted() as address, sync_playwright() as playwright:
        browser = launched(playwright)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
        page.goto(f"{address}lessons.html")
        yield page
        browser.close()
    assert complaints == []


@pytest.mark.slow
@pytest.mark.skipif(not (SITE / "lessons" / "index.json").exists(), reason="the page is not built: make site")
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_a_reader_finds_the_way_and_what_was_read_stays_in_the_browser(page: Page) -> None:
    page.get_by_text("0 of 12 read").wait_for()
    page.get_by_text("is kept in this browser").wait_for()
    page.get_by_role("link", name="A table drives a car").click()
    page.get_by_role("button", name="One step").click()
    page.get_by_text("1 steps; worth here 0.00").wait_for()
    picture = page.get_by_role("img", name="A table learns to drive")
    picture.scroll_into_view_if_needed()
    assert picture.evaluate("one => one.decode().then(() => one.naturalWidth)") > 300
    for index, question in enumerate(find_lesson(5).facts.questions):
        choice = question.choices[question.answer]
        page.locator("fieldset").nth(index).get_by_label(choice.text.en, exact=True).check()
    page.get_by_text("quiz 100 %").wait_for()

    page.get_by_role("link", name="Where tables break").click()
    page.get_by_role("heading", name="Where tables break").wait_for()
    assert page.evaluate("scrollY") == 0
    page.reload()
    page.get_by_role("heading", name="Where tables break").wait_for()
    page.get_by_role("link", name="Course").first.click()
    page.get_by_text("1 of 12 read").wait_for()
    page.get_by_text("quiz 100 %").wait_for()

    page.set_viewport_size({"width": 390, "height": 900})
    page.get_by_label("Language").select_option("de")
    page.get_by_role("link", name="Eine Strategie ohne Werte").click()
    page.get_by_role("button", name="Eine Fahrt").click()
    page.get_by_text("1 Fahrten;").wait_for()
    page.get_by_role("heading", name="Noch einmal eine Reihe Spielautomaten").wait_for()
    page.get_by_text("✗ Noch nicht. Der erste Schritt bekam 1,").wait_for()
    picture = page.get_by_role("img", name="Wie lange der Stab steht")
    picture.scroll_into_view_if_needed()
    assert picture.evaluate("one => one.decode().then(() => one.naturalWidth)") > 300
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    if AXE.exists():
        page.evaluate(AXE.read_text())
        found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
        assert [one["id"] for one in found] == []
