"""Create, watch, race, analyse and compare in real headless Chromium, against a real server and short trainings."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from browsers import AXE, THEMES, complaints_of, needs_axe, needs_browser, needs_pages, violations_by_theme, visiting
from running_consoles import RunningConsole, running_console

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def studio() -> Iterator[tuple[RunningConsole, Page]]:
    """A console with two small models that have raced, and a page in it; complaints of the page fail the tests."""
    with (
        tempfile.TemporaryDirectory() as folder,
        running_console(Path(folder) / "runs") as console,
        visiting(console) as tab,
    ):
        for name, reward in (("left", "racing"), ("right", "centerline")):
            console.create(name=name, track="oval", until="6000 steps", seed=1, reward=reward)
            job = console.client.get("/api/jobs", params={"run": name}).json()[0]
            assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
            request = {"laps": 1, "num_trials": 2, "rules": "first_lap"}
            job = console.client.post(f"/api/models/{name}/evaluations", json=request).json()
            assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        yield console, tab.page
        assert tab.complaints == []


def visit(studio: tuple[RunningConsole, Any], path: str) -> Any:
    console, page = studio
    page.goto(f"{console.client.base_url}{path}")
    page.locator("h1").wait_for()
    return page


def test_an_action_is_pulled_and_pushed_and_the_model_is_made_of_it(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/create")
    page.get_by_text("The function is fine.").wait_for()
    first = page.get_by_role("button", name="Action 0: right 30°")
    first.focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowUp")
    page.get_by_role("button", name="Action 0: right 29°, 1.10 m/s").wait_for()
    assert page.get_by_role("spinbutton", name="Speed 0").input_value() == "1.1"
    page.get_by_role("spinbutton", name="Steering 1", exact=True).fill("-12.5")
    page.keyboard.press("Tab")
    box = page.get_by_role("button", name="Action 5: straight").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 - 60, box["y"] + box["height"] / 2 + 20, steps=5)
    page.mouse.up()
    assert page.get_by_role("button", name="Action 5: straight").count() == 0
    page.get_by_role("button", name="Add an action").click()
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_role("spinbutton", name="Bot cars").fill("2")
    page.get_by_role("group", name="Train until").get_by_role("button", name="Steps").click()
    page.get_by_role("spinbutton", name="Steps").fill("2000")
    page.locator("summary", has_text="Learning").click()
    algorithm = page.get_by_label("Algorithm")
    assert algorithm.input_value() == "distill"  # among bots a teacher goes first
    assert page.locator("#hp-lr").count() == 0
    algorithm.select_option("ppo")
    rate = page.locator("#hp-lr")
    rate.fill("0.005")
    rate.press("Tab")
    page.get_by_text("Outside of what is safe").wait_for()
    page.locator("summary", has_text="More settings").click()
    page.get_by_role("textbox", name="Name").fill("mine")
    page.get_by_role("radio", name="Paperclip").click()
    page.get_by_role("button", name="Train now").first.click()
    page.get_by_text("cars learning at once").or_(page.locator(".badge.finished")).first.wait_for()
    made = studio[0].client.get("/api/models/mine").json()
    actions = made["model_metadata"]["action_space"]
    assert len(actions) == 11
    assert (actions[0]["steering_angle"], actions[0]["speed"]) == (-29, 1.1)
    assert actions[1]["steering_angle"] == -12.5
    assert actions[5]["steering_angle"] > 0
    assert made["settings"]["objects"]["bots"]["count"] == 2
    assert made["settings"]["ppo"]["learning_rate"] == 0.005
    page.locator(".badge.finished").wait_for()


def test_a_reward_is_painted_along_the_last_laps_of_a_model(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/create/oval")
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_label("Paint it along the last laps of").select_option("left")
    page.get_by_text("Paid for these laps").wait_for()


def test_a_lap_is_scrubbed_with_a_ghost_beside_it(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/left/race")
    page.get_by_role("slider", name="Moment of the lap").wait_for()
    page.get_by_label("Add a ghost").select_option(label="right")
    page.get_by_role("button", name="Remove the ghost: right").wait_for()
    page.get_by_text("Time behind the chosen lap").first.wait_for()
    slider = page.get_by_role("slider", name="Moment of the lap")
    slider.fill("1")
    assert slider.get_attribute("aria-valuetext") == "1.00\xa0s"
    place = page.locator(".now").get_attribute("cx")
    page.get_by_role("img", name="Speed, m/s").click(position={"x": 300, "y": 60})
    page.locator(f".now:not([cx='{place}'])").wait_for(state="attached")
    page.get_by_role("button", name="Driver").click()
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    page.get_by_role("region", name="Results").locator("tbody tr").nth(1).wait_for()
    assert page.get_by_role("region", name="Results").locator("tbody tr").count() == 2
    page.get_by_role("heading", name="Why is").or_(page.get_by_text("To say why")).wait_for()


def test_a_model_is_driven_as_a_car_and_taken_to_one(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/right/race")
    page.get_by_role("spinbutton", name="Trials").fill("1")
    page.get_by_role("spinbutton", name="Laps").fill("1")
    page.get_by_role("checkbox", name="As a car drives it").check()
    page.get_by_role("button", name="Start an evaluation").click()
    page.get_by_role("img", name="Commanded against resulting").wait_for()
    assert page.locator("option", has_text="as a car").count() == 1
    page.locator("summary", has_text="What a car does otherwise").click()
    page.get_by_text("throttle").first.wait_for()
    with page.expect_download() as download:
        page.get_by_role("link", name="Download for a car").click()
    assert download.value.suggested_filename == "right.tar.gz"
    assert Path(download.value.path()).read_bytes().startswith(b"\x1f\x8b")

    chosen = page.locator("select", has=page.locator("option", has_text="as a car"))
    first = studio[0].client.get("/api/models/right/evaluations").json()[-1]["stamp"]
    chosen.select_option(first)
    steps = studio[0].client.get("/api/models/right").json()["steps"]
    job = studio[0].client.post("/api/models/right/train", json={"until": "10 minutes"}).json()
    page.locator(".badge.training").wait_for()
    studio[0].wait_for(lambda: studio[0].client.get("/api/models/right").json()["steps"] > steps)
    studio[0].client.post("/api/models/right/stop")
    assert studio[0].wait_for(studio[0].job_ended(job["id"]))["state"] == "done"
    page.locator(".badge.stopped").wait_for()
    assert chosen.input_value() == first


@pytest.mark.parametrize(("kind", "begins"), [("CSV", b'"Place'), ("SVG", b"<svg"), ("PNG", b"\x89PNG")])
def test_a_chart_is_kept_as_a_file(studio: tuple[RunningConsole, Any], kind: str, begins: bytes) -> None:
    page = visit(studio, "/models/left/race")
    page.locator(".u-over").first.wait_for()
    page.locator("summary[aria-label*='Speed, m/s']").click()
    with page.expect_download() as download:
        page.get_by_role("button", name=kind, exact=True).locator("visible=true").click()
    assert download.value.suggested_filename == f"speed-m-s.{kind.lower()}"
    assert Path(download.value.path()).read_bytes().startswith(begins)


def test_maps_and_saliency(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/left/analysis")
    map_of = page.get_by_role("img", name="Where it happened: Reward")
    map_of.wait_for()
    assert page.locator("section[aria-label='Where it happened'] svg path").count() > 50
    page.get_by_role("button", name="Action", exact=True).click()
    page.get_by_role("img", name="Where it happened: Action").wait_for()
    page.get_by_role("checkbox", name="The whole training").uncheck()
    page.get_by_text("Iteration 0").wait_for()
    page.get_by_text("Grad-CAM on conv2").wait_for()
    looks, believes = (page.locator(f"canvas[aria-label^='What {name}']") for name in ("the policy", "perception"))
    page.get_by_text("In the way").wait_for()
    before = looks.screenshot(), believes.screenshot()
    page.get_by_role("slider", name="Moment of the lap").fill("30")
    studio[0].wait_for(lambda: looks.screenshot() != before[0])
    studio[0].wait_for(lambda: believes.screenshot() != before[1])
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the report").click()
    assert b"Laps of the last evaluation" in Path(download.value.path()).read_bytes()


def test_a_map_that_was_asked_for_before_does_not_come_after(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/left/analysis")
    told = page.get_by_role("region", name="Where it happened").locator(".controls .number")
    told.wait_for()
    whole = told.inner_text()
    assert page.get_by_role("slider", name="Iteration").get_attribute("max") != "0"
    held: list[Any] = []
    page.route("**/maps?*", lambda route: route.continue_() if held else held.append(route))
    box = page.get_by_role("checkbox", name="The whole training")
    box.uncheck()
    studio[0].wait_for(lambda: page.wait_for_timeout(50) or held)
    with page.expect_response("**/maps?*"):
        box.check()
    with page.expect_response("**/maps?*"):
        held[0].continue_()  # late
    page.wait_for_timeout(300)
    studio[0].wait_for(lambda: told.inner_text() == whole)  # and what came late would have stayed
    page.unroute("**/maps?*")


def test_models_are_compared(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/compare/left")
    page.locator(".picks button:first-child[aria-pressed=true]", has_text="left").wait_for()  # before newer ones
    page.get_by_role("button", name="right Paperclip").click()
    page.wait_for_url("**/compare/left/right")
    page.get_by_role("region", name="Reward code").wait_for()
    assert page.locator("tr.removed").count() > 3
    page.get_by_role("region", name="Results").locator("tbody tr").nth(1).wait_for()
    assert page.get_by_role("region", name="Results").locator("tbody tr").count() == 2


def test_models_that_are_compared_are_asked_for_once(studio: tuple[RunningConsole, Any]) -> None:
    """Also where one answer comes before the other."""
    page = studio[1]
    asked: list[str] = []

    def note(request: Any) -> None:
        path = request.url.partition("/api/models/")[2]
        asked.extend([path] if path in ("left", "right") or path.endswith("history?offset=0") else [])

    page.on("request", note)
    visit(studio, "/compare/left/right")
    page.get_by_role("region", name="Results").locator("tbody tr").nth(1).wait_for()
    studio[0].wait_for(lambda: page.wait_for_timeout(500) or len(asked) >= 4)
    page.remove_listener("request", note)
    assert sorted(asked) == ["left", "left/history?offset=0", "right", "right/history?offset=0"]


def test_a_model_is_compared_with_another_that_is_still_chosen(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/compare/left/right")
    code = page.get_by_role("region", name="Reward code")
    code.wait_for()
    page.get_by_role("combobox", name="left →").select_option("right")
    page.get_by_role("button", name="left Paperclip").click()
    page.wait_for_url("**/compare/right")
    page.get_by_role("button", name="left Paperclip").click()
    page.wait_for_url("**/compare/right/left")
    assert page.get_by_role("combobox", name="right →").input_value() == "left"
    code.wait_for()
    assert page.locator("tr.removed").count() > 3


def test_models_are_chosen_in_the_garage_to_be_compared(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/")
    page.get_by_role("button", name="Compare left").click()
    assert page.get_by_role("region", name="Compare").get_by_role("button", name="Compare").is_disabled()
    page.get_by_role("button", name="Compare right").click()
    page.get_by_text("2 of at most 6 models are chosen.").wait_for()
    page.get_by_role("region", name="Compare").get_by_role("button", name="Compare").click()
    page.wait_for_url("**/compare/left/right")
    page.get_by_role("region", name="Results").locator("tbody tr").nth(1).wait_for()
    assert page.get_by_role("region", name="Results").locator("tbody tr").count() == 2


def test_the_garage_clones_renames_tags_finds_deletes_and_undoes(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/")
    card = page.locator("li.card")

    def of(name: str) -> Any:
        return card.filter(has=page.get_by_role("heading", name=name, exact=True))

    of("left").get_by_role("button", name="Clone").click()
    of("left-2").get_by_role("button", name="Rename").click()
    page.get_by_label("New name").fill("twin")
    page.get_by_label("Tags").fill("oval, slow")
    page.get_by_role("button", name="Save").click()
    of("twin").get_by_text("oval, slow").wait_for()
    page.get_by_role("searchbox").fill("slow")
    of("left").wait_for(state="detached")
    assert card.count() == 1
    of("twin").get_by_role("button", name="Delete").click()
    of("twin").wait_for(state="detached")
    page.get_by_role("button", name="Undo").last.click()
    of("twin").wait_for()
    assert studio[0].client.get("/api/models/twin").json()["tags"] == ["oval", "slow"]
    assert studio[0].client.delete("/api/models/twin").status_code < 300


def test_tabs_and_tracks_are_chosen_with_arrow_keys(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/left/watch")
    page.get_by_role("tab", name="Watch").press("ArrowRight")
    page.wait_for_url("**/models/left/race")
    assert page.evaluate("document.activeElement.textContent") == "Evaluation"
    page.keyboard.press("End")
    page.wait_for_url("**/models/left/setup")
    page = visit(studio, "/create")
    page.get_by_role("radio", name="Las Vegas").press("ArrowLeft")
    assert page.get_by_role("radio", name="Thunder Bowl").get_attribute("aria-checked") == "true"


def test_numbers_are_searched_and_the_best_becomes_a_model(studio: tuple[RunningConsole, Any]) -> None:
    pytest.importorskip("optuna")
    page = visit(studio, "/models/left/tune")
    page.get_by_role("checkbox", name="Learning rate").wait_for()
    for box in page.get_by_role("checkbox").all():
        if box.is_visible() and "gamma" not in box.locator("..").inner_text():
            box.uncheck()
    page.get_by_role("spinbutton", name="gamma, up to").fill("0.99")
    page.get_by_role("spinbutton", name="Steps per trial").fill("2000")
    page.get_by_role("button", name="Start searching").click()
    page.get_by_role("region", name="Trials").locator("tbody tr").nth(1).wait_for()
    page.get_by_role("button", name="Make a model of the best").wait_for()  # the first is over
    page.get_by_role("button", name="Stop").last.click()
    page.locator(".badge.finished", has_text="Ended").wait_for()
    page.get_by_role("button", name="Make a model of the best").click()
    page.get_by_role("button", name="Open the model").click()
    page.get_by_role("heading", name="left-tuned").wait_for()
    assert 0.9 <= studio[0].client.get("/api/models/left-tuned").json()["settings"]["ppo"]["gamma"] <= 0.99


def test_training_goes_on_with_a_changed_reward(studio: tuple[RunningConsole, Any]) -> None:
    page = visit(studio, "/models/right/setup")
    editor = page.locator(".cm-content")
    editor.click()
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.press("Delete")  # or Chromium gives the new text the look of the old, which the policy forbids
    page.keyboard.insert_text("def reward_function(params):\n    return params['speed']\n")
    page.get_by_role("button", name="Undo the changes").wait_for()
    page.get_by_role("tab", name="Log").click()
    page.get_by_role("tab", name="Set-up").click()
    editor.get_by_text("return params['speed']").wait_for()
    steps = studio[0].client.get("/api/models/right").json()["steps"]
    page.get_by_label("Go on until").last.fill(f"{steps + 500} steps")
    page.get_by_role("button", name="Go on with this reward").click()
    page.wait_for_url("**/models/right/watch")
    page.locator(".badge.finished").wait_for()
    assert studio[0].client.get("/api/models/right").json()["reward"].endswith("return params['speed']\n")


@dataclass
class Tour:
    """All pages of the studio, opened once."""

    foreign: list[str] = field(default_factory=list)
    """What was asked of another server."""
    complaints: list[str] = field(default_factory=list)
    violations: dict[str, dict[str, Any]] = field(default_factory=lambda: {theme: {} for theme in THEMES})
    """What axe finds, by theme and page."""


@pytest.fixture(scope="module")
def tour(studio: tuple[RunningConsole, Any]) -> Tour:
    console, first = studio
    found, own = Tour(), str(console.client.base_url)

    def guard(route: Any) -> None:
        if route.request.url.startswith(own):
            route.continue_()
        else:
            found.foreign.append(route.request.url)
            route.abort()

    first.context.route("**/*", guard)
    stranger = first.context.new_page()
    with pytest.raises(Exception, match="ERR_FAILED"):  # the guard does catch what leaves
        stranger.goto("http://racecraft.invalid/")
    stranger.close()
    assert found.foreign == ["http://racecraft.invalid/"]
    found.foreign.clear()
    page = first.context.new_page()
    page.on("console", lambda message: found.complaints.extend(complaints_of(message)))
    page.on("pageerror", lambda error: found.complaints.append(str(error)))
    page.on("websocket", lambda socket: found.foreign.append(socket.url))
    models = [f"/models/left/{tab}" for tab in ("watch", "race", "analysis", "tune", "log", "setup")]
    looked_at = ("/", "/create", "/compare/left/right", "/drive/oval/left", "/lessons", "/lessons/1", *models)
    for path in (*looked_at, "/tracks", "/draw", "/drive/oval", "/races", "/races/new", "/settings"):
        visit((console, page), path)
        page.wait_for_timeout(1500 if path in looked_at else 700)
        if path in looked_at and AXE.exists():
            page.evaluate("document.querySelectorAll('details:not(.keep)').forEach(part => { part.open = true; })")
            known = len(found.complaints)
            for theme, there in violations_by_theme(page).items():
                found.violations[theme] |= {path: there} if there else {}
            del found.complaints[known:]  # axe itself tries what the page's policy forbids
    first.context.unroute("**/*")
    page.close()
    return found


def test_every_page_works_without_any_network_but_its_own_server(tour: Tour) -> None:
    assert tour.foreign == []
    assert tour.complaints == []


@needs_axe
@pytest.mark.parametrize("theme", THEMES)
def test_axe_finds_nothing_serious_in_the_studio(tour: Tour, theme: str) -> None:
    assert tour.violations[theme] == {}
