"""What the page says on a phone where something goes wrong: a link cut short, no Python, a function that fails late.

Needs `make site`, and skips where that was not run. Tests follow each other.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from built_page import NEEDS_THE_PAGE, PATIENCE, hosted

from chromium import launched
from few_frames import FEW_FRAMES
from until_true import until_true

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = NEEDS_THE_PAGE

CUT = "track=oval&reward=AAAA"
FAILS = """def reward_function(params):
    return 1 / (params["steps"] - 97)
"""
VISIBLE = """(() => {
  const { top, bottom } = document.querySelector(".scene .view").getBoundingClientRect();
  return top >= 0 && bottom <= innerHeight;
})()"""


@pytest.fixture(scope="module")
def phone() -> Iterator[Page]:
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted() as address, sync_playwright() as playwright:
        browser = launched(playwright)
        context = browser.new_context(
            base_url=address,
            viewport={"width": 390, "height": 844},
            reduced_motion="reduce",
            service_workers="block",  # what one has kept is asked of no host, and could not be refused
        )
        context.set_default_timeout(PATIENCE)
        context.add_init_script(FEW_FRAMES)
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        yield page
        browser.close()
    assert complaints == []


def test_a_link_that_was_cut_short_says_so(phone: Page) -> None:
    phone.goto(f"./#{CUT}")
    phone.get_by_role("alert").get_by_text("it is damaged, or was cut short").wait_for()
    phone.goto("./#replay")
    phone.get_by_role("alert").wait_for(state="detached")


def test_a_link_for_a_track_that_is_not_here_says_so(phone: Page) -> None:
    packed = phone.evaluate(
        """async () => {
          const whole = new Response(new Blob(["def reward_function(params): return 1.0"]).stream().pipeThrough(
            new CompressionStream("deflate-raw")));
          return btoa(String.fromCharCode(...new Uint8Array(await whole.arrayBuffer())));
        }"""
    )
    phone.goto(f"./#track=<b>nowhere</b>&reward={packed.replace('+', '-').replace('/', '_').rstrip('=')}")
    phone.get_by_text("For the track <b>nowhere</b>, which is not in this page").wait_for()
    phone.get_by_role("button", name="Leave it").click()
    assert phone.evaluate("location.hash") == ""


def test_cars_that_learn_are_seen_by_who_pressed_train(phone: Page) -> None:
    train = phone.get_by_role("button", name="Train", exact=True)
    train.scroll_into_view_if_needed()
    phone.get_by_role("img", name="What it pays along the track").wait_for()
    train.click()
    stop = phone.get_by_role("button", name="Stop")
    stop.wait_for()
    until_true(phone, VISIBLE)
    stop.click()


def test_python_that_does_not_come_is_told_and_asked_for_again(phone: Page) -> None:
    phone.route("**/python/*", lambda route: route.abort())
    phone.get_by_label("What it is paid for").select_option("own")
    phone.get_by_text("Python could not be loaded").wait_for()
    phone.unroute("**/python/*")
    phone.locator(".cm-content").fill("def reward_function(params):\n    return 1.0\n")
    phone.get_by_text("The function is fine.").wait_for()


def test_a_function_that_fails_on_the_way_is_not_painted_as_if_it_paid(phone: Page) -> None:
    phone.get_by_text("1 everywhere").wait_for()
    phone.locator(".cm-content").fill(FAILS)
    phone.get_by_text("The function fails on the way round, so there is nothing to paint.").wait_for()
    assert phone.get_by_text("everywhere").count() == 0


def test_who_cannot_train_without_a_reward_is_told_so(phone: Page) -> None:
    from playwright.sync_api import expect

    train = phone.get_by_role("button", name="Train", exact=True)
    beside = train.locator("xpath=following-sibling::p[1]")
    phone.locator(".cm-content").fill("")
    expect(beside).to_have_text("Write a reward function, or choose a preset.")
    expect(train).to_be_disabled()
    phone.locator(".cm-content").fill("def reward_function(params):\n    return nothing\n")
    expect(beside).to_have_text("There is a mistake in the reward function.")
    phone.locator(".cm-content").fill("def reward_function(params):\n    return 1.0\n")
    expect(train).to_be_enabled()


DROP = """files => {
  const dataTransfer = new DataTransfer();
  for (const [name, text] of files) dataTransfer.items.add(new File([text], name));
  scrollTo(0, 0);
  window.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
}"""


def test_what_is_dropped_is_taken_for_what_it_is_and_its_answer_is_seen(phone: Page) -> None:
    from playwright.sync_api import expect

    phone.evaluate(DROP, [["reward_function.py", "def reward_function(params):\r\n    return 2.0\r\n"]])
    brought = phone.get_by_role("region", name="This file brings a reward")
    expect(brought).to_be_in_viewport()
    brought.get_by_role("button", name="Take it").click()
    phone.locator(".cm-content").get_by_text("return 2.0").wait_for()
    metadata = {"action_space": [{"steering_angle": angle, "speed": 0.7} for angle in (-25, 25)], "version": "4"}
    phone.evaluate(DROP, [["model_metadata.json", json.dumps(metadata)]])
    actions = phone.get_by_role("region", name="Actions")
    actions.get_by_text("2 of at most 30").wait_for()
    expect(actions).to_be_in_viewport()
    phone.evaluate(DROP, [["stranger.replay", "nothing"]])
    expect(phone.get_by_text("This is no replay of Racecraft")).to_be_in_viewport()
    phone.evaluate(DROP, [["MODEL.TAR.GZ", "nothing"]])
    expect(phone.get_by_text("This archive is damaged")).to_be_in_viewport()
    phone.evaluate(DROP, [["holiday.jpg", "nothing"]])
    expect(phone.get_by_text("holiday.jpg is nothing that this page takes")).to_be_in_viewport()


def test_of_files_dropped_together_all_are_taken_that_there_is_a_place_for(phone: Page) -> None:
    from playwright.sync_api import expect

    reward = "def reward_function(params):\n    return %s\n"
    metadata = {"action_space": [{"steering_angle": angle, "speed": 0.6} for angle in (-20, 0, 20)], "version": "4"}
    files = [
        ("reward_function.py", reward % "3.0"),
        ("model_metadata.json", json.dumps(metadata)),
        ("other.py", reward % "4.0"),
        ("one.tar.gz", "nothing"),
        ("two.tar.gz", "nothing"),
        ("holiday.jpg", "nothing"),
        ("cat.jpg", "nothing"),
    ]
    phone.evaluate(DROP, [list(file) for file in files])
    brought = phone.get_by_role("region", name="This file brings a reward")
    expect(brought).to_be_in_viewport()
    expect(brought).to_contain_text("return 3.0")
    phone.get_by_role("region", name="Actions").get_by_text("3 of at most 30").wait_for()
    phone.get_by_text("Left: other.py. There is a place for one reward").wait_for()
    phone.get_by_text("holiday.jpg, cat.jpg is nothing that this page takes").wait_for()
    for name in ("one.tar.gz", "two.tar.gz"):
        phone.get_by_text(f"{name}: This archive is damaged").wait_for()
