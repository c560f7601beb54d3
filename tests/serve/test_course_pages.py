"""A learner's way through three lessons in a real browser: reading, playing, answering, and what is kept of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from browsers import Visit, needs_axe, needs_browser, needs_pages, visiting
from running_consoles import running_console

from racecraft.course import find_lesson
from racecraft.course.shown import picture_path

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))  # nobody has solved anything yet
        with running_console(tmp_path_factory.mktemp("course") / "runs") as console, visiting(console) as visit:
            yield visit
            assert visit.complaints == []


def answer(page: Any, number: int, wrongly: int = 0) -> None:
    """Answer all questions, the first so many wrongly; each says why."""
    for index, question in enumerate(find_lesson(number).facts.questions):
        is_wrong = index < wrongly
        chosen = question.choices[(question.answer + is_wrong) % len(question.choices)]
        card = page.locator("fieldset").nth(index)
        card.get_by_label(chosen.text.en, exact=True).check()
        card.get_by_text("Not quite." if is_wrong else "Right.", exact=True).wait_for()
        card.get_by_text(chosen.why.en).wait_for()


@needs_axe
def test_a_learner_goes_through_three_lessons(visit: Visit) -> None:
    from playwright.sync_api import expect

    page = visit.open("/lessons")
    expect(page.get_by_text("0 of 12 read")).to_be_visible()
    page.get_by_role("link", name="Explore or exploit?").click()
    page.get_by_role("button", name="Pull machine 2").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_text("1 pull; regret")).to_be_visible()
    page.get_by_role("button", name="100 pulls").click()
    expect(page.get_by_text("101 pulls; regret")).to_be_visible()
    answer(page, 3)
    count = len(find_lesson(3).facts.questions)
    expect(page.get_by_text(f"{count} of {count} right.")).to_be_visible()
    expect(page.get_by_text("quiz 100 %")).to_be_visible()

    page.get_by_role("link", name="A table of values").click()
    picture = page.get_by_role("img", name="The same cliff, two characters")
    picture.scroll_into_view_if_needed()
    expect(picture).to_have_js_property("complete", True)
    expect(page.locator("math munder").first).to_be_attached()
    for _ in range(2):
        page.get_by_role("button", name="One step").click()
    expect(page.get_by_text("2 steps, 0 walks")).to_be_visible()
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.get_by_text(re.compile(r"steps, [1-9]\d* walks"))).to_be_visible()
    page.get_by_role("button", name="Pause").click()
    answer(page, 4, wrongly=1)
    expect(page.get_by_text("3 of 4 right.")).to_be_visible()
    page.locator("fieldset").first.get_by_role("radio").nth(1).check()  # to see why changes nothing
    expect(page.get_by_text("3 of 4 right.")).to_be_visible()

    page.get_by_role("link", name="A table drives a car").last.scroll_into_view_if_needed()
    expect(page.locator("header").get_by_text("read", exact=True)).to_be_attached()
    page.get_by_role("link", name="A table drives a car").last.click()
    page.get_by_role("heading", name="A table drives a car").wait_for()
    page.get_by_role("button", name="One step").click()
    expect(page.get_by_text("1 steps; worth here 0.00")).to_be_visible()
    page.get_by_role("link", name="Where tables break").scroll_into_view_if_needed()
    expect(page.locator("header").get_by_text("read", exact=True)).to_be_attached()
    page.get_by_role("navigation", name="Racecraft").get_by_role("link", name="Course").click()
    expect(page.get_by_text("3 of 12 read")).to_be_visible()
    kept = {
        card["facts"]["number"]: (card["progress"]["is_read"], card["progress"]["quiz"])
        for card in visit.console.client.get("/api/lessons").json()
    }
    assert [kept[number] for number in (2, 3, 4, 5)] == [(False, None), (True, 1.0), (True, 0.75), (True, None)]

    visit.look("dark", "de")
    page = visit.open("/lessons/4", width=390)
    expect(page.get_by_text("Fragen 75 %")).to_be_visible()
    page.get_by_role("button", name="Laufen lassen").wait_for()
    english, german = (
        visit.console.client.get("/api/lessons/4/pictures/cliff", params={"language": one}).content
        for one in ("en", "de")
    )
    assert german == picture_path(find_lesson(4), "cliff", "de").read_bytes() != english
    picture = page.get_by_role("img", name="Dieselbe Klippe, zwei Charaktere")
    picture.scroll_into_view_if_needed()
    assert picture.evaluate("one => one.decode().then(() => one.naturalWidth)") > 300
    assert page.get_by_role("img", name="The same cliff, two characters").count() == 0
    assert visit.console.client.get("/api/lessons/4/pictures/cliff", params={"language": "fr"}).status_code == 422
    assert visit.violations() == []
    assert visit.overflow() <= 0
    page = visit.open("/lessons/1", width=390)
    expect(page.get_by_role("heading", name="Ein Auto lernt in ein paar Sekunden")).to_be_visible()
    assert set(page.locator("div.text").evaluate_all("all => all.map(one => one.lang)")) == {"de"}
    assert page.get_by_text("noch nicht übersetzt").count() == 0
    assert page.get_by_text("racecraft lessons open 1 --language de").count() > 1
    for number in (1, 10, 12):  # one with exercises in plenty, a plaything before the first heading, tables
        visit.open(f"/lessons/{number}", width=390).locator("div.text").first.wait_for()
        assert visit.violations() == [], number
        assert visit.overflow() <= 0, number


def test_who_reads_the_choices_by_keyboard_has_not_answered_yet(visit: Visit) -> None:
    from playwright.sync_api import expect

    visit.look("light", "en")
    page = visit.open("/lessons/5")
    cards = page.locator("fieldset")
    for index, question in enumerate(find_lesson(5).facts.questions):
        choices = cards.nth(index).get_by_role("radio")
        choices.first.focus()
        for _ in range(question.answer + len(question.choices)):  # all of them, and on to the right one
            page.keyboard.press("ArrowDown")
        expect(choices.nth(question.answer)).to_be_focused()
        expect(cards.nth(index).locator(":checked")).to_have_count(0)
        page.keyboard.press("Space")
        cards.nth(index).get_by_text("Right.", exact=True).wait_for()
    count = len(find_lesson(5).facts.questions)
    expect(page.get_by_text(f"{count} of {count} right.")).to_be_visible()
    page.get_by_role("button", name="Answer again").focus()
    page.keyboard.press("Enter")
    expect(cards.first.get_by_role("radio").first).to_be_focused()
    expect(page.locator("fieldset :checked")).to_have_count(0)


def test_what_is_answered_without_a_network_is_kept_and_sent_when_there_is_one(visit: Visit) -> None:
    from playwright.sync_api import expect

    def kept(number: int) -> tuple[bool, float | None]:
        cards = visit.console.client.get("/api/lessons").json()
        progress = next(card["progress"] for card in cards if card["facts"]["number"] == number)
        return progress["is_read"], progress["quiz"]

    visit.look("light", "en")
    page = visit.open("/lessons/6")
    page.locator("fieldset").first.wait_for()
    page.context.set_offline(True)
    answer(page, 6)
    page.get_by_text("stays in this browser and is sent when it does").wait_for()
    assert page.get_by_text("Nothing was done").count() == 0
    assert kept(6)[1] is None
    page.context.set_offline(False)
    expect(page.get_by_text("quiz 100 %")).to_be_visible()
    assert kept(6) == (True, 1.0)

    page = visit.open("/lessons/7")
    page.locator("fieldset").first.wait_for()
    page.context.set_offline(True)
    answer(page, 7)
    page.get_by_text("stays in this browser and is sent when it does").wait_for()
    page.goto("about:blank")  # and the page is gone
    page.context.set_offline(False)
    assert kept(7)[1] is None
    visit.open("/tracks")  # whichever page is opened first
    visit.console.wait_for(lambda: kept(7) == (True, 1.0))
    page = visit.open("/lessons")
    expect(page.locator("li", has_text=find_lesson(7).facts.title.en).get_by_text("quiz 100 %")).to_be_visible()
    assert all("ERR_INTERNET_DISCONNECTED" in complaint for complaint in visit.complaints)
    visit.complaints.clear()
