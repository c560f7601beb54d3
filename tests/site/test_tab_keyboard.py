"""The page without a mouse: where the keyboard goes on when the button that was pressed is gone.

Needs `make site`, and skips where that was not run. Tests follow each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from built_page import NEEDS_THE_PAGE, opened_page

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

pytestmark = NEEDS_THE_PAGE


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with opened_page() as page:
        yield page


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def test_who_trains_stops_and_trains_on_stays_at_the_button_for_it(page: Page) -> None:
    from playwright.sync_api import expect

    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_label("What it is paid for").select_option("centerline")
    expect(button(page, "Train")).to_be_enabled()  # the oval has come; a key is not kept for a button that waits for it
    button(page, "Train").press("Enter")
    expect(button(page, "Stop")).to_be_focused()
    page.keyboard.press("Enter")
    expect(button(page, "Train")).to_be_focused()
    page.keyboard.press("Enter")
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    expect(button(page, "Train")).to_be_focused()
    page.get_by_role("button", name="Train on: ").press("Enter")
    expect(button(page, "Train")).to_be_focused()
    button(page, "Begin anew").press("Enter")
    expect(button(page, "Train")).to_be_focused()


def test_who_is_elsewhere_when_a_training_ends_stays_there(page: Page) -> None:
    from playwright.sync_api import expect

    expect(button(page, "Train")).to_be_enabled()
    button(page, "Train").press("Enter")
    top = page.get_by_role("group", name="Camera").get_by_role("button", name="From above")
    top.press("Enter")
    page.get_by_role("button", name="Watch its laps: ").nth(1).wait_for()
    button(page, "Train").wait_for()
    expect(top).to_be_focused()


def test_who_changes_a_preset_is_led_to_the_editor_and_who_takes_a_gift_to_the_page(page: Page) -> None:
    from playwright.sync_api import expect

    button(page, "Change it").press("Enter")
    editor = page.get_by_role("region", name="A reward of my own")
    expect(editor).to_be_focused()
    expect(editor).to_be_in_viewport()
    button(page, "Make a link").click()
    link = page.get_by_label("Link", exact=True)
    address = link.input_value()
    page.get_by_role("combobox", name="Track").select_option("hairpin")
    expect(link).to_have_count(0)  # it was of the other track
    page.goto(address)
    button(page, "Take it").press("Enter")
    expect(page.get_by_role("main")).to_be_focused()
    expect(page.get_by_role("combobox", name="Track")).to_have_value("oval")
