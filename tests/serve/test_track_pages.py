"""Finding, drawing, importing and driving tracks in real headless Chromium."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from browsers import Visit, needs_axe, needs_browser, needs_pages, visiting
from raced_models import write_raced
from running_consoles import running_console

from until_true import until_true

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with running_console(tmp_path_factory.mktemp("pages") / "runs") as console, visiting(console) as visit:
        yield visit
        assert visit.complaints == []


def test_the_gallery_filters_imports_deletes_and_undoes(visit: Visit) -> None:
    page = visit.open("/tracks")
    page.get_by_text("18 tracks").wait_for()
    page.get_by_role("searchbox").fill("oval")
    page.get_by_role("heading", name="Paperclip").wait_for()
    assert page.locator("li.card").count() < 4
    page.get_by_role("searchbox").fill("")
    page.get_by_role("button", name="Hard").click()
    page.get_by_role("heading", name="Needle").wait_for()
    page.get_by_role("heading", name="Paperclip").wait_for(state="detached")
    page.get_by_role("button", name="Wide").click()
    page.get_by_role("button", name="Clockwise", exact=True).click()
    page.get_by_text("No track fits").wait_for()
    for trait in ("Hard", "Wide", "Clockwise"):
        page.get_by_role("button", name=trait, exact=True).click()

    route = visit.console.client.get("/api/tracks/oval/route.npy").content
    file = {"name": "Living room.npy", "mimeType": "application/octet-stream", "buffer": route}
    page.locator("input[type=file]").set_input_files(file)
    page.get_by_text("Living_room was imported.").wait_for()
    page.get_by_role("heading", name="Living_room").wait_for()
    bad = {"name": "virus.exe", "mimeType": "application/octet-stream", "buffer": b"x"}
    page.locator("input[type=file]").set_input_files(bad)
    page.get_by_text("is no track file").wait_for()

    page.get_by_role("button", name="Your own").click()
    page.get_by_role("button", name="Delete").click()
    page.get_by_text("No track fits").wait_for()
    page.get_by_role("button", name="Undo").last.click()
    page.get_by_role("heading", name="Living_room").wait_for()
    visit.complaints.clear()  # the refused file is one, rightly


def test_a_track_is_drawn_with_the_mouse_and_with_keys_tried_and_kept(visit: Visit) -> None:
    page = visit.open("/tracks")
    page.get_by_role("link", name="Draw a track").click()
    page.get_by_text("It can be driven.").wait_for()
    points = page.locator("[data-point]")
    assert points.count() == 8

    points.nth(3).focus()
    before = str(points.nth(3).get_attribute("aria-label"))
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowLeft")
    after = str(points.nth(3).get_attribute("aria-label"))
    assert "3.4, 2.2" in before
    assert "3.3, 2.7" in after
    page.keyboard.press("Insert")
    assert points.count() == 9
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert points.count() == 8
    assert points.nth(3).get_attribute("aria-label") == before

    # over the other side of the road: it crosses itself, is told so, and cannot be kept
    box, there = points.nth(4).bounding_box(), points.nth(0).bounding_box()
    assert box is not None
    assert there is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(there["x"], there["y"] + 90, steps=6)
    page.mouse.up()
    page.get_by_text("It cannot be driven yet").wait_for()
    page.locator("circle.trouble").wait_for()
    assert page.get_by_role("button", name="Save").is_disabled()
    page.get_by_role("button", name="Undo").click()
    page.get_by_text("It can be driven.").wait_for()

    page.get_by_text("Points as a table").click()
    cell = page.get_by_role("spinbutton", name="1: x")
    cell.fill("0.5")
    cell.press("Tab")
    assert "0.5, −2.2" in str(points.nth(0).get_attribute("aria-label"))
    page.get_by_role("button", name="Mirror").click()
    page.get_by_text("It can be driven.").wait_for()

    page.get_by_role("button", name="Test drive").click()
    page.get_by_text("Press ↑ to drive off").wait_for()
    page.get_by_role("link", name="Back to the drawing").click()
    page.get_by_text("It can be driven.").wait_for()
    page.get_by_label("Name of the track").fill("night-circuit")
    page.get_by_role("button", name="Save").click()
    page.get_by_text("night-circuit is kept").wait_for()
    page.get_by_role("button", name="Close").click()  # or the next message is not told from this one
    sketch = visit.console.client.get("/api/tracks/night-circuit/sketch").json()
    assert len(sketch["points"]) == 8

    page.get_by_role("searchbox").fill("night")
    page.get_by_role("link", name="Edit", exact=True).click()
    page.get_by_role("button", name="Save changes").wait_for()
    page.get_by_role("button", name="Larger").click()
    page.get_by_text("It can be driven.").wait_for()
    page.get_by_role("button", name="Save changes").click()
    page.get_by_text("night-circuit is kept").wait_for()
    larger = visit.console.client.get("/api/tracks/night-circuit/sketch").json()
    assert larger["points"] != sketch["points"]


def test_a_lap_is_drawn_in_one_go(visit: Visit) -> None:
    import math

    page = visit.open("/draw")
    page.get_by_text("It can be driven.").wait_for()
    page.get_by_role("button", name="Draw in one go").click()
    box = page.locator("svg.draw_free_mode").bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    at = [(middle[0] + 260 * math.cos(a / 10), middle[1] - 150 * math.sin(a / 10)) for a in range(62)]
    page.mouse.move(*at[0])
    page.mouse.down()
    for place in at:
        page.mouse.move(*place)
    page.mouse.up()
    page.get_by_text("It can be driven.").wait_for()
    assert 6 <= page.locator("[data-point]").count() <= 40
    assert page.locator("[data-point]").count() != 8


def test_somebody_drives(visit: Visit) -> None:
    page = visit.open("/drive/oval")
    page.get_by_text("Press ↑ to drive off").wait_for()
    clock = page.locator(".clock strong")
    assert clock.inner_text() == "0.00"
    page.keyboard.down("ArrowUp")
    visit.console.wait_for(lambda: float(clock.inner_text()) > 1.0)
    visit.console.wait_for(lambda: float(page.locator(".gauge strong").inner_text()) > 0.4)
    page.get_by_text("Off the road").wait_for()
    page.keyboard.up("ArrowUp")
    page.keyboard.press("p")
    page.get_by_text("Paused").wait_for()

    def stands() -> bool:
        """Once the step that was on its way has come."""
        before = clock.inner_text()
        page.wait_for_timeout(400)
        return clock.inner_text() == before

    visit.console.wait_for(stands)
    page.keyboard.press("r")
    page.get_by_text("Press ↑ to drive off").wait_for()
    pedal = page.get_by_role("button", name="Faster")
    pedal.dispatch_event("pointerdown", {"pointerId": 1, "button": 0})


def test_the_medal_of_ones_best_lap_and_what_the_next_asks_for(visit: Visit) -> None:
    def of_day_before(route: Any) -> None:
        told = route.fetch()
        best = 6.53 if json.loads(route.request.post_data)["direction"] == "forward" else 6.0
        route.fulfill(response=told, json=told.json() | {"best": best})

    page = visit.open("/drive/oval")
    times = page.locator(".times")
    times.get_by_text("Bronze takes 7.63 s").wait_for()
    page.route("**/api/drives", of_day_before)
    page.reload()
    times.get_by_text("0.42 s to silver").wait_for()
    assert times.locator(".medal").inner_text() == "Bronze"
    laps = page.locator("section", has=page.get_by_role("heading", name="Your laps"))
    laps.get_by_text("0.42 s to silver").wait_for()
    page.get_by_label("Direction").select_option("reverse")  # of which no minimum is known
    times.get_by_text("6.00 s").wait_for()
    assert page.locator(".medal").count() == page.locator(".coin").count() == 0
    page.unroute("**/api/drives")


def test_ones_own_car_is_driven_against_its_way_round_and_in_its_car(visit: Visit) -> None:
    visit.console.create(name="crab", train=False, track="bowtie", vehicle="v6", direction="reverse")
    write_raced(visit.console.runs / "crab", 9.0, track="bowtie", direction="reverse")
    page = visit.open("/models/crab/race")
    page.get_by_role("link", name="Beat your own car").click()
    page.get_by_text("crab drove this lap. Direction: The other way; car: v6.").wait_for()
    assert page.get_by_label("Ghost").input_value() == "model:crab"
    assert page.get_by_label("Direction").input_value() == "reverse"
    assert page.locator("label", has_text=re.compile("^Car")).locator("select").input_value() == "v6"
    page.get_by_label("Direction").select_option("forward")  # where nobody drove
    page.locator("option:checked", has_text="Drive alone").wait_for(state="attached")
    page.get_by_label("Ghost").select_option("model:crab")
    page.get_by_text("crab drove this lap").wait_for()
    assert page.get_by_label("Direction").input_value() == "reverse"


def test_what_moves_fills_the_screen_and_gives_it_back(visit: Visit) -> None:
    """A drive, and an evaluation's replay."""
    visit.console.create(name="seal", train=False, track="oval")
    write_raced(visit.console.runs / "seal", 9.0)
    for path, region in (("/drive/oval", "The track and your car"), ("/models/seal/race", "Replay")):
        page = visit.open(path)
        part = page.get_by_role("region", name=region, exact=True)
        part.locator("canvas").first.wait_for()
        part.get_by_role("button", name="Full screen").click()
        page.locator(":fullscreen canvas").wait_for()
        until_true(
            page,
            "() => { const {width, height} = document.querySelector(':fullscreen canvas').getBoundingClientRect();"
            " return width === innerWidth && height === innerHeight; }",
        )
        assert page.evaluate("document.activeElement === document.body"), "the keys are for what is shown"
        page.locator(":fullscreen").get_by_role("button", name="Full screen").click()
        page.locator(":fullscreen").wait_for(state="detached")


@needs_axe
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_serious_and_nothing_sticks_out(visit: Visit, theme: str) -> None:
    visit.look(theme, "de" if theme == "dark" else "en")
    found = {}
    for path in ("/tracks", "/draw", "/draw/generated:7", "/drive/oval"):
        found |= visit.flaws(path)
    assert found == {}
