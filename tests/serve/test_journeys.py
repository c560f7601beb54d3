"""Four people's ways through the console, each to something to show, on one server with what they train."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsers import Visit, needs_browser, needs_pages, visiting
from running_consoles import running_console

from racecraft.replay import read_replay, verify
from racecraft.replay.in_picture import SIGNATURE

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]

FILES: dict[str, str] = {
    "model_metadata.json": json.dumps(
        {
            "action_space": [{"steering_angle": angle, "speed": 1.0} for angle in (-25, 0, 25)],
            "sensor": ["FRONT_FACING_CAMERA"],
            "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
            "version": "5",
        }
    ),
    "reward_function.py": "def reward_function(params):\n    return float(params['all_wheels_on_track'])\n",
}


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with running_console(tmp_path_factory.mktemp("journeys") / "runs") as console, visiting(console) as visit:
        yield visit
        assert visit.complaints == []


NAME_OF_WHERE_ONE_IS = """(() => {
  const here = document.activeElement;
  return here.getAttribute("aria-label") || here.labels?.[0]?.innerText.trim() || here.textContent.trim();
})()"""


def reach(page: Any, name: str) -> None:
    """Go to what is called so by the Tab key, once it is there."""
    there = page.get_by_role("button", name=name).or_(page.get_by_role("link", name=name))
    there.or_(page.get_by_role("spinbutton", name=name)).first.wait_for()
    for _ in range(120):
        page.keyboard.press("Tab")
        if page.evaluate(NAME_OF_WHERE_ONE_IS) == name:
            return
    raise AssertionError(f"The Tab key does not come by {name!r}.")


def press(page: Any, name: str) -> None:
    """A button or a link."""
    reach(page, name)
    page.keyboard.press("Enter")


def write(page: Any, name: str, text: str) -> None:
    """Into a field, instead of what is there."""
    reach(page, name)
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.type(text)


def trained(visit: Visit) -> dict[str, Any]:
    """The newest model, once it has learned."""
    client = visit.console.client
    (job, *_) = client.get("/api/jobs").json()
    assert visit.console.wait_for(visit.console.job_ended(job["id"]))["state"] == "done"
    return dict(client.get(f"/api/models/{job['run']}").json())


def test_a_pupil_trains_a_car_by_keyboard_alone(visit: Visit) -> None:
    page = visit.open("/create/oval")
    page.get_by_role("radio", checked=True, name="Paperclip").wait_for()
    press(page, "Train now")
    page.wait_for_url("**/models/**")
    card = trained(visit)
    assert card["completion"] == 1
    assert card["best_lap"] is not None
    press(page, "Evaluate it against the clock")
    page.wait_for_url("**/race")
    write(page, "Laps", "1")
    write(page, "Trials", "1")
    press(page, "Start an evaluation")
    page.get_by_role("link", name="As a picture").wait_for()
    with page.expect_download() as sent:
        press(page, "As a picture")
    picture = sent.value.path()
    assert picture.read_bytes().startswith(SIGNATURE)
    assert verify(read_replay(picture)).is_genuine  # a picture to send, and its proof inside


def test_a_veteran_brings_files_of_aws_and_takes_an_archive_home(visit: Visit) -> None:
    visit.look("dark", "de")
    page = visit.open("/create/oval", width=390)
    page.locator("input[type=file]").set_input_files(
        [{"name": name, "mimeType": "text/plain", "buffer": text.encode()} for name, text in FILES.items()]
    )
    page.get_by_text("reward_function.py wurde übernommen").wait_for()
    page.get_by_role("button", name="In Worten").click()
    page.locator("section", has_text="Bis wann").get_by_role("textbox").fill("500 steps")
    page.get_by_role("button", name="Jetzt trainieren").first.click()
    page.wait_for_url("**/models/**")
    assert visit.overflow() <= 0
    model = trained(visit)
    assert model["reward"] == FILES["reward_function.py"]
    assert len(model["model_metadata"]["action_space"]) == 3
    archive = visit.console.client.get(f"/api/models/{model['name']}/archive")
    assert archive.content[:2] == b"\x1f\x8b"


def test_a_racer_lets_both_meet_and_a_spectator_watches(visit: Visit, tmp_path: Path) -> None:
    visit.look("dark", "en")
    page = visit.open("/contests/new")
    page.get_by_role("button", name="Add all").click()
    page.get_by_label("Title").fill("Final")
    page.get_by_label("Resets allowed").fill("1")  # beginners: the film is short
    page.get_by_role("button", name="Start the heat with 2").click()
    page.get_by_role("heading", name="The heat in 3D").wait_for()
    (heat,) = visit.console.client.get("/api/contests").json()
    assert heat["winner"]
    with page.expect_download() as sent:
        page.get_by_role("link", name="As a page").click()
    sent.value.save_as(tmp_path / "heat.html")
    offline = page.context.new_page()
    offline.goto((tmp_path / "heat.html").as_uri())
    offline.get_by_role("heading", name="Final").wait_for()
    second = offline.locator("button.car").nth(1)
    second.click()
    assert second.get_attribute("aria-pressed") == "true"
    visit.console.wait_for(lambda: float(offline.locator("#clock").inner_text().split()[0]) > 0.5)
    offline.close()

    visit.look("light", "de")
    page = visit.open("/races", width=390)
    page.get_by_role("link", name="Final").click()
    page.get_by_role("heading", name="Der Lauf in 3D").wait_for()
    page.locator(".stage canvas").wait_for()
    assert visit.overflow() <= 0
    clock = page.locator(".controls .number")
    visit.console.wait_for(lambda: float(clock.inner_text().split()[0].replace(",", ".")) > 0.5)
    assert "," in clock.inner_text()
    with page.expect_download() as sent:
        page.get_by_role("link", name="Datei").click()
    assert sent.value.path().read_bytes().startswith(b"RACECRAFTREPLAY")
