"""What the pages say when something is wrong: mistakes in code, a server that is gone, a browser that nobody knows."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsers import Visit, make_untrained, needs_browser, needs_pages, visiting
from running_consoles import LEISURELY, PATIENCE, running_console

from free_ports import free_port
from racecraft.reward import preset_names
from until_true import until_true

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with running_console(tmp_path_factory.mktemp("console") / "runs") as console:
        console.create(name="heron", track="oval", train=False)
        with visiting(console) as tab:
            yield tab


def _fresh(visit: Visit, path: str) -> Any:
    """A page for a new model in which nothing was typed."""
    visit.open("/settings").evaluate("sessionStorage.clear()")
    page = visit.open(path)
    page.get_by_text("The function is fine.").wait_for()
    return page


def _write(page: Any, text: str) -> None:
    page.locator(".cm-content").click()
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.press("Delete")
    page.keyboard.insert_text(text)


@pytest.mark.parametrize("path", ["/create", "/models/heron/setup"])
def test_the_line_of_a_mistake_is_marked_and_cleared(visit: Visit, path: str) -> None:
    page = _fresh(visit, path)
    assert page.locator(".cm-lintRange-error, .cm-lintPoint-error").count() == 0
    _write(page, "def reward_function(params):\n    return params['sped']\n")
    page.locator(".cm-lintRange-error").first.wait_for()
    marked = page.locator(".cm-line").filter(has=page.locator(".cm-lintRange-error"))
    assert [line.strip() for line in marked.all_inner_texts()] == ["return params['sped']"]
    _write(page, "def reward_function(params):\n    return params['speed']\n")
    page.get_by_text("The function is fine.").wait_for()
    assert page.locator(".cm-lintRange-error").count() == 0


def test_an_endless_loop_does_not_leave_the_error_before_it_standing(visit: Visit) -> None:
    page = _fresh(visit, "/create")
    _write(page, "def reward_function(params):\n    return params['sped']\n")
    page.get_by_text(re.compile("sped")).last.wait_for()
    page.locator(".danger").wait_for()
    _write(page, "def reward_function(params):\n    while True:\n        pass\n")
    page.get_by_text("Checking").wait_for()
    assert page.locator(".danger").count() == 0
    page.locator(".danger").wait_for()
    assert "sped" not in page.locator(".danger").inner_text()


def test_what_was_typed_for_a_new_model_outlives_a_reload(visit: Visit) -> None:
    page = _fresh(visit, "/create")
    _write(page, "def reward_function(params):\n    return 7.0\n")
    page.get_by_role("radio", name="Paperclip").click()
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_text("The function is fine.").wait_for()
    page.reload()
    page.get_by_text("return 7.0").wait_for()
    assert page.get_by_role("radio", name="Paperclip").get_attribute("aria-checked") == "true"
    assert page.get_by_role("button", name="Head to bot").get_attribute("aria-pressed") == "true"


def test_when_a_training_ends_is_shown_as_it_will_be_asked_for(visit: Visit) -> None:
    page = _fresh(visit, "/create")
    goals = page.get_by_role("group", name="Train until")
    laps = page.get_by_label("Laps of an evaluation to complete")
    assert laps.input_value() == "5"
    page.get_by_role("button", name="Object avoidance").click()
    page.get_by_role("checkbox", name="and no longer than").wait_for()
    until_true(page, "document.querySelectorAll('input[max=\"43200\"]').length")
    assert laps.input_value() == "20"
    assert page.get_by_label("Minutes").input_value() == "10"
    laps.fill("")
    laps.blur()
    assert laps.input_value() == "20"
    goals.get_by_role("button", name="Steps").click()
    page.get_by_label("Steps", exact=True).fill("64")
    page.reload()
    page.get_by_text("The function is fine.").wait_for()
    assert goals.get_by_role("button", name="Steps").get_attribute("aria-pressed") == "true"
    assert page.get_by_label("Steps", exact=True).input_value() == "64"
    goals.get_by_role("button", name="In words").click()
    page.get_by_label("'5 laps', 'no better lap'").fill("no better lap")
    page.reload()
    page.get_by_text("The function is fine.").wait_for()
    assert goals.get_by_role("button", name="In words").get_attribute("aria-pressed") == "true"


def test_a_track_is_learned_on_once_and_one_of_an_address_is_named(visit: Visit) -> None:
    page = _fresh(visit, "/create/generated:5")
    tracks = page.get_by_role("radiogroup", name="Track").get_by_role("radio")
    assert tracks.and_(page.locator("[tabindex='0']")).all_inner_texts() == ["generated:5"]
    more = page.get_by_label("one more track")
    one = more.locator("option").nth(1).inner_text()  # the first is none; which tracks there are depends on other tests
    more.select_option(label=one)
    page.get_by_role("button", name=f"Leave out: {one}").wait_for()
    tracks.filter(has_text=one).first.click()
    assert page.get_by_role("button", name=f"Leave out: {one}").count() == 0
    assert tracks.and_(page.locator("[aria-checked='true']")).count() == 1
    tracks.filter(has_text="generated:5").click()


def test_a_reward_is_tried_on_each_track_that_is_learned_on(visit: Visit) -> None:
    page = _fresh(visit, "/create/oval")
    _write(page, "def reward_function(params):\n    assert params['track_length'] < 20\n    return 1.0\n")
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_label("one more track").select_option("hairpin")
    page.get_by_text("It failed on the track 'hairpin', one of 2.").wait_for()
    page.get_by_role("button", name="Leave out: ").click()
    page.get_by_text("The function is fine.").wait_for()


def test_an_address_that_cannot_be_read_is_no_page(visit: Visit) -> None:
    page = visit.page
    page.goto(f"{visit.console.client.base_url}/models/%E0%A4%A")
    page.get_by_text("The console has no page at").wait_for()


def test_a_tab_that_a_model_has_not_is_no_page(visit: Visit) -> None:
    page = visit.open("/models/heron/races")
    page.get_by_text("The console has no page at /models/heron/races.").wait_for()


def test_a_name_with_a_space_is_refused_in_a_sentence(visit: Visit) -> None:
    client = visit.console.client
    for reply in (
        client.post("/api/models", json={"name": "my car", "train": False}),
        client.patch("/api/models/heron", json={"name": "my car"}),
    ):
        error = reply.json()["error"]
        assert (reply.status_code, error["field"], error["hint"]) == (422, "name", "Use 'my-car'.")
        assert "^" not in error["message"]
        assert "letters" in error["message"]


FAILS_LATER = """import math


def reward_function(params):
    if params["steps"] == 7:
        return 1 / 0
    return 1.0
"""


def test_a_failed_training_shows_its_line_and_names_a_button(visit: Visit) -> None:
    console = visit.console
    console.create(name="trips", track="oval", reward=FAILS_LATER, until="3000 steps")
    job = console.client.get("/api/jobs", params={"run": "trips"}).json()[0]
    ended = console.wait_for(console.job_ended(job["id"]))
    assert ended["state"] == "failed"
    assert "--resume" not in json.dumps(ended["error"])
    page = visit.open("/models/trips/watch")
    told = page.get_by_role("alert").filter(has_text="The training failed")
    told.wait_for()
    assert "racecraft train" not in told.inner_text()
    assert "6: return 1 / 0" in told.inner_text()
    assert not told.get_by_text("waypoints").is_visible()  # params are folded away
    told.get_by_text("What the reward function was called with").click()
    told.get_by_text("waypoints").wait_for()
    told.get_by_role("link", name="Correct the reward in the editor").click()
    page.locator(".cm-lintRange-error").first.wait_for()
    marked = page.locator(".cm-line").filter(has=page.locator(".cm-lintRange-error"))
    assert [line.strip() for line in marked.all_inner_texts()] == ["return 1 / 0"]


def test_an_import_without_a_track_is_offered_one(visit: Visit, tmp_path: Path) -> None:
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "reward_function.py").write_text("def reward_function(params):\n    return 1.0\n")
    metadata: dict[str, Any] = {
        "action_space": [{"steering_angle": a, "speed": 1.0, "index": i} for i, a in enumerate((-20, 0, 20))]
    }
    metadata |= {"sensor": ["FRONT_FACING_CAMERA"], "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"}
    (tmp_path / "model" / "model_metadata.json").write_text(json.dumps({**metadata, "version": "4"}))
    (tmp_path / "model" / "training_params.yaml").write_text("WORLD_NAME: nowhere_at_all\n")
    archive = shutil.make_archive(str(tmp_path / "stray"), "gztar", tmp_path / "model")
    page = visit.open("/")
    page.get_by_label("File to import").set_input_files(archive)
    told = page.get_by_role("alert").filter(has_text="needs a track")
    told.get_by_text("nowhere_at_all").wait_for()
    assert "--track" not in told.inner_text()
    told.get_by_role("combobox").select_option("oval")
    told.get_by_role("button", name="Import it on this track").click()
    page.get_by_role("link", name="Open the model").click()
    page.wait_for_url("**/models/stray*")
    name = page.url.rsplit("/models/", 1)[1].split("/")[0]
    assert visit.console.client.get(f"/api/models/{name}").json()["track"] == "oval"


METADATA = {
    "action_space": [{"steering_angle": "-25", "speed": "0.9", "index": 0}, {"steering_angle": 25, "speed": 0.9}],
    "sensor": ["STEREO_CAMERAS"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "4",
}


def test_files_of_the_original_are_taken_over_on_a_new_model(visit: Visit) -> None:
    page = _fresh(visit, "/create")
    files = {
        "model_metadata.json": json.dumps(METADATA),
        "hyperparameters.json": json.dumps({"lr": 0.0007, "batch_size": 128, "made_up": 1}),
        "mine.py": "def reward_function(params):\n    return 7.25\n",
        "notes.json": "{}",
    }
    payload = [{"name": name, "mimeType": "text/plain", "buffer": text.encode()} for name, text in files.items()]
    page.get_by_label("Files of AWS").first.set_input_files(payload)  # type: ignore[arg-type]
    page.get_by_text("notes.json: This is neither").wait_for()
    page.get_by_text("mine.py was taken over.").wait_for()
    page.get_by_text(re.compile("hyperparameters.json was taken over, but .* made_up")).wait_for()
    page.get_by_text("return 7.25").wait_for()
    page.get_by_role("button", name="Action 1: left 25°, 0.90 m/s").wait_for()
    page.locator("summary", has_text="Learning").click()
    assert page.locator("#hp-lr").input_value() == "0.0007"
    page.locator("summary", has_text="More settings").click()
    page.get_by_role("textbox", name="Name").fill("veteran")
    page.route("**/api/models", make_untrained)
    page.get_by_role("button", name="Train now").first.click()
    page.wait_for_url("**/models/veteran*")
    page.unroute("**/api/models")
    made = visit.console.client.get("/api/models/veteran").json()
    assert made["reward"] == files["mine.py"]
    assert made["model_metadata"]["sensor"] == ["STEREO_CAMERAS"]
    assert made["settings"]["network"] == METADATA["neural_network"]
    assert [action["steering_angle"] for action in made["model_metadata"]["action_space"]] == [-25, 25]
    assert made["hyperparameters"]["lr"] == 0.0007
    assert made["hyperparameters"]["batch_size"] == 128


def test_a_reward_is_chosen_by_its_picture_and_brings_what_it_needs(visit: Visit) -> None:
    page = _fresh(visit, "/create")
    cards = page.get_by_role("radiogroup", name="Preset").get_by_role("radio")
    assert cards.count() == len(preset_names())
    assert cards.filter(has_text="racing").first.get_attribute("aria-checked") == "true"
    page.locator(".cards svg path").first.wait_for()
    colours = (
        cards.filter(has_text="centerline")
        .locator("path")
        .evaluate_all("cells => new Set(cells.map((cell) => cell.getAttribute('fill'))).size")
    )
    assert colours >= 3
    cards.filter(has_text="dodge").click()
    page.get_by_text("This reward looks out for boxes").wait_for()
    page.get_by_role("button", name="Put boxes on the road").click()
    assert page.get_by_role("button", name="Object avoidance").get_attribute("aria-pressed") == "true"
    assert page.get_by_text("This reward looks out for boxes").count() == 0


def test_nothing_is_drawn_while_nothing_moves(visit: Visit) -> None:
    from playwright.sync_api import expect

    page = visit.open("/models/heron/watch")
    canvas = page.locator(".scene canvas")
    canvas.wait_for()
    page.evaluate(
        "() => { const ask = requestAnimationFrame; window.asked = 0;"
        " window.requestAnimationFrame = (draw) => { window.asked++; return ask(draw); }; }"
    )
    expect(canvas).not_to_have_attribute("width", "300")  # the scene is there
    asked = [1]
    while asked[-1] and len(asked) < 60:  # the last frame, a sharp one, comes after a moment
        page.evaluate("window.asked = 0")
        page.wait_for_timeout(1000)
        asked.append(page.evaluate("window.asked"))
    assert asked[-1] == 0, asked
    before = canvas.screenshot()
    page.get_by_role("button", name="From above").click()
    visit.console.wait_for(lambda: page.evaluate("window.asked") > 0)
    visit.console.wait_for(lambda: canvas.screenshot() != before)


def test_a_waiting_model_says_what_it_waits_for(visit: Visit) -> None:
    console = visit.console
    console.create(name="first", track="oval", until="10 minutes", reward=LEISURELY)
    console.create(name="second", track="oval", until="1000 steps")
    page = visit.open("/models/second/watch")
    page.get_by_text("Waiting until there is room: first first").wait_for()
    assert page.get_by_text("Starting").count() == 0
    for name in ("second", "first"):
        console.client.post(f"/api/models/{name}/stop")
        job = console.client.get("/api/jobs", params={"run": name}).json()[0]
        console.wait_for(console.job_ended(job["id"]))


def test_an_unknown_browser_is_told_how_to_get_in(visit: Visit) -> None:
    browser = visit.page.context.browser
    assert browser is not None
    page = browser.new_context().new_page()
    page.goto(f"{visit.console.client.base_url}/create")
    page.get_by_role("heading", name="This browser is not known here").wait_for()
    assert page.get_by_text("Loading").count() == 0
    assert page.get_by_role("navigation").count() == 0
    page.context.close()


def test_a_lost_network_is_one_banner_and_everything_comes_back(visit: Visit) -> None:
    visit.open("/settings").evaluate("sessionStorage.clear()")
    page = visit.open("/settings")
    page.context.set_offline(True)
    page.get_by_role("link", name="Tracks").click()
    page.get_by_role("link", name="New model").click()
    page.get_by_role("alert").get_by_text("The console does not answer.").wait_for()
    assert page.locator(".toast").count() == 0
    assert page.get_by_role("radio").count() == 0
    page.context.set_offline(False)
    page.get_by_role("alert").wait_for(state="detached")
    page.get_by_role("radio", name="Paperclip").wait_for()
    page.get_by_text("The function is fine.").wait_for()
    assert page.locator(".toast").count() == 0


def test_a_server_that_is_gone_is_said_over_cars_that_look_frozen(visit: Visit, runs: Path) -> None:
    browser = visit.page.context.browser
    assert browser is not None
    port = str(free_port())
    with running_console(runs, "--port", port) as console:
        console.create(name="stork", track="oval", until="10 minutes", reward=LEISURELY)
        address = str(console.client.base_url).rstrip("/")
        context = browser.new_context()
        cookie = console.client.cookies["racecraft_session"]
        context.add_cookies([{"name": "racecraft_session", "value": cookie, "url": address}])
        page = context.new_page()
        page.set_default_timeout(1000 * PATIENCE)
        page.goto(f"{address}/models/stork/watch")
        page.get_by_text(re.compile(r"\d+ cars learning at once")).wait_for()
        page.locator(".scene canvas").first.wait_for()
        console.kill()
        page.get_by_role("alert").get_by_text("The console does not answer.").wait_for()
        assert page.get_by_text("cars learning at once").count() == 0
        assert "grayscale" in page.locator(".scene canvas").first.evaluate("canvas => getComputedStyle(canvas).filter")
        with running_console(runs, "--port", port) as again:
            page.get_by_role("alert").wait_for(state="detached")
            page.get_by_text(re.compile(r"\d+ cars learning at once")).wait_for()
            job = again.client.get("/api/jobs", params={"run": "stork"}).json()[0]
            again.client.post("/api/models/stork/stop")
            again.wait_for(again.job_ended(job["id"]))
        context.close()


def test_of_a_model_that_is_not_there_nothing_but_the_model_is_asked(visit: Visit) -> None:
    asked: list[str] = []
    page = visit.page
    note = lambda request: asked.append(request.url.partition("/api/")[2])  # noqa: E731
    page.on("request", note)
    visit.open("/models/gone/watch")
    page.get_by_text("There is no model gone; it may have been renamed or deleted.").wait_for()
    page.remove_listener("request", note)
    assert [path for path in asked if "gone" in path] == ["models/gone"]


def test_a_track_that_is_gone_is_no_mistake_of_the_reward(visit: Visit) -> None:
    console = visit.console
    drawing = console.client.get("/api/tracks/oval/sketch").json()
    assert console.client.put("/api/tracks/mine", json=drawing).status_code == 200
    console.create(name="homeless", track="mine", train=False)
    assert console.client.delete("/api/tracks/mine").status_code == 204
    page = visit.open("/models/homeless/watch")
    page.get_by_label("Live").get_by_text("Track 'mine' does not exist.").wait_for()
    page = visit.open("/models/homeless/setup")
    said = page.get_by_text(re.compile("Track 'mine' does not exist"))
    said.wait_for()
    assert said.inner_text().strip() == "Track 'mine' does not exist."
    assert page.locator(".cm-lint-marker, .cm-lintRange").count() == 0


def test_what_one_tab_does_the_other_sees(visit: Visit) -> None:
    console, first = visit.console, visit.page
    console.create(name="two", track="oval", until="10 minutes", reward=LEISURELY, train=False)
    visit.open("/models/two/watch")
    second = first.context.new_page()
    second.set_default_timeout(1000 * PATIENCE)
    second.goto(first.url)
    second.get_by_role("button", name="Train now").click()
    for page in (first, second):
        page.get_by_role("button", name="Stop").wait_for()
    first.get_by_role("button", name="Stop").click()
    for page in (first, second):
        page.get_by_role("button", name="Go on training").wait_for()
    console.client.delete("/api/models/two")
    gone = second.get_by_text("There is no model").first
    second.get_by_role("button", name="Go on training").or_(gone).first.click()  # it may have been told by then
    gone.wait_for()
    second.close()


def test_when_a_training_ends_is_said_and_understood_in_german(visit: Visit) -> None:
    console = visit.console
    console.create(name="swift", track="oval", until="20000 steps or 30 minutes", train=False)
    visit.look("light", "de")
    page = visit.open("/models/swift/watch")
    goal = page.get_by_label("Weiter bis")
    assert goal.get_attribute("placeholder") == "30 Minuten oder 20000 Schritte"
    goal.fill("64 Schritte oder 1,5 Minuten")
    page.get_by_role("button", name="Jetzt trainieren").click()
    page.get_by_role("button", name="Weiter trainieren").wait_for()
    assert 64 <= (driven := console.client.get("/api/models/swift").json())["steps"] < 20_000
    page.get_by_role("button", name="Weiter trainieren").click()
    page.get_by_text("Modell 'swift' ist schon so weit, wie es kommen soll, und würde nichts lernen.").wait_for()
    page.get_by_text(re.compile(r"Schritte und Minuten zählen von Anfang an, bisher [\d.]+ und \d,\d\.")).wait_for()
    goal.and_(page.locator(":focus")).wait_for()
    refused = console.client.post("/api/models/swift/train", json={"until": "64 steps", "reward": LEISURELY})
    assert (refused.status_code, refused.json()["error"]["code"]) == (409, "Conflict")
    assert console.client.get("/api/models/swift").json() == driven  # its reward, too
    visit.look("light")


def test_what_is_wrong_is_said_in_the_language_of_the_page(visit: Visit) -> None:
    visit.look("light", "de")
    page = visit.page
    page.evaluate("sessionStorage.clear()")
    visit.open("/create")
    page.get_by_text("Die Funktion ist in Ordnung.").wait_for()
    _write(page, "def reward_function(params):\n    return params['sped']\n")
    page.get_by_text("params hat keinen Schlüssel 'sped'. Meintest du 'speed'?").wait_for()
    _write(page, "def reward_function(params):\n    return 1 / (params['speed'] * 0)\n")
    told = page.locator(".danger", has_text="Die Belohnungsfunktion löste ZeroDivisionError")
    told.wait_for()
    assert "params =" not in told.inner_text()  # what is long is folded away
    folded = told.locator("xpath=following-sibling::details[1]")
    called = folded.locator("pre", has_text="Aufgerufen wurde sie mit params = {'all_wheels_on_track'")
    assert not called.is_visible()
    folded.locator("summary").click()
    called.wait_for()
    _write(page, "def reward_function(params):\n    return 1.0\n")
    page.get_by_text("Die Funktion ist in Ordnung.").wait_for()
    page.locator("summary", has_text="Weitere Einstellungen").click()
    page.get_by_role("textbox", name="Name").fill("heron")
    page.get_by_role("button", name="Jetzt trainieren").first.click()
    page.get_by_text("Ein Modell 'heron' gibt es schon.").first.wait_for()
    visit.look("light")
    assert visit.console.client.get("/api/models/gone").json()["error"]["message"] == "There is no model 'gone'."
