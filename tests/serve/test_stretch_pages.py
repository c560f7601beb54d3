"""A training that went on with something changed, in a real browser: what drove which lap is said everywhere."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from browsers import Visit, make_untrained, needs_browser, needs_pages, visiting
from model_requests import REQUESTS
from PIL import Image
from running_consoles import PATIENCE, RunningConsole, running_console

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]

OTHER = "def reward_function(params):\n    return -params['speed']\n"


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    """A console with a model that learned a lap, and went on with a reward for standing still; and another model."""
    with running_console(tmp_path_factory.mktemp("console") / "runs") as console:
        console.create(name="heron", track="oval", until="1 laps or 60000 steps", seed=1)
        console.create(name="other", track="oval", until="500 steps", seed=1, reward="centerline")
        _wait(console, "other")
        _wait(console, "heron")
        steps = console.client.get("/api/models/heron").json()["steps"]
        request = {"reward": OTHER, "until": f"{steps + 9000} steps"}
        assert console.client.post("/api/models/heron/train", json=request).status_code == 202
        _wait(console, "heron")
        with visiting(console) as visit:
            yield visit
            assert visit.complaints == []


def _wait(console: RunningConsole, name: str) -> None:
    job = console.client.get("/api/jobs", params={"run": name}).json()[0]
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"


def test_every_stretch_keeps_what_it_learned_with(changed: Visit) -> None:
    model = changed.console.client.get("/api/models/heron").json()
    first, second = model["stretches"]
    assert (first["step"], first["changes"], second["changes"]) == (0, [], ["reward"])
    assert "progress" in first["reward"] or "speed" in first["reward"]
    assert second["reward"] == model["reward"] == OTHER
    assert first["best_lap"] == model["best_lap"] is not None
    of = {saved["step"]: saved["stretch"] for saved in model["checkpoints"]}
    assert all(number == (1 if step <= second["step"] else 2) for step, number in of.items())
    assert 2 in of.values()


def test_the_old_reward_is_shown_and_comes_back_into_the_editor(changed: Visit) -> None:
    page = changed.open("/models/heron/setup")
    table = page.get_by_role("region", name="Stretches of the training").locator("table").first
    assert "Stretch 2 · reward" in table.inner_text()
    assert page.locator("tr.removed").count() > 2
    assert page.locator("tr.added", has_text="-params['speed']").count() == 1
    page.get_by_role("button", name="Show changes: Stretch 1").click()
    page.get_by_role("button", name="Put the reward of stretch 1 into the editor").click()
    first = changed.console.client.get("/api/models/heron").json()["stretches"][0]["reward"]
    page.get_by_text(first.strip().splitlines()[-1].strip()).first.wait_for()
    assert page.get_by_role("button", name="Go on with this reward").is_enabled()


def test_the_curve_has_a_band_for_each_stretch(changed: Visit) -> None:
    page = changed.open("/models/heron/watch")
    bands = page.get_by_role("list", name="Stretches of the training")
    bands.wait_for()
    assert [text.strip() for text in bands.locator("li").all_inner_texts()] == [
        "Stretch 1 · the beginning",
        "Stretch 2 · reward",
    ]


def test_a_model_that_has_learned_is_said_to_have_driven_all_its_steps(changed: Visit) -> None:
    """A curve may end before its model does: iterations that follow each other quickly are left out of it."""
    history = changed.console.runs / "heron" / "metrics" / "history.jsonl"
    whole = history.read_bytes()
    steps = changed.console.client.get("/api/models/heron").json()["steps"]
    lines = [line for line in whole.splitlines(keepends=True) if json.loads(line)["step"] < steps]
    history.write_bytes(b"".join(lines))
    try:
        page = changed.open("/models/heron/watch")
        page.locator(".figures dd").get_by_text(f"{steps:,}", exact=True).wait_for()
    finally:
        history.write_bytes(whole)


def test_a_band_shows_its_change_and_a_model_branches_off_from_before_it(changed: Visit) -> None:
    page = changed.open("/models/heron/watch")
    page.get_by_role("button", name="Stretch 2 · reward").click()
    assert page.locator("tr.added", has_text="-params['speed']").count() == 1
    page.get_by_role("button", name="Stretch 1 · the beginning").click()
    page.get_by_role("button", name="Branch from stretch 1").click()
    page.wait_for_url("**/models/heron-2/setup")
    client = changed.console.client
    old, branch = client.get("/api/models/heron").json(), client.get("/api/models/heron-2").json()
    assert branch["reward"] == old["stretches"][0]["reward"] != old["reward"]
    info = json.loads((changed.console.runs / "heron-2" / "run.json").read_text())
    taken = next(one for one in old["checkpoints"] if one["step"] == info["parent"]["step"])
    assert taken["stretch"] == 1
    changed.open("/")  # no page follows what is gone
    assert client.delete("/api/models/heron-2").status_code < 300


def test_the_log_is_searched_narrowed_and_kept(changed: Visit) -> None:
    page = changed.open("/models/heron/watch")
    page.get_by_role("link", name="Whole log:").click()
    page.wait_for_url("**/models/heron/log")
    log = page.get_by_role("region", name="Log", exact=True)
    log.locator("tbody tr").first.wait_for()
    everything = log.locator("tbody tr").count()
    page.get_by_role("button", name="Best", exact=True).click()
    best = log.locator("tbody tr").all_inner_texts()
    assert 1 <= len(best) < everything
    assert all("★" in row for row in best)
    page.get_by_role("button", name="All", exact=True).click()
    page.get_by_role("searchbox", name="Search the log").fill("BEST")
    page.locator("tr.evaluation").first.wait_for(state="detached")
    assert page.locator("tr.best").count() == len(best)
    assert page.url.endswith("/models/heron/log?words=BEST")
    page.reload()  # what is wanted of it is in its address
    page.locator("tr.best").first.wait_for()
    assert page.locator("tbody tr").count() == len(best)
    with page.expect_download() as download:
        page.get_by_role("button", name="Download", exact=True).click()
    assert download.value.suggested_filename == "heron-log.txt"
    assert len(Path(download.value.path()).read_text().splitlines()) == len(best)
    page.get_by_role("searchbox", name="Search the log").fill("nothing like that")
    page.get_by_text("Nothing in the log is like that.").wait_for()


def test_what_the_last_change_made_of_it_is_said_in_a_sentence(changed: Visit) -> None:
    """Paid for standing still, it drives no faster and no further."""
    page = changed.open("/models/heron/watch")
    said = page.get_by_text("Since stretch 2 (reward):")
    said.wait_for()
    assert "faster" not in said.inner_text()
    page.get_by_role("button", name="Lap time, s").click()
    page.get_by_role("list", name="Stretches of the training").wait_for()


def test_the_medal_of_the_best_lap_is_on_the_card_and_on_its_pages(changed: Visit) -> None:
    model = changed.console.client.get("/api/models/other").json()
    for stamp, medal, next_better in (("20260101000000", "silver", "gold"), ("20260101000001", "gold", "author")):
        folder = changed.console.runs / "other" / f"evaluation-{stamp}"
        folder.mkdir()
        lap = {"track": "oval", "step": 500, "best_lap_seconds": model["medals"][medal]}
        (folder / "evaluation.json").write_text(json.dumps(lap))
        assert model["medals"][next_better] < lap["best_lap_seconds"]
        page = changed.open("/")
        card = page.get_by_role("listitem").filter(has=page.get_by_role("link", name="other", exact=True))
        card.get_by_text(medal.capitalize(), exact=True).wait_for()
        page = changed.open("/models/other/watch")
        won = page.get_by_role("complementary").get_by_text(medal.capitalize(), exact=True)
        won.wait_for()
        assert f"Bronze {model['medals']['bronze']:.2f}\xa0s" in str(won.get_attribute("title"))
        shutil.rmtree(folder)


def test_whose_best_lap_is_meant_is_said_wherever_one_stands(changed: Visit) -> None:
    client = changed.console.client
    job = client.post("/api/models/heron/evaluations", json={"laps": 1, "num_trials": 1, "rules": "first_lap"}).json()
    assert changed.console.wait_for(changed.console.job_ended(job["id"]))["state"] == "done"
    for path, whose in (
        ("/models/heron/watch", "the model's track"),
        ("/models/heron/race", "of this evaluation."),
        ("/models/heron/setup", "that this checkpoint was saved with."),
        ("/compare/heron/other", "in that stretch of the training."),
    ):
        term = changed.open(path).locator(".term", has_text="Best lap").first
        assert str(term.get_attribute("title")).startswith("The fastest whole lap, penalties included: of ")
        assert whose in " ".join(str(one.get_attribute("title")) for one in changed.page.locator(".term").all())


def test_when_nobody_trains_the_best_car_drives_its_lap(changed: Visit) -> None:
    client = changed.console.client
    lap = client.get("/api/models/heron/demonstration").json()
    assert lap["step"] == next(
        one["step"] for one in client.get("/api/models/heron").json()["checkpoints"] if one["is_best"]
    )
    poses = np.array(lap["poses"]) / 1000
    assert lap["seconds"] == pytest.approx(len(poses) / 15, abs=1.0)
    assert poses[-1, 5] > 0.98
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert moved.max() < 4.0 / 15 + 0.05
    assert np.median(moved * 15 - poses[1:, 3]) == pytest.approx(0.0, abs=0.1)
    page = changed.open("/models/heron/watch")
    page.get_by_text(f"The best car on its lap: {lap['seconds']:.2f} s").wait_for()
    follow = page.get_by_role("region", name="Live").get_by_role("button", name="Follow")
    assert follow.get_attribute("aria-pressed") == "true"
    canvas = page.locator(".scene canvas")
    canvas.wait_for()
    first = canvas.screenshot()
    changed.console.wait_for(lambda: canvas.screenshot() != first)  # it drives
    page.reload()
    page.get_by_text("The best car on its lap").wait_for()


def test_compare_credits_the_lap_to_the_reward_that_drove_it(changed: Visit) -> None:
    page = changed.open("/compare/heron/other")
    chosen = page.get_by_label("Stretch: heron")
    chosen.wait_for()
    first = changed.console.client.get("/api/models/heron").json()["stretches"][0]
    assert chosen.input_value() == "1"
    row = page.get_by_role("region", name="Results").locator("tbody tr").first
    assert f"{first['best_lap']:.2f}" in row.inner_text()
    code = page.get_by_role("region", name="Reward code")
    assert "-params['speed']" not in code.inner_text()
    chosen.select_option("2")
    code.get_by_text("-params['speed']").wait_for()


def test_compare_has_bands_of_stretches_and_lap_times_like_watch(changed: Visit) -> None:
    page = changed.open("/compare/other/heron")
    bands = page.get_by_role("list", name="Stretches of the training")
    bands.wait_for()
    expected = ["Stretch 1 · the beginning", "Stretch 2 · reward"]
    assert [text.strip() for text in bands.locator("li").all_inner_texts()] == expected
    page.get_by_text("Stretches shown: heron").wait_for()
    bands.get_by_role("button", name="Stretch 2 · reward").click()
    change = page.get_by_role("region", name="Stretch 2", exact=True)
    change.locator("tr.added", has_text="-params['speed']").wait_for()
    bands.get_by_role("button", name="Stretch 2 · reward").click()
    change.wait_for(state="detached")
    page.get_by_role("button", name="Lap time, s").click()
    page.get_by_role("img", name="Lap time, s").wait_for()
    assert bands.locator("li").count() == 2


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("width", [390, 1440])
def test_nothing_is_wider_than_the_window(changed: Visit, width: int, language: str, tmp_path: Path) -> None:
    changed.look("dark" if width == 390 else "light", language)
    for path in ("/models/heron/setup", "/models/heron/watch", "/compare/heron/other"):
        page: Any = changed.open(path, width=width)
        page.wait_for_timeout(800)
        assert changed.overflow() == 0, path
    changed.look("light", "en")


def test_ones_own_car_is_driven_against(changed: Visit) -> None:
    """From an evaluated model's pages to its car's ghost, also where another is faster; without a lap it is said."""
    client = changed.console.client
    page = changed.open("/models/other/watch")
    page.get_by_role("link", name="Change the reward and go on").wait_for()
    assert page.get_by_role("link", name="Beat your own car").count() == 0
    page = changed.open("/drive/oval/other")
    page.get_by_text("other has no lap of an evaluation on this track yet").wait_for()

    reply = client.post("/api/models/heron/evaluations", json={"laps": 1, "num_trials": 1})
    assert reply.status_code == 202, reply.text
    assert changed.console.wait_for(changed.console.job_ended(reply.json()["id"]))["state"] == "done"
    taken = next((changed.console.runs / "heron").glob("evaluation-*/evaluation.json"))
    faster = shutil.copytree(taken.parent, changed.console.runs / "other" / taken.parent.name) / taken.name
    faster.write_text(json.dumps(json.loads(taken.read_text()) | {"best_lap_seconds": 0.5}))
    page = changed.open("/drive/oval")
    page.locator("option:checked", has_text="other · 0.50").wait_for(state="attached")
    for tab in ("watch", "race"):
        page = changed.open(f"/models/heron/{tab}")
        page.get_by_role("link", name="Beat your own car").click()
        page.wait_for_url("**/drive/oval/heron")
        page.locator("option:checked", has_text="heron · ").wait_for(state="attached")
        assert page.get_by_text("has no lap of an evaluation").count() == 0


def test_how_it_learned_notes_and_a_copy_to_change(changed: Visit) -> None:
    from playwright.sync_api import expect

    client = changed.console.client
    page = changed.open("/models/heron/watch")
    shown = page.get_by_role("region", name="How it learned")
    shown.locator("canvas").wait_for()
    laps = client.get("/api/models/heron/evolution").json()["laps"]
    assert shown.locator("li").count() == len(laps) > 1
    shown.get_by_label("Moment of the lap").fill("0.5")
    shown.get_by_text("0.50 /").wait_for()
    shown.get_by_role("button", name="Make a film of it").click()
    shown.get_by_role("button", name="Filming…").wait_for()
    with page.expect_download() as film:
        shown.get_by_role("link", name="Save the film").click()
    assert film.value.suggested_filename == "heron.mp4"
    assert Path(film.value.path()).read_bytes()[4:8] == b"ftyp"
    notes = page.get_by_label("Notes")
    notes.fill("The inside line is shorter.")
    page.get_by_text("Kept", exact=True).wait_for()
    assert client.get("/api/models/heron").json()["notes"] == "The inside line is shorter."
    page.get_by_role("tab", name="Evaluation").click()
    page.get_by_role("button", name="Start an evaluation").wait_for()
    page.get_by_role("tab", name="Watch").click()
    expect(page.get_by_label("Notes")).to_have_value("The inside line is shorter.", timeout=1000 * PATIENCE)
    page.reload()
    expect(page.get_by_label("Notes")).to_have_value("The inside line is shorter.", timeout=1000 * PATIENCE)

    page = changed.open("/models/heron/setup")
    page.get_by_role("button", name="Change a copy").click()
    page.wait_for_url("**/create")
    page.get_by_text("-params['speed']").first.wait_for()
    page.get_by_role("radio", checked=True, name="Paperclip").wait_for()
    page.evaluate("sessionStorage.clear()")


@pytest.mark.parametrize("settings", REQUESTS, ids=lambda settings: settings.get("race", "time-trial"))
def test_a_copy_whose_every_field_is_kept_is_the_same_model(changed: Visit, settings: dict[str, Any]) -> None:
    console = changed.console
    asked = settings | ({"opponents": ["heron"]} if "opponents" in settings else {})
    name = console.create(train=False, **asked)
    page = _copy_of(changed, name)
    copied = _made(page)
    first, second = (console.client.get(f"/api/models/{one}").json() for one in (name, copied))
    for key in ("reward", "model_metadata", "hyperparameters", "settings", "seed", "track", "num_tracks", "until"):
        assert first[key] == second[key], key


def test_every_field_of_a_copy_can_be_changed(changed: Visit) -> None:
    console = changed.console
    page = _copy_of(changed, console.create(train=False, **REQUESTS[0]))
    page.get_by_role("button", name="Leave out: Four Hairpins").click()
    page.get_by_label("one more track").select_option("kidney")
    page.get_by_label("mass", exact=True).fill("3.25")
    page.get_by_label("friction, least").fill("0.6")
    page.get_by_role("button", name="Leave out: blur").click()
    page.get_by_label("One more quantity").select_option("latency")
    page.get_by_label("latency, most").fill("1")
    page.get_by_role("button", name="Object avoidance").click()
    page.get_by_label("Parked cars instead").check()
    page.get_by_label("Where they are").select_option("fixed")
    for _ in range(4):
        page.get_by_role("button", name="Take away place 1").click()
    page.get_by_label("Place 1, % of the lap").fill("12.5")
    page.get_by_label("Lane of place 2").select_option("outer lane")
    settings = console.client.get(f"/api/models/{_made(page)}").json()["settings"]
    assert settings["vehicle"]["mass"] == 3.25
    assert (settings["randomize"]["friction"], settings["randomize"]["blur"]) == ([0.6, 1.1], [0.0, 0.0])
    assert settings["randomize"]["latency"] == [0.0, 1.0]
    there = settings["objects"]["obstacles"]
    assert (there["kind"], there["placement"], there["count"]) == ("car", "fixed", 2)
    assert (there["positions"][0][0], there["positions"][1][1]) == (0.125, -1)


def _copy_of(visit: Visit, name: str) -> Page:
    page = visit.open(f"/models/{name}/setup")
    page.evaluate("sessionStorage.clear()")
    page.get_by_role("button", name="Change a copy").click()
    page.wait_for_url("**/create")
    page.get_by_text("The function is fine.").wait_for()
    return page


def _made(page: Page) -> str:
    """The name of the model that the page asks for, which does not train."""
    page.route("**/api/models", make_untrained)
    with page.expect_response("**/api/models") as answer:
        page.get_by_role("button", name="Train now").first.click()
    page.unroute("**/api/models")
    assert answer.value.status == 201, answer.value.text()
    return str(answer.value.json()["name"])


def test_the_end_of_a_training_is_said_on_another_page(changed: Visit) -> None:
    console = changed.console
    page = changed.open("/models/other/watch")
    console.client.post("/api/models/other/train", json={"until": "10 minutes"})
    page.get_by_text("cars learning at once").wait_for()  # one that had not begun would be cancelled
    page.get_by_role("link", name="Garage").first.click()
    console.client.post("/api/models/other/stop")
    page.locator(".toast").get_by_text("other has finished its training.").wait_for()
    page.locator(".toast").get_by_role("button", name="Look").click()
    page.wait_for_url("**/models/other")


HIDDEN = """() => {
    Object.defineProperty(document, "hidden", { get: () => window.isAway, configurable: true });
    window.isAway = false;
    window.told = [];
    window.Notification = class {
        static permission = "granted";
        static requestPermission = async () => "granted";
        constructor(text, { tag }) { window.told.push([text, tag]); }
    };
}"""
"""Lets a page believe that it lies behind others, and keeps what it has the browser say."""


def test_the_title_and_the_browser_say_the_end_to_whoever_is_away(changed: Visit) -> None:
    console = changed.console
    page = changed.open("/models/other/watch")
    page.evaluate(HIDDEN)
    for wanted in (True, False):
        console.client.post("/api/models/other/train", json={"until": "10 minutes"})
        page.get_by_text("cars learning at once").wait_for()
        page.get_by_role("checkbox", name="Let the browser tell me").set_checked(wanted)
        page.evaluate("window.isAway = true")
        console.client.post("/api/models/other/stop")
        console.wait_for(lambda: page.title().startswith("✓ "))
        job = console.client.get("/api/jobs", params={"run": "other"}).json()[0]
        told = page.evaluate("window.told.splice(0)")
        assert told == ([["other has finished its training.", job["id"]]] if wanted else [])
        page.evaluate("window.isAway = false; document.dispatchEvent(new Event('visibilitychange'))")
        console.wait_for(lambda: page.title() == "other: Watch · Racecraft")
        page.reload()
        page.get_by_role("button", name="Go on").wait_for()
        page.evaluate(HIDDEN)


def test_a_picture_that_grows_has_the_whole_road_as_one_that_was_large_from_the_start(changed: Visit) -> None:
    page = changed.page
    page.emulate_media(reduced_motion="reduce")  # the best car stands
    pictures = []
    for widths in ((420, 1440), (1440,)):
        changed.open("/models/heron/watch", width=widths[0])
        live = page.get_by_role("region", name="Live")
        page.get_by_text("The best car on its lap").wait_for()
        live.get_by_role("button", name="Free").click()
        canvas = live.locator("canvas")
        for width in widths:
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(1500)
        picture = changed.console.wait_for(lambda: _still(page, canvas))  # noqa: B023
        pictures.append(Image.open(io.BytesIO(picture)).convert("L"))
    page.emulate_media(reduced_motion="no-preference")
    grown, large = (np.asarray(picture, float) for picture in pictures)
    assert grown.shape == large.shape
    assert np.abs(grown - large).mean() < 2.0  # of 255; as they were before, most of the road is elsewhere


def _still(page: Page, canvas: Locator) -> bytes | None:
    """Its picture, if it stays as it is for longer than the next one takes."""
    before = canvas.screenshot()
    page.wait_for_timeout(1000)
    return before if canvas.screenshot() == before else None
