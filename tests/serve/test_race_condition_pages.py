"""Cars, conditions and roads of one's own for heats, ladders and races, in real headless Chromium."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from browsers import Visit, needs_axe, needs_browser, needs_pages, visiting_two_drivers
from playwright.sync_api import FilePayload, Page

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with visiting_two_drivers(tmp_path_factory.mktemp("pages") / "runs") as visit:
        yield visit


def _file(name: str, document: object) -> FilePayload:
    return {"name": name, "mimeType": "application/json", "buffer": json.dumps(document).encode()}


def _line_up(page: Page) -> None:
    for name in ("ada", "bob"):
        page.get_by_role("combobox", name="Add a model").select_option(name)


def test_a_heat_in_a_car_and_conditions_from_files_tells_them_afterwards(visit: Visit) -> None:
    page = visit.open("/contests/new")
    _line_up(page)
    page.get_by_role("combobox", name=re.compile("^Car")).select_option("own")
    page.get_by_label("A vehicle file").set_input_files(_file("my-car.json", {"mass": 9.5, "speed_gain": 0.8}))
    mass, gain = page.get_by_label("mass", exact=True), page.get_by_label("speed_gain", exact=True)
    visit.console.wait_for(lambda: mass.input_value() == "9.5")
    assert gain.input_value() == "0.8"
    assert page.get_by_label("steering_bias").input_value() == "0.0252"  # v5's
    gain.fill("0.6")
    page.get_by_label("A vehicle file").set_input_files(_file("other.json", {"masses": 2}))
    page.get_by_text("other.json: There is no masses to be set.").wait_for()
    assert mass.input_value() == "9.5"

    page.get_by_role("combobox", name="Otherwise than they know").select_option("own")
    ranges = {"preset": "aws", "friction": [0.6, 0.6]}
    page.get_by_label("A file of ranges").set_input_files(_file("wet.json", ranges))
    page.get_by_label("friction, least").wait_for()
    page.get_by_role("button", name="Leave out: tint").click()
    page.get_by_label("Resets allowed").fill("0")
    page.get_by_label("Time limit, s").fill("6")
    with page.expect_request("**/api/contests/heats") as sent:
        page.get_by_role("button", name="Start the heat with 2").click()
    asked = sent.value.post_data_json
    assert (asked["vehicle"]["mass"], asked["vehicle"]["speed_gain"]) == (9.5, 0.6)
    assert asked["randomize"] == {"light": [0.8, 1], "friction": [0.6, 0.6]}

    page.get_by_role("heading", name="The heat in 3D").wait_for()
    told = page.get_by_role("heading", name="Held by these rules").locator("..")
    assert told.get_by_text("own numbers: mass 9.5 · speed_gain 0.6", exact=True).is_visible()
    assert told.get_by_text("own ranges: friction 0.6 · light 0.8 – 1", exact=True).is_visible()
    path = page.url.removeprefix(str(visit.console.client.base_url))
    visit.look("dark", "de")
    page = visit.open(path, width=390)
    told = page.get_by_role("heading", name="Nach diesen Regeln").locator("..")
    told.get_by_text("eigene Zahlen: mass 9,5 · speed_gain 0,6", exact=True).wait_for()
    assert told.get_by_text("eigene Bereiche: friction 0,6 · light 0,8 – 1", exact=True).is_visible()
    assert visit.overflow() == 0

    page = visit.open("/contests/new", width=390)
    page.get_by_role("combobox", name=re.compile("^Auto")).select_option("own")
    page.get_by_label("Eine Autodatei").set_input_files(_file("auto.json", {"mass": "schwer"}))
    page.get_by_text("auto.json: mass ist keine Zahl.").wait_for()
    assert visit.overflow() == 0
    visit.look("light", "en")


def test_a_ladder_is_held_on_roads_of_the_generator(visit: Visit) -> None:
    page = visit.open("/contests/new")
    page.get_by_role("button", name="Ladder").click()
    page.get_by_role("button", name="Add all").click()
    road = page.get_by_role("combobox", name="Track", exact=True)
    assert "All tracks of the library" in road.inner_text()
    road.select_option("generated")
    page.get_by_label("Seeds from").fill("3")
    page.get_by_label("to", exact=True).fill("4")
    page.get_by_role("img", name="generated:3").wait_for()
    page.get_by_label("They race").select_option("time-trial")
    page.get_by_label("Starts on each track").fill("1")
    page.get_by_label("Time limit, s").fill("3")
    page.get_by_role("combobox", name=re.compile("^Car")).select_option("v4")
    with page.expect_request("**/api/contests/ladders") as sent:
        page.get_by_role("button", name="Start the ladder of 2").click()
    assert (sent.value.post_data_json["tracks"], sent.value.post_data_json["vehicle"]) == (["generated:3..4"], "v4")
    page.get_by_text("generator, seeds 3 to 4").wait_for()
    races = page.get_by_role("region", name="Races")
    races.get_by_text("generator, seed 4", exact=True).wait_for()
    assert races.get_by_text("generator, seed 3", exact=True).count() == 1
    page.get_by_role("button", name="Watch: ada against bob, race 2").or_(
        page.get_by_role("button", name="Watch: bob against ada, race 2")
    ).click()
    page.locator(".stage canvas").wait_for()


def test_a_best_lap_may_need_others_beside_it(visit: Visit) -> None:
    page = visit.open("/races/new")
    page.get_by_label("Title").fill("Steady")
    page.get_by_role("button", name="Best lap").click()
    page.get_by_label("Whole laps it takes").fill("2")
    page.get_by_role("combobox", name="Track").select_option("generated")
    page.get_by_label("Seed of the road").fill("5")
    page.get_by_role("img", name="generated:5").wait_for()
    page.get_by_role("combobox", name=re.compile("^Car")).select_option("own")
    page.get_by_label("mass", exact=True).fill("12")
    page.get_by_role("button", name="Make the race").click()
    page.get_by_text("Best lap (of at least 2)").wait_for()
    page.get_by_role("img", name="generated:5").wait_for()
    page.get_by_text("Held by these rules").click()
    assert page.locator("details").get_by_text("own numbers: mass 12", exact=True).is_visible()


@needs_axe
def test_the_facts_of_a_race_tell_its_car_and_what_is_otherwise(visit: Visit) -> None:
    client = visit.console.client
    own = {"vehicle": {"mass": 9.5, "speed_gain": 0.8}, "randomize": {"light": [0.8, 1]}, "track": "generated:1"}
    for title, asked, english, german in (
        ("Usual", {"track": "oval"}, ("v5, the original's last", "Nothing"), ("v5, das letzte dort", "Nichts")),
        (
            *("Otherwise", own),
            ("own numbers: mass 9.5 · speed_gain 0.8", "own ranges: light 0.8 – 1", "generator, seed 1"),
            ("eigene Zahlen: mass 9,5 · speed_gain 0,8", "eigene Bereiche: light 0,8 – 1", "Generator, Startzahl 1"),
        ),
    ):
        made = client.post("/api/races", json={"title": title, "trials": 1, "seed": 1, **asked}).json()
        page = visit.open(f"/races/{made['id']}")
        for told in english:
            page.locator(".facts").get_by_text(told, exact=True).wait_for()
        page.get_by_role("checkbox", name="ada").check()  # opens what makes the card beside it longer
        page.get_by_role("combobox", name="Add a ghost").wait_for()
        card, drawing = page.locator(".facts").bounding_box(), page.locator(".facts .drawing").bounding_box()
        assert card is not None
        assert drawing is not None
        assert drawing["y"] - card["y"] < 30  # not in the middle of nothing
        visit.look("light", "de")
        page = visit.open(f"/races/{made['id']}", width=390)
        for told in german:
            page.locator(".facts").get_by_text(told, exact=True).wait_for()
        assert visit.overflow() == 0
        visit.look("light", "en")
    page = visit.open("/races")
    drawn = page.locator("li", has_text="Otherwise")
    drawn.locator(".drawing svg").wait_for()  # it is in no list of tracks
    assert drawn.get_by_text("generator, seed 1 · ").count() == 1


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_in_open_forms(visit: Visit, theme: str) -> None:
    visit.look(theme)
    for path in ("/contests/new", "/races/new"):
        page = visit.open(path)
        for name in ("Car", "Otherwise than they know"):
            page.get_by_role("combobox", name=re.compile(f"^{name}")).select_option("own")
        page.get_by_role("combobox", name="Track").select_option("generated")
        for width in (1440, 390):
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(400)
            assert visit.violations() == []
            assert visit.overflow() == 0
    visit.look("light")
