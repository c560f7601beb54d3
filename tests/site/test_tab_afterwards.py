"""What the page says once something else was chosen or written is so of that, and what somebody wrote is not lost.

Needs `make site`, and skips where that was not run. Tests follow each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from built_page import NEEDS_THE_PAGE, PATIENCE, opened_page

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = NEEDS_THE_PAGE

MINE = 'def reward_function(params):\n    return 1.5 * params["speed"]  # my own\n'
FAILS_LATE = """calls = 0
def reward_function(params):
    global calls
    calls += 1
    return 1.0 if calls < 30 else 1 / 0
"""  # every car has its own globals; on the way round it is called less often


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with opened_page(viewport={"width": 1366, "height": 768}) as page:
        yield page


def test_as_many_cars_wait_as_the_chosen_race_has(page: Page) -> None:
    page.get_by_text("64 cars wait for you.").wait_for()
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_text("128 cars wait for you.").wait_for()
    page.get_by_role("button", name="Time trial").click()
    page.get_by_text("64 cars wait for you.").wait_for()


def test_a_reward_that_pays_the_same_everywhere_has_no_least_and_no_most(page: Page) -> None:
    page.get_by_label("What it is paid for").select_option("own")
    page.locator(".cm-content").fill(MINE)
    painting = page.get_by_role("region", name="What it pays along the track")
    painting.get_by_text("2.25 everywhere").wait_for()
    assert painting.get_by_text("least").count() == 0


def test_what_somebody_wrote_comes_back_when_a_preset_takes_its_place(page: Page) -> None:
    from playwright.sync_api import expect

    editor = page.locator(".cm-content")
    page.get_by_label("What it is paid for").select_option("centerline")
    page.get_by_role("button", name="Change it", exact=True).click()
    expect(editor).not_to_contain_text("my own")
    page.get_by_text("The reward that you had written was replaced.").wait_for()
    page.get_by_role("button", name="Undo").click()
    expect(editor).to_contain_text("my own")
    page.reload()
    page.get_by_label("What it is paid for").select_option("own")
    expect(editor).to_contain_text("my own")


def test_nothing_is_said_to_be_replaced_that_can_be_had_again(page: Page) -> None:
    from playwright.sync_api import expect

    source = page.evaluate("fetch('data/plan.json').then((answer) => answer.json())")["rewards"][0]["source"]
    page.locator(".cm-content").fill(source)
    page.get_by_label("What it is paid for").select_option("centerline")
    page.get_by_role("button", name="Change it", exact=True).click()
    expect(page.locator(".cm-content")).to_contain_text("centre line")
    assert page.get_by_text("was replaced").count() == 0


def test_a_failure_is_told_in_german_and_marked_in_the_text_that_failed_alone(page: Page) -> None:
    from playwright.sync_api import expect

    page.get_by_label("Language").select_option("de")
    page.locator(".cm-content").fill("import numpy\n\ndef reward_function(params):\n    return 1.0\n")
    page.get_by_text("Eine Seite hat nur Python; das installierte Programm, Racecraft, trainiert mit numpy.").wait_for()
    page.locator(".cm-content").fill(FAILS_LATE)
    page.get_by_text("Die Funktion ist in Ordnung.").wait_for()
    page.get_by_role("button", name="Trainieren", exact=True).click()
    marks = page.locator(".cm-lint-marker-error")
    alert = page.get_by_role("alert").filter(has_text="reward_function.py")
    expect(alert).to_contain_text("Zeile 5: Die Belohnungsfunktion löste ZeroDivisionError: division by zero aus")
    expect(marks).to_have_count(1)
    page.locator(".cm-content").fill(MINE)
    page.get_by_text("Die Funktion ist in Ordnung.").wait_for()
    expect(marks).to_have_count(0)


def test_a_result_is_said_of_the_track_that_it_was_on(page: Page) -> None:
    from playwright.sync_api import expect

    said = page.get_by_text("Die Belohnungsfunktion ist")
    expect(said).to_have_text("Die Belohnungsfunktion ist gescheitert.")
    page.get_by_role("combobox", name="Strecke").select_option("hairpin")
    expect(said).to_have_text("Las Vegas 2018: Die Belohnungsfunktion ist gescheitert.")
    page.get_by_role("combobox", name="Strecke").select_option("reinvent_2018")
    expect(said).to_have_text("Die Belohnungsfunktion ist gescheitert.")


def test_what_the_car_saw_on_another_track_is_gone_with_it(page: Page) -> None:
    drawn = """([canvas]) => {
        const { width, height } = canvas;
        return canvas.getContext("2d").getImageData(0, 0, width, height).data.some((value) => value > 0);
    }"""
    seen = page.get_by_label("Was das Auto sieht")

    def wait_for_a_picture(is_there: bool) -> None:
        for _ in range(PATIENCE // 100):
            if seen.evaluate_all(drawn) == is_there:
                return
            page.wait_for_timeout(100)
        raise AssertionError("there is a picture" if not is_there else "there is no picture")

    page.get_by_label("Wofür es belohnt wird").select_option("centerline")
    page.get_by_role("button", name="Trainieren", exact=True).click()
    wait_for_a_picture(True)
    page.get_by_role("button", name="Anhalten").click()
    page.get_by_role("button", name="Trainieren", exact=True).wait_for()
    wait_for_a_picture(True)
    page.get_by_role("combobox", name="Strecke").select_option("hairpin")
    wait_for_a_picture(False)
