"""What the page in a tab keeps when another is open or it sleeps meanwhile, and when the browser has no room left.

Needs `make site`, and skips where that was not run. Tests follow each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from built_page import NEEDS_THE_PAGE, PATIENCE, hosted

from chromium import launched
from few_frames import FEW_FRAMES
from until_true import until_true

if TYPE_CHECKING:
    from playwright.sync_api import Page, Route

pytestmark = NEEDS_THE_PAGE

FULL = """() => {
  const [stores, ended] = [IDBObjectStore.prototype, IDBTransaction.prototype];
  const before = [stores.put, stores.add, Object.getOwnPropertyDescriptor(ended, "error"), Storage.prototype.setItem];
  const full = new DOMException("full", "QuotaExceededError");
  for (const name of ["put", "add"]) {
    const ask = stores[name];
    stores[name] = function (what) {
      const asked = ask.call(this, what);
      this.transaction.abort();
      return asked;
    };
  }
  Object.defineProperty(ended, "error", { get: () => full, configurable: true });
  Storage.prototype.setItem = () => { throw full; };
  window.makeRoom = () => {
    [stores.put, stores.add, , Storage.prototype.setItem] = before;
    Object.defineProperty(ended, "error", before[2]);
  };
}"""  # as a browser does it without room; the quota that DevTools would set is not one for what is kept


@pytest.fixture(scope="module")
def tabs() -> Iterator[list[Page]]:
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted() as address, sync_playwright() as playwright:
        browser = launched(playwright)
        context = browser.new_context()
        context.set_default_timeout(PATIENCE)
        context.add_init_script(FEW_FRAMES)
        pages = [context.new_page(), context.new_page()]
        for page in pages:
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.goto(address)
            page.get_by_role("combobox", name="Track").select_option("oval")
            page.get_by_label("What it is paid for").select_option("centerline")
        yield pages
        browser.close()
    assert complaints == []


def models(page: Page) -> list[str]:
    return sorted(page.locator(".model strong").all_inner_texts())


def test_nothing_is_kept_for_later_before_the_first_car_has_what_it_needs(tabs: list[Page]) -> None:
    context = tabs[0].context.browser.new_context()
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    context.route("**/core/*.wasm", hold)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.clock.install()
    page.goto(tabs[0].url)
    page.get_by_role("button", name="Train", exact=True).wait_for()
    for _ in range(PATIENCE // 100):
        if held:
            break
        page.wait_for_timeout(100)
    assert held, "the core was not asked for"
    page.clock.fast_forward(10_000)  # ms, longer than the page waits once all is there
    page.wait_for_timeout(1000)  # of the browser's own time, in which it would register
    registered = "navigator.serviceWorker.getRegistration().then((one) => one !== undefined)"
    assert not page.evaluate(registered)
    for route in held:
        route.continue_()
    until_true(page, registered)
    context.close()


def test_two_tabs_train_at_once_and_one_that_slept_goes_on(tabs: list[Page]) -> None:
    for page in tabs:
        page.get_by_role("button", name="Train", exact=True).click()
    sleeper = tabs[1].context.new_cdp_session(tabs[1])
    tabs[1].get_by_text("64 cars learning at once").wait_for()
    sleeper.send("Page.setWebLifecycleState", {"state": "frozen"})
    tabs[0].get_by_text("It drives 5 of 5 laps").wait_for()
    sleeper.send("Page.setWebLifecycleState", {"state": "active"})
    tabs[1].get_by_text("It drives 5 of 5 laps").wait_for()
    for page in tabs:  # both see both
        page.get_by_text("oval-centerline-2", exact=True).wait_for()
        assert models(page) == ["oval-centerline-1", "oval-centerline-2"]


def test_a_page_that_is_left_while_cars_learn_asks_first_and_tells_then_what_is_kept(tabs: list[Page]) -> None:
    from playwright.sync_api import expect

    page, asked = tabs[0].context.browser.new_context().new_page(), []
    page.set_default_timeout(PATIENCE)
    page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.accept()))
    page.goto(tabs[0].url)
    page.get_by_role("combobox", name="Track").select_option("generated:3")
    page.get_by_role("button", name="Train", exact=True).click()
    page.locator(".model").wait_for()
    page.reload()
    assert asked == ["beforeunload"]
    told = page.get_by_role("region", name="A training was cut short")
    told.get_by_text("is kept as generated-3-racing-1.").wait_for()
    told.get_by_role("button", name="Train on").press("Enter")
    expect(told).to_have_count(0)
    expect(page.get_by_role("button", name="Train", exact=True)).to_be_focused()
    page.get_by_text("Begins with what generated-3-racing-1 has learned.").wait_for()
    assert page.get_by_role("combobox", name="Track").input_value() == "generated:3"
    page.reload()
    page.get_by_text("generated-3-racing-1", exact=True).wait_for()
    assert asked == ["beforeunload"]  # nobody learns
    expect(told).to_have_count(0)
    page.context.close()


def test_a_model_is_given_another_name_that_no_other_one_has(tabs: list[Page]) -> None:
    page, other = tabs
    for name, shown in (
        ("oval-centerline-1", "There is a model called oval-centerline-1 already."),
        ("heron", "heron"),
    ):
        page.get_by_role("button", name="Rename: oval-centerline-2").click()
        page.get_by_label("New name").fill(name)
        page.get_by_role("button", name="Save", exact=True).click()
        page.get_by_text(shown, exact=True).wait_for()
        if name != "heron":
            page.get_by_role("button", name="Cancel").click()
    other.get_by_text("heron", exact=True).wait_for()
    assert models(page) == models(other) == ["heron", "oval-centerline-1"]
    other.get_by_role("button", name="Rename: heron").click()
    other.get_by_label("New name").fill("oval-centerline-2")
    other.get_by_label("New name").press("Enter")
    page.get_by_text("oval-centerline-2", exact=True).wait_for()


def test_what_a_full_browser_cannot_keep_is_told_and_stays_until_there_is_room(
    tabs: list[Page], tmp_path: Path
) -> None:
    page, other = tabs
    with page.expect_download() as download:
        page.get_by_role("button", name="Download: oval-centerline-1").click()
    archive = tmp_path / download.value.suggested_filename
    download.value.save_as(archive)
    page.evaluate(FULL)
    page.get_by_label("Bring a model", exact=True).and_(page.locator("input")).set_input_files(archive)
    page.get_by_text("There is no room left in this browser's storage: download this model now").wait_for()
    page.get_by_role("button", name="Download: oval-centerline-1-1").wait_for()
    page.get_by_label("Theme").select_option("dark")  # which is not remembered
    page.get_by_role("button", name="Draw a track").click()
    desk = page.get_by_role("dialog", name="Draw a track")
    desk.get_by_text("It can be driven.").wait_for()
    desk.get_by_label("Name of the track").fill("mine")
    desk.get_by_role("button", name="Save").click()
    desk.get_by_text("so this track was not kept").wait_for()
    page.evaluate("makeRoom()")
    desk.get_by_role("button", name="Save").click()
    other.get_by_role("combobox", name="Track").get_by_role("option", name="mine").wait_for(state="attached")
    page.get_by_role("button", name="Delete: oval-centerline-2").click()
    other.get_by_text("oval-centerline-1-1", exact=True).wait_for()
    page.reload()
    page.get_by_text("oval-centerline-1-1", exact=True).wait_for()
    assert models(page) == models(other) == ["oval-centerline-1", "oval-centerline-1-1"]


def test_each_tab_goes_on_with_the_reward_that_was_written_in_it(tabs: list[Page]) -> None:
    for page, pays in zip(tabs, ("1.0", "2.0"), strict=True):
        page.get_by_label("What it is paid for").select_option("own")
        page.get_by_label("The reward in Python").fill(f"def reward_function(params):\n    return {pays}\n")
    tabs[0].reload()
    tabs[0].get_by_label("What it is paid for").select_option("own")
    tabs[0].get_by_text("return 1.0").wait_for()


NOTHING = """for (const name of ["localStorage", "sessionStorage", "indexedDB"]) {
  const refuse = () => { throw new DOMException("The operation is insecure.", "SecurityError"); };
  Object.defineProperty(window, name, { get: refuse });
}"""  # as browsers do it that are told to keep nothing of pages


def test_a_browser_that_keeps_nothing_is_told_of_and_its_models_are_there_until_the_page_is_closed(
    tabs: list[Page],
) -> None:
    from playwright.sync_api import expect

    context = tabs[0].context.browser.new_context(locale="de-DE", viewport={"width": 360, "height": 740})
    context.set_default_timeout(PATIENCE)
    context.add_init_script(FEW_FRAMES)
    context.add_init_script(NOTHING)
    page = context.new_page()
    page.goto(tabs[0].url)
    page.get_by_role("alert").get_by_text("Dieser Browser lässt die Seite nichts behalten").wait_for()
    page.get_by_label("Sprache").select_option("en")
    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_label("What it is paid for").select_option("centerline")
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    page.get_by_role("button", name="Rename: oval-centerline-1").press("Enter")
    expect(page.get_by_label("New name")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.get_by_role("button", name="Rename: oval-centerline-1")).to_be_focused()
    page.keyboard.press("Enter")
    page.get_by_label("New name").fill("heron")
    page.get_by_label("New name").press("Enter")
    expect(page.get_by_role("button", name="Rename: heron")).to_be_focused()
    assert models(page) == ["heron"]
    page.get_by_role("button", name="Delete: heron").press("Enter")
    expect(page.locator(".model")).to_have_count(0)
    expect(page.get_by_role("heading", name="Your models")).to_be_focused()
    page.get_by_role("button", name="Undo").click()
    page.get_by_text("heron", exact=True).wait_for()
    assert page.get_by_text("insecure").count() == 0
    context.close()
