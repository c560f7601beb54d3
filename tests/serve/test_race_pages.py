"""Holding a race, its standings and its replay, and the settings, in real headless Chromium."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from browsers import Visit, make_untrained, needs_axe, needs_browser, needs_pages, visiting_two_drivers

from racecraft.judging.evaluation import evaluate_run
from racecraft.reward.sandbox import find_confinement

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with visiting_two_drivers(tmp_path_factory.mktemp("pages") / "runs") as visit:
        yield visit


def test_a_race_is_made_entered_and_watched(visit: Visit) -> None:
    page = visit.open("/races")
    page.get_by_role("link", name="Make the first race").click()
    page.get_by_label("Title").fill("Sunday cup")
    page.get_by_role("button", name="Best lap").click()
    page.get_by_role("button", name="Object avoidance").click()
    page.get_by_label("Boxes", exact=True).wait_for()
    page.get_by_role("button", name="Time trial").click()
    assert page.get_by_label("Boxes", exact=True).count() == 0
    page.get_by_role("combobox", name="Track").select_option("oval")
    page.get_by_label("Laps", exact=True).fill("1")
    page.get_by_label("Resets allowed").fill("2")  # beginners: the film is short
    page.get_by_role("button", name="Make the race").click()

    page.get_by_text("Nobody has arrived yet.").wait_for()
    page.get_by_role("checkbox", name="ada").check()
    page.get_by_role("checkbox", name="bob").check()
    page.get_by_role("combobox", name="Add a ghost").select_option("model ada")
    page.get_by_role("button", name="Enter 2 and drive").click()
    page.get_by_role("link", name="ada", exact=True).wait_for()
    page.get_by_role("link", name="bob", exact=True).wait_for()
    assert page.get_by_title("Driven again from its actions").count() == 2

    # while it is open nobody sees where it starts, only what was promised of it
    commitment = page.locator(".proof code")
    assert len(commitment.first.inner_text()) == 64
    assert commitment.count() == 1
    for name in ("Replay all together", "Video: bob", "3D, Replay: bob"):
        assert page.get_by_role("button", name=name).count() == 0
    page.get_by_role("button", name="Close the race").click()
    page.get_by_text("The secret gives the starts").wait_for()
    assert len(commitment.nth(1).inner_text()) == 64
    assert page.get_by_role("button", name="Open it again").count() == 0
    link = page.get_by_role("link", name="File: bob")
    replay = visit.console.client.get(str(link.get_attribute("href"))).content
    assert replay.startswith(b"RACECRAFTREPLAY")

    page.get_by_role("button", name="Replay all together").click()
    page.locator(".stage canvas").wait_for()
    assert page.locator(".film li.ghost").inner_text().split() == ["ada", "ghost"]
    page.get_by_role("button", name="Full screen").click()
    page.locator(":fullscreen canvas").wait_for()
    page.locator(":fullscreen").get_by_role("button", name="Full screen").click()
    page.locator(":fullscreen").wait_for(state="detached")
    page.get_by_role("img", name="Time behind").wait_for()
    assert page.get_by_role("button", name="Close", exact=True).count() == 0  # the film, or a camera?
    assert page.get_by_role("button", name="Close: Replay").count() == 1
    assert page.get_by_role("button", name="Why is").count() == 1
    clock = page.locator(".controls .number")
    visit.console.wait_for(lambda: float(clock.inner_text().split()[0]) > 0.5)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Moment of the race").fill("3")
    assert clock.inner_text() == "0.2\xa0s"
    assert page.locator(".film li").nth(0).locator("[aria-pressed=true]").count() == 1
    page.get_by_role("button", name="Why is").click()  # now the film is about the other one
    page.locator(".film li").nth(1).locator("[aria-pressed=true]").wait_for()
    page.set_viewport_size({"width": 390, "height": 900})
    button = page.get_by_role("button", name="Video: bob")
    assert button.count() == 1
    box = button.bounding_box()
    assert box is not None
    assert 0 <= box["x"] < box["x"] + box["width"] <= 390  # without a scroll sideways
    button.click()
    page.set_viewport_size({"width": 1440, "height": 900})
    video = page.locator("video")
    video.wait_for()
    source = str(video.get_attribute("src"))
    assert visit.console.client.get(source).headers["content-type"] == "video/mp4"

    page.get_by_role("button", name="Delete").click()
    page.get_by_role("heading", name="No race yet").wait_for()
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("link", name="ada", exact=True).wait_for()


def test_a_moment_has_room_for_its_time_of_day(visit: Visit) -> None:
    for width in (1440, 1000, 390):
        page = visit.open("/races/new", width=width)
        for name in ("Opens", "Closes"):
            field = page.get_by_label(name)
            box, around = field.bounding_box(), field.locator("xpath=..").bounding_box()
            assert box is not None
            assert around is not None
            assert box["width"] >= 220  # mm/dd/yyyy, --:-- --
            assert box["x"] + box["width"] <= around["x"] + around["width"] + 0.5  # not in the next one


def test_a_race_for_practice_shows_everything_and_opens_again(visit: Visit) -> None:
    page = visit.open("/races/new")
    page.get_by_label("Title").fill("Practice")
    page.get_by_label("Trials").fill("1")
    page.get_by_role("checkbox", name="For practice").check()
    page.get_by_role("button", name="Make the race").click()
    page.get_by_text("Everybody knows where this race starts.").wait_for()
    page.get_by_role("button", name="Close the race").click()
    page.get_by_role("button", name="Open it again").click()
    page.get_by_role("button", name="Close the race").wait_for()


def test_all_that_a_race_can_be_is_asked_for_in_words_and_told_afterwards(visit: Visit) -> None:
    page = visit.open("/contests/new")
    for name in ("ada", "bob"):
        page.get_by_role("combobox", name="Add a model").select_option(name)
    (kept, *_) = visit.console.client.get("/api/models/bob").json()["checkpoints"]
    page.get_by_role("combobox", name="Checkpoint of bob").select_option(str(kept["step"]))
    page.get_by_label("Rules").select_option("worker")
    filled = [page.get_by_label(label).input_value() for label in ("Resets allowed", "Off track costs")]
    assert filled == ["0", "2"]
    page.get_by_label("Title").fill("All of it")
    page.get_by_label("Time limit, s").fill("9")
    page.get_by_label("Ranked by").select_option("best")
    page.get_by_label("On the road").select_option("bots")
    page.get_by_label("Speed of the bots").fill("0.5")
    page.get_by_label("They change lanes").check()
    page.get_by_label("Where they are").select_option("fixed")
    page.get_by_label("Place 1, % of the lap").fill("40")
    page.get_by_role("button", name="Take away place 3").click()
    page.get_by_label("Otherwise than they know").select_option("light")
    page.get_by_label("Seed").fill("7")
    page.get_by_label("Direction").select_option("reverse")
    with page.expect_request("**/api/contests/heats") as sent:
        page.get_by_role("button", name="Start the heat with 2").click()
    asked = sent.value.post_data_json
    assert asked["models"] == [{"model": "ada", "checkpoint": "best"}, {"model": "bob", "checkpoint": kept["step"]}]
    wanted = {
        **{"rules": "worker", "max_resets": 0, "offtrack_penalty": 2, "time_limit": 9, "ranking": "best", "seed": 7},
        **{"objects": "bots", "bot_speed": 0.5, "lane_changes": True, "placement": "fixed", "randomize": "light"},
        **{"positions": [[0.4, 1], [0.5, -1]], "direction": "reverse"},
    }
    assert {name: asked[name] for name in wanted} == wanted
    page.get_by_role("heading", name="The heat in 3D").wait_for()
    held = page.get_by_role("heading", name="Held by these rules").locator("..")
    bots = "Bot cars: 2 · 0.5 m/s · change lanes · 40 % inner lane, 50 % outer lane"
    for told in ("9 s", bots, "The other way", "7"):
        held.get_by_text(told, exact=True).wait_for()

    page = visit.open("/contests/new")
    page.get_by_role("button", name="Ladder").click()
    page.get_by_role("button", name="Add all").click()
    page.get_by_label("They race").select_option("object-avoidance")
    page.get_by_label("Parked cars instead").check()
    page.get_by_label("Parked cars", exact=True).fill("2")
    page.get_by_label("Who meets whom").select_option("swiss")
    page.get_by_label("Rounds").fill("2")
    page.get_by_label("Starts on each track").fill("1")
    assert page.get_by_label("Time limit, s").input_value() == "180"
    page.get_by_label("Time limit, s").fill("5")
    with page.expect_request("**/api/contests/ladders") as sent:
        page.get_by_role("button", name="Start the ladder of 2").click()
    asked = sent.value.post_data_json
    wanted = {"rounds": 2, "count": 2, "parked_cars": True, "placement": "even", "time_limit": 5}
    assert {name: asked[name] for name in wanted} == wanted
    page.get_by_role("heading", name="Held by these rules").wait_for()

    page = visit.open("/races/new")
    page.get_by_label("Title").fill("Final")
    page.get_by_role("button", name="Head to bot").click()
    page.get_by_label("Rules").select_option("live")
    assert page.get_by_label("Time limit, s").input_value() == "180"
    page.get_by_label("Time limit, s").fill("6")
    page.get_by_label("Trials").fill("1")
    page.get_by_label("Otherwise than they know").select_option("strong")
    page.get_by_label("Where they are").select_option("random")
    page.get_by_role("button", name="Make the race").click()
    page.get_by_role("checkbox", name="bob").wait_for()  # what comes later moves what is below it
    page.get_by_text("Held by these rules").click()
    for told in ("6 s", "Bot cars: 6 · 0.2 m/s · elsewhere each time", "Much of everything", "15"):
        page.locator("details dl").get_by_text(told, exact=True).wait_for()
    page.get_by_role("checkbox", name="bob").check()
    page.get_by_label("Which state of it").select_option(str(kept["step"]))
    with page.expect_request("**/entries") as sent:
        page.get_by_role("button", name="Enter 1 and drive").click()
    assert sent.value.post_data_json == {"models": ["bob"], "checkpoint": kept["step"], "ghosts": []}


def test_a_heat_has_a_secret_and_ghosts_as_on_the_command_line(visit: Visit) -> None:
    client, console = visit.console.client, visit.console
    models = [{"model": "ada"}, {"model": "bob"}]
    asked = {"models": models, "title": "Before", "seed": 1, "max_resets": 1}  # beginners: the film is short
    before = client.post("/api/contests/heats", json=asked).json()["id"]
    away = client.post("/api/contests/heats", json=asked | {"title": "Away", "track": "oval"}).json()["id"]
    back = client.post("/api/contests/heats", json=asked | {"title": "Back", "direction": "reverse"}).json()["id"]
    for heat in (before, away, back):
        assert console.wait_for(console.job_ended(heat))["state"] == "done"
    page = visit.open("/contests/new")
    for name in ("ada", "bob"):
        page.get_by_role("combobox", name="Add a model").select_option(name)
    page.get_by_role("combobox", name="Track").select_option("reinvent_2018")
    page.get_by_label("Resets allowed").fill("1")
    assert page.get_by_label("Seed").is_visible()
    page.get_by_role("checkbox", name="From a secret").check()
    assert page.get_by_label("Seed").count() == 0
    ghost = page.get_by_role("combobox", name="Add a ghost")
    ghost.locator("option", has_text="Before").wait_for(state="attached")
    assert ghost.locator("option", has_text="Away").count() == 0  # on another road
    assert ghost.locator("option", has_text="Back").count() == 0  # the other way round: it would be refused
    ghost.select_option(f"heat {before}")
    page.get_by_label("Direction").select_option("reverse")
    page.get_by_role("button", name="Take out the ghost: Before").wait_for(state="detached")
    ghost.locator("option", has_text="Back").wait_for(state="attached")
    assert ghost.locator("option", has_text="Before").count() == 0
    page.get_by_label("Direction").select_option("forward")
    for choice in ("model bob", "lap", f"heat {before}", "model ada"):
        ghost.select_option(choice)
    page.get_by_role("combobox", name="Checkpoint of bob").nth(1).select_option("last")
    page.get_by_label("Title").fill("Haunted")
    page.get_by_role("button", name="Take out the ghost: ada").click()
    with page.expect_request("**/api/contests/heats") as sent:
        page.get_by_role("button", name="Start the heat with 2").click()
    asked = sent.value.post_data_json
    assert (asked["secret"], asked["seed"]) == (True, None)
    assert asked["ghosts"] == [{"model": "bob", "checkpoint": "last"}, "best-lap", {"heat": before}]
    page.get_by_role("heading", name="How to check it").wait_for()
    heat = page.url.rpartition("/")[2]
    commitment = client.get(f"/api/contests/{heat}").json()["commitment"]
    assert page.get_by_text(commitment).is_visible()
    page.get_by_role("heading", name="The heat in 3D").wait_for()
    page.get_by_text(client.get(f"/api/contests/{heat}").json()["secret"], exact=True).wait_for()
    assert page.get_by_text(commitment).is_visible()
    told = r"bob@last · The fastest lap, again with every lap · The best car of the heat Before \(.+\)"
    page.get_by_text(re.compile(f"^{told}$")).wait_for()


DIFFERENCE = """async ([films, at]) => {
  const frames = await Promise.all(films.map(async (film) => {
    const video = Object.assign(document.createElement("video"), { muted: true, src: film });
    const heard = (event) => new Promise((done) => video.addEventListener(event, done, { once: true }));
    await heard("loadeddata");
    const sought = heard("seeked");
    video.currentTime = at;
    await sought;
    const canvas = new OffscreenCanvas(video.videoWidth, video.videoHeight).getContext("2d");
    canvas.drawImage(video, 0, 0);
    return canvas.getImageData(0, 130, video.videoWidth, video.videoHeight - 130); // below the names
  }));
  const [one, other] = frames.map((frame) => frame.data);
  const found = [];
  for (let at = 0; at < one.length; at += 4)
    if ([0, 1, 2].some((channel) => Math.abs(one[at + channel] - other[at + channel]) > 40)) found.push(at / 4);
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const width = frames[0].width;
  return [found.length, mean(found.map((at) => at % width)), mean(found.map((at) => Math.floor(at / width)))];
}"""
"""How many pixels of two films differ in a moment, and where: in the middle of them."""


def test_keys_look_through_a_list_and_add_one_of_it(visit: Visit) -> None:
    page = visit.open("/contests/new")
    add = page.get_by_role("combobox", name="Add a model")
    add.locator("option", has_text="bob").wait_for(state="attached")
    added = page.get_by_role("button", name="Take out: ")
    add.focus()
    for key, shown in (("b", "bob"), ("ArrowDown", "ada"), ("ArrowUp", "bob")):
        page.keyboard.press(key)
        assert (add.input_value(), added.count()) == (shown, 0)
    page.keyboard.press("Enter")
    page.get_by_role("status").filter(has_text="bob").filter(has_text="is added").wait_for()
    assert (add.input_value(), added.count(), page.url[-13:]) == ("", 1, "/contests/new")
    page.keyboard.press("ArrowDown")  # from where the list begins: the choice is still the keyboard's
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")  # on the button beside it
    page.get_by_role("button", name="Take out: bob").nth(1).wait_for()
    assert add.evaluate("one => one === document.activeElement")
    add.select_option("ada")  # after keys that is one more look
    assert added.count() == 2
    add.dispatch_event("pointerdown")
    add.select_option("ada")
    assert added.count() == 3

    visit.look("light", "de")
    page = visit.open("/contests/new", width=390)
    page.get_by_role("combobox", name="Einen Geist dazunehmen").focus()
    page.keyboard.press("ArrowDown")
    page.get_by_role("button", name="Dazunehmen", exact=True).wait_for()
    assert page.get_by_role("button", name="Den Geist herausnehmen").count() == 0
    assert visit.overflow() == 0
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Den Geist herausnehmen").wait_for()
    visit.look("light", "en")


def test_an_evaluation_drives_along_as_a_ghost(visit: Visit) -> None:
    client, console = visit.console.client, visit.console
    # as on the command line, where resets can be few and a film be left out, or a beginner is filmed for minutes
    evaluate_run(console.runs / "bob", laps=1, num_trials=1, max_resets=2, video=False, num_threads=1)
    (stamp,) = (card["stamp"] for card in client.get("/api/models/bob/evaluations").json())
    asked = {"models": [{"model": "ada"}, {"model": "bob"}], "track": "oval", "seed": 1, "max_resets": 1}
    alone = client.post("/api/contests/heats", json=asked).json()["id"]
    page = visit.open("/contests/new")
    for name in ("ada", "bob"):
        page.get_by_role("combobox", name="Add a model").select_option(name)
    ghost = page.get_by_role("combobox", name="Add a ghost")
    page.get_by_role("combobox", name="Track").select_option("oval")
    ghost.select_option(f"evaluation bob {stamp}")
    page.get_by_role("combobox", name="Track").select_option("bowtie")  # where it did not drive
    page.get_by_role("button", name="Take out the ghost: bob").wait_for(state="detached")
    assert ghost.locator("option[value^=evaluation]").count() == 0
    page.get_by_role("combobox", name="Track").select_option("oval")
    ghost.select_option(f"evaluation bob {stamp}")
    page.get_by_role("button", name="Take out the ghost: bob").wait_for()
    page.get_by_label("Seed").fill("1")
    page.get_by_label("Resets allowed").fill("1")
    page.get_by_role("button", name="Start the heat with 2").click()
    page.get_by_role("heading", name="The heat in 3D").wait_for()
    assert page.locator("dd", has_text="bob (").count() == 1
    page.locator(".stage li").nth(2).wait_for()
    assert page.locator(".stage li").all_inner_texts()[2:] == ["bob\nghost"]
    film = str(page.get_by_role("link", name="Video").get_attribute("href"))
    assert console.wait_for(console.job_ended(alone))["state"] == "done"

    films = [film, f"/api/contests/{alone}/video"]
    (begin, *place), (later, *next_place) = (page.evaluate(DIFFERENCE, [films, at]) for at in (0.5, 1.5))
    assert min(begin, later) > 10  # on the map, and on the road when it is in view
    assert max(abs(a - b) for a, b in zip(place, next_place, strict=True)) > 2  # it is elsewhere a second later


def test_models_race_on_one_road_and_are_rated(visit: Visit) -> None:
    page = visit.open("/races")
    page.get_by_role("link", name="New heat or ladder").click()
    add = page.get_by_role("combobox", name="Add a model")
    assert page.get_by_role("button", name="Choose two or more models").is_disabled()
    for name in ("ada", "bob", "ada"):
        add.select_option(name)
    page.get_by_role("combobox", name="Checkpoint of ada").nth(1).select_option("last")
    page.get_by_role("button", name="Forward: bob").click()
    page.get_by_label("Off track costs, s").fill("1.5")
    page.get_by_label("Resets allowed").fill("4")
    with page.expect_request("**/api/contests/heats") as sent:
        page.get_by_role("button", name="Start the heat with 3").click()
    asked = sent.value.post_data_json
    assert (asked["offtrack_penalty"], asked["max_resets"]) == (1.5, 4)
    page.get_by_role("heading", name="The heat in 3D").wait_for()
    grid = page.get_by_role("region", name="Result").locator("tbody tr")
    started = {row.locator("td").nth(1).inner_text(): row.locator("td").nth(7).inner_text() for row in grid.all()}
    assert started == {"bob": "1", "ada": "2", "ada@last": "3"}
    first = grid.first.locator("td").nth(1).inner_text()
    page.locator(".stage canvas").wait_for()
    assert page.locator(".stage li").first.locator("span").first.inner_text() == first
    clock = page.locator(".controls .number")
    visit.console.wait_for(lambda: float(clock.inner_text().split()[0]) > 0.5)

    held = page.get_by_role("heading", name="Held by these rules").locator("..")
    assert held.get_by_text("1.5 s", exact=True).is_visible()

    page = visit.open("/contests/new")
    page.get_by_role("button", name="Ladder").click()
    page.get_by_role("button", name="Add all").click()
    page.get_by_label("Starts on each track").fill("2")
    page.get_by_label("Title").fill("Sunday ladder")
    page.get_by_role("button", name="Start the ladder of 2").click()
    page.get_by_role("heading", name="Sunday ladder").wait_for()
    page.get_by_role("button", name="Watch: ").first.click()
    page.locator(".stage canvas").wait_for()
    assert page.get_by_role("button", name="Watch: ").count() == 2
    ladder = page.url
    page.get_by_role("navigation").get_by_role("link", name="Races").click()
    page.get_by_role("link", name="Sunday ladder").wait_for()
    assert page.get_by_text("Ladder · Two on one road").count() == 1
    page.goto(ladder)
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("heading", name="Models against models").wait_for()
    page.get_by_role("link", name="Heat: bob, ada, ada@last", exact=True).wait_for()
    assert page.get_by_role("link", name="Sunday ladder").count() == 0


def test_tables_of_heats_and_ladders_lead_to_why_the_first_is_faster(visit: Visit) -> None:
    from playwright.sync_api import expect

    client = visit.console.client
    models = [{"model": client.post(f"/api/models/starters/{name}").json()["name"]} for name in ("quick", "steady")]
    heat = client.post("/api/contests/heats", json={"models": models, "title": "Starters", "seed": 1}).json()["id"]
    ladder = {"models": models, "tracks": ["reinvent_2018"], "kind": "time-trial", "starts": 1, "title": "Rated"}
    rated = client.post("/api/contests/ladders", json=ladder).json()["id"]
    for contest, room in ((heat, "heat"), (rated, "ladder")):
        assert visit.console.wait_for(visit.console.job_ended(contest))["state"] == "done"
        found = client.get(f"/api/contests/{contest}").json()[room]
        why = f"Why is {found[0]['name']} faster than {found[1]['name']}?"
        page = visit.open(f"/contests/{contest}")
        page.get_by_role("button", name=why).click()
        page.locator("#film").get_by_role("heading", name=why).wait_for()
        page.get_by_label("Moment of the race").press("End")
        states = page.locator("#film .stage li .number")
        expect(states).to_have_text(["arrived", "arrived"])


def test_a_model_is_made_to_learn_against_others(visit: Visit) -> None:
    page = visit.open("/create")
    page.get_by_role("button", name="Head to head").click()
    page.get_by_role("checkbox", name="bob").check()
    assert not page.get_by_role("checkbox", name="Itself").is_checked()
    page.get_by_label("Cars on the road").fill("3")
    page.get_by_role("button", name="In words").click()
    page.locator("section", has_text="Until when").get_by_role("textbox").fill("1000 steps")
    page.route("**/api/models", make_untrained)
    with page.expect_request("**/api/models") as sent:
        page.get_by_role("button", name="Train now").first.click()
    wanted = sent.value.post_data_json
    asked = {name: wanted[name] for name in ("race", "opponents", "cars", "reward", "actions", "critic", "sensors")}
    assert asked == {
        "race": "head-to-head",
        "opponents": ["bob"],
        "cars": 3,
        "reward": "duel",
        "actions": "continuous",
        "critic": "lap",
        "sensors": ["FRONT_FACING_CAMERA", "LIDAR"],
    }
    page.wait_for_url("**/models/**")
    page.unroute("**/api/models")


def test_the_settings_say_where_things_are(visit: Visit) -> None:
    page = visit.open("/settings")
    page.get_by_text(str(visit.console.runs), exact=True).wait_for()
    level = "Locked in by the kernel" if find_confinement().is_complete else "Process of its own"
    page.get_by_text(level).wait_for()
    page.get_by_role("button", name="Dark").click()
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    page.get_by_role("button", name="Deutsch").click()
    page.get_by_role("heading", name="Einstellungen").wait_for()
    assert page.evaluate("document.documentElement.lang") == "de"
    page.get_by_role("button", name="English").click()


def test_every_page_has_a_title_and_wrong_addresses_lead_on(visit: Visit) -> None:
    from playwright.sync_api import expect

    titles = {
        "/": "Garage",
        "/create": "New model",
        "/models/ada/race": "ada: Evaluation",
        "/tracks": "Tracks",
        "/drive/oval": "Drive: Paperclip",
        "/races/new": "New race",
        "/contests/new": "New heat or ladder",
        "/settings": "Settings",
    }
    for path, title in titles.items():
        expect(visit.open(path)).to_have_title(f"{title} · Racecraft")  # a track's is known once it has been asked
    for path in ("/nowhere", "/models/nobody", "/races/99", "/contests/0", "/races/nonsense", "/drive/nowhere"):
        page = visit.open(path)
        page.get_by_role("heading", name="There is nothing here").wait_for()
        page.locator("main").get_by_role("link").click()
        page.get_by_role("heading", name="There is nothing here").wait_for(state="detached")
    # the browser's words about addresses that the server does not have
    assert all(complaint.startswith("Failed to load resource") for complaint in visit.complaints)
    visit.complaints.clear()


@needs_axe
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_serious_and_nothing_sticks_out(visit: Visit, theme: str) -> None:
    visit.look(theme, "de" if theme == "dark" else "en")
    races = visit.console.client.get("/api/races").json()
    found: dict[str, Any] = {}
    contests = visit.console.client.get("/api/contests").json()
    for path in (
        "/races",
        "/races/new",
        "/contests/new",
        "/settings",
        "/nowhere",
        *(f"/races/{race['id']}" for race in races[:1]),
        *(f"/contests/{contest['id']}" for contest in contests[:1]),
    ):
        found |= visit.flaws(path)
    assert found == {}
