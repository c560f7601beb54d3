"""A model's evaluation in a car, conditions and direction that are chosen on its page, in real headless Chromium."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
from browsers import Visit, needs_axe, needs_browser, needs_pages, visiting
from running_consoles import running_console

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with running_console(tmp_path_factory.mktemp("pages") / "runs") as console, visiting(console) as visit:
        console.create(name="ada", track="oval", until="3000 steps", seed=1)
        (job,) = console.client.get("/api/jobs").json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        usual = {"laps": 1, "num_trials": 1, "rules": "first_lap"}
        job = console.client.post("/api/models/ada/evaluations", json=usual).json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        yield visit
        assert visit.complaints == []


def test_a_car_and_conditions_are_chosen_and_told(visit: Visit) -> None:
    page = visit.open("/models/ada/race")
    page.get_by_text("Car: v5, the original's last · Direction: As drawn", exact=True).wait_for()
    page.get_by_role("spinbutton", name="Laps").fill("1")
    page.get_by_role("spinbutton", name="Trials").fill("1")
    page.get_by_role("checkbox", name="Otherwise than it learned").check()
    car = page.get_by_role("combobox", name=re.compile("^Car"))
    assert car.input_value() == ""
    car.select_option("own")
    numbers = json.dumps({"mass": 9.5, "speed_gain": 0.6}).encode()
    file = page.get_by_label("A vehicle file")
    file.set_input_files({"name": "car.json", "mimeType": "application/json", "buffer": numbers})
    mass = page.get_by_label("mass", exact=True)
    visit.console.wait_for(lambda: mass.input_value() == "9.5")
    page.get_by_role("combobox", name=re.compile("^Otherwise than it knows")).select_option("light")
    page.get_by_role("combobox", name="Direction").select_option("reverse")
    page.get_by_label("Resets allowed").fill("0")
    page.get_by_role("combobox", name="On the road").select_option("object-avoidance")
    page.get_by_label("Boxes", exact=True).fill("2")
    with page.expect_request("**/api/models/ada/evaluations") as sent:
        page.get_by_role("button", name="Start an evaluation").click()
    asked = sent.value.post_data_json
    assert (asked["vehicle"]["mass"], asked["vehicle"]["speed_gain"]) == (9.5, 0.6)
    assert (asked["randomize"], asked["direction"], asked["max_resets"]) == ("light", "reverse", 0)
    assert (asked["race"], asked["objects"], asked["placement"]) == ("object-avoidance", 2, "even")

    told = page.locator("summary", has_text="Car: own numbers: mass 9.5 · speed_gain 0.6 · Direction: The other way")
    told.wait_for()
    assert "Otherwise than it knows: Light, grip, camera: a little" in told.inner_text()
    assert "On the road: Boxes: 2" in told.inner_text()
    told.click()
    assert page.get_by_text("own numbers: mass 9.5 · speed_gain 0.6", exact=True).is_visible()
    assert page.locator("option", has_text="own numbers · The other way · Light").count() == 1
    page.locator("canvas[data-boxes='2']").wait_for()
    ghosts = page.get_by_label("Add a ghost")
    assert ghosts.locator("option", has_text=re.compile("20")).count() == 0  # the other was driven the other way

    visit.look("dark", "de")
    page = visit.open("/models/ada/race", width=390)
    told = page.locator("summary", has_text="Auto: eigene Zahlen: mass 9,5 · speed_gain 0,6 · Richtung: Andersherum")
    told.wait_for()
    assert visit.overflow() == 0
    page.get_by_role("checkbox", name="Anders als gelernt").check()
    page.get_by_text("zählen nicht als beste Runde des Modells").wait_for()
    assert visit.overflow() == 0
    visit.look("light", "en")


def test_what_was_looked_at_and_unticked_is_not_asked(visit: Visit) -> None:
    page = visit.open("/models/ada/race")
    otherwise = page.get_by_role("checkbox", name="Otherwise than it learned")
    otherwise.check()
    page.get_by_role("combobox", name=re.compile("^Car")).select_option("v4")
    otherwise.uncheck()
    page.get_by_role("spinbutton", name="Laps").fill("1")
    page.get_by_role("spinbutton", name="Trials").fill("1")
    with page.expect_response(lambda reply: reply.request.method == "POST") as sent:
        page.get_by_role("button", name="Start an evaluation").click()
    assert sent.value.request.post_data_json.keys() == {"laps", "num_trials", "as_car", "checkpoint"}
    visit.console.client.post(
        f"/api/jobs/{sent.value.json()['id']}/cancel"
    ).raise_for_status()  # a beginner takes minutes


@needs_axe
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_in_the_open_form(visit: Visit, theme: str) -> None:
    visit.look(theme)
    page = visit.open("/models/ada/race")
    page.get_by_role("checkbox", name="Otherwise than it learned").check()
    for name in ("Car", "Otherwise than it knows"):
        page.get_by_role("combobox", name=re.compile(f"^{name}")).select_option("own")
    for width in (1440, 390):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(400)
        assert visit.violations() == []
        assert visit.overflow() == 0
    visit.look("light")
