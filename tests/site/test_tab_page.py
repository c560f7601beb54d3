"""The page in a tab, in real headless Chromium, from a host that knows nothing but files: Train, and a car drives.

Needs `make site`, and skips where that was not run.
"""

from __future__ import annotations

import http.server
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from built_page import AXE, NEEDS_THE_PAGE, PATIENCE, Files, hosted

from chromium import launched
from few_frames import FEW_FRAMES, HASTE
from racecraft import evaluate
from racecraft.importing import import_run
from racecraft.limits import known_limit
from racecraft.race import Autopilot, RaceRules
from racecraft.race import evaluate as raced
from racecraft.race.conditions import STANDARD_CAR
from racecraft.replay import Replay, read_replay, write_replay
from racecraft.run import RunFolder
from racecraft.run.archive import archive_chunks
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.track import load_track
from racecraft.training.evaluator import SEED
from until_true import until_true

if TYPE_CHECKING:
    from playwright.sync_api import Page, Worker

THREADS = "crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, 8) : 1"
FADED = """new Promise(requestAnimationFrame)
  .then(() => document.getAnimations().filter((one) => one instanceof CSSTransition))
  .then((all) => Promise.allSettled(all.map((one) => one.finished)))
  .then(() => 0)"""  # once colours have changed

pytestmark = NEEDS_THE_PAGE


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    from playwright.sync_api import sync_playwright

    complaints: list[str] = []
    with hosted() as address, sync_playwright() as playwright:
        browser = launched(playwright)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.add_init_script(FEW_FRAMES)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
        page.goto(address)
        page.get_by_role("button", name="Train", exact=True).wait_for()
        yield page
        browser.close()
    assert complaints == []


PAINTED = "What it pays along the track"
SEEN = "document.querySelector('.eye canvas').toDataURL()"


HOLD = """(file) => {
  const ask = window.fetch;
  window.fetch = async (what, ...more) => {
    if (String(what.url ?? what).includes(file)) await new Promise((go) => (window.goOn = go));
    return ask(what, ...more);
  };
  window.letGo = () => ((window.fetch = ask), window.goOn());
}"""  # until it is let go


def test_what_a_preset_pays_is_painted_along_the_track(page: Page) -> None:
    from playwright.sync_api import expect

    painted = page.get_by_role("img", name=PAINTED)
    painted.wait_for()
    before = painted.get_attribute("viewBox")
    train = page.get_by_role("button", name="Train", exact=True)
    page.evaluate(HOLD, "hairpin")
    page.get_by_role("combobox", name="Track").select_option("hairpin")
    expect(train).to_be_disabled()  # the road is not there yet
    page.evaluate("letGo()")
    expect(train).to_be_enabled()
    another = "before => document.querySelector('figure svg[role=img]').getAttribute('viewBox') !== before"
    until_true(page, another, before)
    page.get_by_label("What it is paid for").select_option("stay_inside")
    page.get_by_text("least").get_by_text("0.001").wait_for()  # what it pays beside the road
    page.get_by_label("What it is paid for").select_option("racing")


def test_a_car_that_has_learned_drives_until_somebody_trains(page: Page) -> None:
    for track in ("reinvent_2018", "hairpin"):
        page.get_by_role("combobox", name="Track").select_option(track)
        page.get_by_text("It has learned already").wait_for()
        until_true(page, f"before => {SEEN} !== before", page.evaluate(SEEN))
    still = page.context.browser.new_page(reduced_motion="reduce")
    still.set_default_timeout(PATIENCE)
    still.goto(page.url)
    still.get_by_text("64 cars wait for you").wait_for()
    still.wait_for_timeout(500)
    assert still.get_by_text("It has learned already").count() == 0
    still.close()


def test_a_car_learns_in_the_tab_and_drives_the_same_laps_in_the_installed_program(page: Page, tmp_path: Path) -> None:
    from playwright.sync_api import expect

    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_role("button", name="Delete: 9").click()  # nine actions are left
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text(re.compile("64 cars learning at once")).wait_for()
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    page.get_by_role("button", name="Race it: oval-racing-1").click()
    expect(page.get_by_label("Ghost")).to_have_value("model:oval-racing-1")
    page.get_by_role("button", name="Back").click()
    shown = page.get_by_text(re.compile(r"Paperclip, 5 of 5 laps, best \d+\.\d\d\ss")).inner_text()
    with page.expect_download() as download:
        page.get_by_role("button", name="Download: oval-racing-1").click()
    archive = tmp_path / download.value.suggested_filename
    download.value.save_as(archive)
    imported = import_run(archive, root=tmp_path / "runs")
    assert len(json.loads((imported.run / "model_metadata.json").read_text())["action_space"]) == 9
    rules, seed = "first_lap", (1 + SEED) % 2**32  # as the evaluations of a training with seed 1
    driven = evaluate(imported.run, rules=rules, seed=seed, video=False).evaluation
    laps = [lap for trial in driven.trials for lap in trial.lap_times]
    assert len(laps) == 5
    assert f"best {min(laps):.2f}\xa0s" in shown
    limit = known_limit(load_track("oval"), VEHICLES[STANDARD_CAR])
    assert limit is not None
    missed = limit.medals.next_after(min(laps))
    short = math.ceil(100 * (min(laps) - getattr(limit.medals, missed)) - 1e-6) / 100  # s, rounded up
    page.get_by_text(f"{short:.2f} s to {missed}").wait_for()
    as_console = tmp_path / "back.tar.gz"
    as_console.write_bytes(b"".join(archive_chunks(RunFolder(imported.run))))
    chooser = page.get_by_label("Bring a model", exact=True).and_(page.locator("input"))
    for file, name in ((archive, "oval-racing-1-1"), (as_console, RunFolder(imported.run).name)):
        chooser.set_input_files(file)
        brought = page.get_by_label("Your models").locator(".model", has=page.get_by_text(name, exact=True))
        brought.get_by_text(shown.rsplit(",", 1)[0]).wait_for()  # judged anew: the same laps
        brought.get_by_role("button", name="Race it").wait_for()
        brought.get_by_role("button", name="Delete").click()
    chooser.set_input_files(AXE)
    page.get_by_text("This archive is damaged").wait_for()


def test_a_models_laps_are_watched_again_corner_by_corner(page: Page) -> None:
    about = page.get_by_label("Your models").locator(".model").get_by_text(re.compile("best")).inner_text()
    best = re.search(r"best (\S+\ss)", about)
    assert best is not None
    page.get_by_role("button", name="Watch its laps: oval-racing-1").click()
    shown = page.get_by_role("dialog")
    shown.get_by_text(re.compile(rf"^oval-racing-1, Lap \d · {best[1]}$")).wait_for()
    assert shown.get_by_role("region", name="Corners").locator("tbody tr").count() == 2
    eye = shown.get_by_label("What the car sees")
    pixels = "eye => eye.getContext('2d').getImageData(0, 0, eye.width, eye.height).data.join()"
    until_true(page, f"new Set(({pixels})(document.querySelector('dialog .eye canvas')).split(',')).size > 20")
    first = eye.evaluate(pixels)
    slider = shown.get_by_role("slider", name="Moment of the lap")
    slider.fill("3")
    until_true(page, f"first => ({pixels})(document.querySelector('dialog .eye canvas')) !== first", first)
    shown.get_by_text("What this model's own reward function pays along the lap").wait_for()
    shown.get_by_role("button", name="Back").click()


def test_a_model_stays_when_the_page_is_closed_and_goes_when_it_is_deleted(page: Page) -> None:
    page.reload()
    delete = page.get_by_role("button", name="Delete: oval-racing-1")
    delete.click()
    page.get_by_text("Nothing yet.").wait_for()
    page.get_by_role("button", name="Undo").click()
    delete.click()
    page.get_by_text("Nothing yet.").wait_for()


def test_a_drawn_track_is_trained_on_and_goes_with_its_model(page: Page, tmp_path: Path) -> None:
    page.get_by_role("button", name="Draw a track").click()
    desk = page.get_by_role("dialog", name="Draw a track")
    desk.get_by_text("It can be driven.").wait_for()
    desk.get_by_label("Name of the track").fill("oval")
    desk.get_by_role("button", name="Save").click()
    desk.get_by_text("There is a track called oval already.").wait_for()
    desk.get_by_label("Name of the track").fill("mine")
    desk.get_by_role("button", name="Save").click()
    page.get_by_role("button", name="Change this track").wait_for()
    page.reload()
    page.get_by_role("combobox", name="Track").select_option("mine")
    page.get_by_role("img", name=PAINTED).wait_for()
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    shown = page.get_by_text(re.compile(r"mine, 5 of 5 laps, best \d+\.\d\d\ss")).inner_text()
    files = {}
    for button in ("Download this road", "Download: mine-racing-1"):
        with page.expect_download() as download:
            page.get_by_role("button", name=button).click()
        files[button] = tmp_path / download.value.suggested_filename
        download.value.save_as(files[button])
    route, archive = files.values()
    imported = import_run(archive, root=tmp_path / "runs", track=str(route))
    rules, seed = "first_lap", (1 + SEED) % 2**32
    driven = evaluate(imported.run, rules=rules, seed=seed, video=False).evaluation
    laps = [lap for trial in driven.trials for lap in trial.lap_times]
    assert len(laps) == 5
    assert f"best {min(laps):.2f}\xa0s" in shown
    page.get_by_role("button", name="Change this track").click()
    desk.get_by_role("button", name="Delete this track").click()
    desk.get_by_text("A model of yours drives on mine").wait_for()
    desk.get_by_role("button", name="Back").click()
    page.get_by_role("button", name="Delete: mine-racing-1").click()
    page.get_by_text("Nothing yet.").wait_for()
    page.get_by_role("button", name="Change this track").click()
    desk.get_by_role("button", name="Delete this track").click()
    page.get_by_role("button", name="Draw a track").wait_for()
    assert "mine" not in page.get_by_role("combobox", name="Track").inner_text()


def test_a_training_is_stopped_at_once_and_another_begins(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("generated:4")
    page.get_by_label("What it is paid for").select_option("stay_inside")
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("64 cars learning at once").wait_for()
    page.get_by_role("button", name="Stop").click()
    page.get_by_text("Stopped after").wait_for()
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("64 cars learning at once").wait_for()
    page.get_by_role("button", name="Stop").click()


def test_cars_learn_among_bots_and_a_time_trial_follows(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_label("Bot cars").fill("2")
    assert page.get_by_label("What it is paid for").input_value() == "dodge"
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("128 cars learning at once").wait_for()
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("button", name="Time trial").click()
    assert page.get_by_label("What it is paid for").input_value() == "racing"
    assert "dodge" not in page.get_by_label("What it is paid for").inner_text()


def test_a_model_is_trained_on_with_another_reward(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_label("What it is paid for").select_option("centerline")
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    page.get_by_role("combobox", name="Track").select_option("kidney")
    page.get_by_role("button", name="Train on: oval-centerline-1").click()
    page.get_by_text("Begins with what oval-centerline-1 has learned.").wait_for()
    assert page.get_by_role("combobox", name="Track").input_value() == "oval"
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_text("oval-centerline-1 cannot begin here").wait_for()
    assert page.get_by_role("button", name="Train", exact=True).is_disabled()
    page.get_by_role("button", name="Time trial").click()
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("64 cars learning at once").wait_for()
    page.get_by_text("It drives 5 of 5 laps").wait_for()
    page.get_by_role("button", name="Train on: oval-racing-1").wait_for()
    page.get_by_role("button", name="Begin anew").click()


def test_somebody_drives_a_lap_and_then_against_it(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("straight")
    page.get_by_role("button", name="Drive yourself").click()
    page.get_by_text("Press ↑ to drive off").wait_for()
    page.evaluate(HASTE)
    page.keyboard.down("ArrowUp")
    page.get_by_text(re.compile("A new best: ")).first.wait_for()
    page.keyboard.up("ArrowUp")
    page.get_by_role("button", name="Back").click()
    page.get_by_role("button", name="Drive yourself").click()
    page.get_by_label("Ghost").get_by_text(re.compile(r"Your best lap · \d+\.\d\d\ss")).wait_for(state="attached")
    page.get_by_role("button", name="Back").click()


def test_what_runs_in_the_page_reaches_no_other_site(page: Page) -> None:
    other = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Files)
    ask = f"fetch('http://127.0.0.1:{other.server_port}/', {{mode: 'no-cors'}}).then(() => 'there', () => 'refused')"
    found = reloaded(page).evaluate(ask)
    other.server_close()
    assert found == "refused"


def write(page: Page, source: str) -> None:
    """Put a reward of one's own into the editor."""
    page.get_by_label("What it is paid for").select_option("own")
    page.get_by_label("The reward in Python").fill(source)


def reloaded(page: Page) -> Worker:
    """The worker of the page's cars, which begins anew.

    From an empty page, as a reload may hear of a worker of the page before: one that ends with it, and never answers.
    """
    from playwright.sync_api import expect

    address = page.url
    page.goto("about:blank")
    with page.expect_worker() as first:  # the others are its helpers, who hear of nothing
        page.goto(address)
    expect(page.get_by_role("button", name="Train", exact=True)).to_be_enabled()
    return first.value


KEPT = (
    "['indexedDB', 'caches', 'navigator', 'fetch', 'Worker', 'BroadcastChannel'].filter((name) => name in globalThis)"
)


def test_where_python_runs_nothing_is_left_of_what_the_browser_keeps_for_the_page(page: Page) -> None:
    """A reward from a link may find its way to JavaScript; to the models of who opened it there is none."""
    assert len(reloaded(page).evaluate(KEPT)) == 6
    with page.expect_worker() as found:
        write(page, "def reward_function(params):\n    return params['speed']\n")
    page.get_by_text("The function is fine.").wait_for()
    assert found.value in page.workers  # one that has gone would be waited for without an end
    assert found.value.evaluate(KEPT) == []


def test_a_reward_of_ones_own_is_checked_and_trains(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("oval")
    write(page, "import numpy\ndef reward_function(params):\n    return params['sped']\n")
    page.get_by_text("1: 'import numpy' is allowed, but numpy is not installed here.").wait_for()
    page.get_by_text("the installed program, Racecraft, trains with numpy").wait_for()
    page.get_by_text("3: params has no key 'sped'. Did you mean 'speed'?").wait_for()
    assert page.get_by_role("button", name="Train", exact=True).is_disabled()
    assert page.get_by_role("img", name=PAINTED).count() == 0
    write(page, "#" * 2_000_000)
    page.get_by_text("The source has 2,000,000 characters").wait_for()
    write(page, "def reward_function(params):\n    print('seen', params['steps'])\n    return params['speed']\n")
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_text("seen 95.0").wait_for()  # what it printed when it was tried
    page.get_by_text("1.5 everywhere").wait_for()  # the speed at which it is painted
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("It drives 5 of 5 laps").wait_for()


def test_a_reward_of_ones_own_is_tried_among_the_objects_of_its_race(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("oval")
    write(page, "def reward_function(params):\n    return params['objects_distance'][params['closest_objects'][1]]\n")
    page.get_by_text("IndexError").wait_for()  # on an empty road
    page.get_by_role("button", name="Object avoidance").click()
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_text("near an object", exact=True).wait_for()
    page.get_by_text("crash", exact=True).wait_for()
    page.get_by_text("Dark squares are the boxes and cars").wait_for()  # and painted among them


def test_a_link_brings_a_reward_that_is_shown_and_runs_when_it_is_taken(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("hairpin")
    write(page, "def reward_function(params):\n    print('from afar')\n    return 1.0\n")
    page.get_by_role("button", name="Make a link").click()
    link = page.get_by_label("Link", exact=True).input_value()
    write(page, "def reward_function(params):\n    return 2.0\n")
    page.get_by_role("combobox", name="Track").select_option("oval")
    page.goto("about:blank")
    page.goto(link)
    brought = page.get_by_label("This link brings a reward")
    brought.get_by_text("print('from afar')").wait_for()
    page.get_by_role("button", name="Train", exact=True).wait_for()
    page.get_by_text("It has learned already").wait_for()
    assert len(page.workers) == page.evaluate(THREADS)  # those that have no Python
    assert page.get_by_label("What it is paid for").input_value() == "racing"
    brought.get_by_role("button", name="Take it").click()
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_text("from afar\n").first.wait_for()
    assert page.get_by_role("combobox", name="Track").input_value() == "hairpin"
    assert "#" not in page.url


def test_a_replay_is_driven_again_in_the_tab_and_a_changed_number_is_named(page: Page, tmp_path: Path) -> None:
    evaluation = raced(Autopilot(speed=2.0), load_track("oval"), rules=RaceRules(laps=1), num_trials=2, sees="state")
    path = write_replay(Replay.of(evaluation), tmp_path / "club.replay")
    chooser = page.get_by_label("Choose a replay", exact=True).and_(page.locator("input"))
    chooser.set_input_files(path)
    page.get_by_text("Driven: by drfc rules, with the car v5, on Paperclip.").wait_for()
    page.get_by_text(re.compile(r"All \d+ steps of 2 cars come out the same, bit for bit")).wait_for()
    page.get_by_role("button", name="Watch its laps", exact=True).click()
    shown, best = page.get_by_role("dialog"), min(trial.laps[0].time for trial in evaluation.trials)
    shown.get_by_text("A replay does not say what its driver was paid for.").wait_for()
    shown.get_by_text(re.compile(rf"^club.replay, Lap \d · {best:.2f}\ss$")).wait_for()
    page.get_by_role("button", name="Back").click()
    replay = read_replay(path)
    replay.rewards[1][40] = 0.25
    chooser.set_input_files(write_replay(replay, path))
    page.get_by_text("Car 2 differs first in step 40 (2.73 s): reward is 0.25 in the file").wait_for()
    path.write_bytes(b"none")
    chooser.set_input_files(path)
    page.get_by_text("This is no replay of Racecraft").wait_for()


FAILS_LATE = """calls = 0
def reward_function(params):
    global calls
    calls += 1
    if calls == 150:
        {ending}
    return 0.001
"""  # every car has its own globals


def test_a_reward_that_raises_late_stops_with_its_line_and_leaves_what_was_judged(page: Page) -> None:
    page.get_by_role("combobox", name="Track").select_option("kidney")
    write(page, FAILS_LATE.format(ending="raise ValueError('enough')"))
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("reward_function.py, line 6: the reward function raised ValueError: enough").wait_for()
    page.get_by_text("The reward function failed after").wait_for()
    page.get_by_role("button", name="Delete: kidney-own-1").wait_for()


HURRY = """(() => {
  const [later, again] = [window.setTimeout, window.setInterval];
  window.setTimeout = (act, wait, ...more) => later(act, wait === 5000 && window.isHurried ? 1500 : wait, ...more);
  window.setInterval = (act, wait, ...more) => again(act, wait === 500 && window.isHurried ? 150 : wait, ...more);
})()"""  # the 5 s that the page waits for a reward, and the ticks by which it counts them


def test_a_reward_that_hangs_is_ended_and_the_page_goes_on(page: Page) -> None:
    page.reload()
    page.get_by_text("It has learned already").wait_for()  # this car's life is no sign of another's
    page.evaluate(HURRY)
    write(page, FAILS_LATE.format(ending="while True: print('again')"))
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_role("combobox", name="Track").select_option(
        "kidney"
    )  # so that the text is checked again, while it trains
    page.get_by_role("button", name="Train", exact=True).click()
    page.evaluate("window.isHurried = true")  # what is asked from here on hangs
    page.get_by_text("the reward function did not return within 5 s").wait_for()
    assert page.get_by_role("button", name="Train", exact=True).is_enabled()  # and the check had its turn
    write(page, "def reward_function(params):\n    while True: pass\n")
    page.get_by_text("1: The reward function did not return within 5 s.").wait_for()
    page.evaluate("window.isHurried = false")
    write(page, "def reward_function(params):\n    return 1.0\n")
    page.get_by_text("The function is fine.").wait_for()


def test_the_page_opens_and_trains_without_a_network_after_the_first_visit(page: Page) -> None:
    late = f"new Promise((_, failed) => setTimeout(() => failed(new Error('no service worker')), {PATIENCE}))"
    page.evaluate(f"Promise.race([navigator.serviceWorker.ready, {late}]).then(() => 0)")
    page.reload()  # what the service worker has kept now comes from it, and has the page alone in its process
    assert page.evaluate("crossOriginIsolated")
    page.context.set_offline(True)
    page.reload()
    page.get_by_label("What it is paid for").select_option("own")
    page.get_by_text("The function is fine.").wait_for()  # Python is kept, too
    page.get_by_label("What it is paid for").select_option("racing")
    page.get_by_role("combobox", name="Track").select_option("needle")  # never opened before
    page.get_by_role("button", name="Train", exact=True).click()
    page.get_by_text("64 cars learning at once").wait_for()
    if (threads := page.evaluate(THREADS)) > 1:
        page.locator("dl div", has=page.get_by_text("Threads", exact=True)).get_by_text(str(threads)).wait_for()
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("link", name="Documentation").click()
    page.get_by_label("Search").fill("penalty")
    page.keyboard.press("Enter")
    page.locator("#search-results").get_by_role("link", name="Evaluation", exact=True).click()
    page.get_by_role("heading", name="Evaluation", exact=True).wait_for()
    page.get_by_role("link", name="Train a car").click()
    page.get_by_role("button", name="Train", exact=True).wait_for()
    page.context.set_offline(False)


@pytest.mark.skipif(not AXE.exists(), reason="web/node_modules is not installed")
def test_the_page_is_accessible_in_both_themes_and_fits_a_phone(page: Page) -> None:
    page.evaluate(AXE.read_text(encoding="utf-8"))
    for theme in ("light", "dark"):
        page.get_by_label("Theme").select_option(theme)
        page.evaluate(FADED)
        found = page.evaluate("axe.run().then((found) => found.violations.map((one) => [one.id, one.nodes[0].html]))")
        assert found == []
        page.get_by_role("button", name="Draw a track").click()
        page.get_by_role("dialog").get_by_text("It can be driven.").wait_for()
        page.evaluate(FADED)
        inside = "axe.run('dialog').then((found) => found.violations.map((one) => [one.id, one.nodes[0].html]))"
        assert page.evaluate(inside) == []
        page.get_by_role("dialog").get_by_role("button", name="Back").click()
    for width in (390, 768):
        page.set_viewport_size({"width": width, "height": 800})
        until_true(page, "document.documentElement.scrollWidth === document.documentElement.clientWidth")  # as charts
