"""A class's page in a real browser, without a mouse: names, cards, who is taken out, and where the keyboard goes on."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from browsers import Visit, needs_axe, needs_browser, needs_pages, visiting
from leagues import RunningLeague, ok, running_league
from schools import RACE

from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, Submission, now

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture
def league(tmp_path: Path) -> Iterator[RunningLeague]:
    with running_league(tmp_path / "runs") as league:
        yield league


@pytest.fixture
def visit(league: RunningLeague) -> Iterator[Visit]:
    with visiting(league.console) as visit:
        yield visit
        assert visit.complaints == []


@needs_axe
def test_a_teacher_without_a_mouse_names_a_class_and_takes_out_only_who_is_meant(
    league: RunningLeague, visit: Visit
) -> None:
    from playwright.sync_api import expect

    group = league.group("Class 7b")
    page = visit.open(f"/groups/{group}", width=360, height=740)
    main = page.locator("#main")
    page.get_by_role("textbox", name="Make cards for a class").fill("Comet, Ada Lovelace\nTurbo, Alan Turing\n")
    page.get_by_role("button", name="Make 2 cards").press("Enter")
    page.get_by_role("heading", name="Login cards").wait_for()
    expect(main).to_be_focused()
    page.get_by_role("button", name="Done").press("Enter")
    expect(main).to_be_focused()

    page.get_by_role("button", name="Rename: Comet").press("Enter")
    name = page.get_by_label("Nickname", exact=True).and_(page.locator("input"))
    expect(name).to_be_focused()
    name.press("Escape")
    expect(page.get_by_role("button", name="Rename: Comet")).to_be_focused()
    page.keyboard.press("Enter")
    name.fill("Heron")
    name.press("Enter")
    expect(page.get_by_role("button", name="Rename: Heron")).to_be_focused()

    people = page.get_by_role("region", name="People")
    page.get_by_role("button", name="Remove: Turbo").press("Enter")
    sure = page.get_by_role("alert").filter(has_text="Take Turbo out of the group?")
    expect(sure.get_by_role("button", name="Cancel")).to_be_focused()
    assert visit.violations() == []
    assert visit.overflow() <= 0
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Remove: Turbo")).to_be_focused()
    page.keyboard.press("Enter")
    expect(sure).to_be_visible()
    assert [one["name"] for one in ok(league.owner.get(f"/api/groups/{group}"))["members"][1:]] == ["Heron", "Turbo"]
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    expect(people.get_by_text("Turbo")).to_have_count(0)
    expect(main).to_be_focused()
    used = page.get_by_role("region", name="What everybody may use").locator("tbody strong")
    expect(used).to_have_text(["Heron"])


def test_how_far_a_class_is_in_the_course_names_who_is_in_it_now(league: RunningLeague, visit: Visit) -> None:
    from playwright.sync_api import expect

    group = league.group("Class 7b")
    code = league.code(group)
    for name in ("Comet", "Turbo"):
        ok(league.join(code, name).put("/api/lessons/1/progress", json={"is_read": True}))
    page = visit.open(f"/groups/{group}")
    course = page.get_by_role("region", name="How far they are in the course")
    expect(course.locator("tbody strong")).to_have_text(["Comet", "Turbo"])
    page.get_by_role("button", name="Rename: Comet").click()
    page.keyboard.press("Control+A")
    page.keyboard.type("Heron")
    page.keyboard.press("Enter")
    expect(course.locator("tbody strong")).to_have_text(["Heron", "Turbo"])
    page.get_by_role("button", name="Remove: Turbo").click()
    page.get_by_role("alert").get_by_role("button", name="Remove").click()
    expect(course.locator("tbody strong")).to_have_text(["Heron"])
    expect(course.get_by_role("img", name="Lesson 1: read")).to_have_count(1)


def test_who_ends_a_race_without_a_mouse_goes_on_where_it_was(league: RunningLeague, visit: Visit) -> None:
    from playwright.sync_api import expect

    race = {"title": "Friday cup", "track": "oval", "laps": 1}
    number = ok(league.owner.post(f"/api/groups/{league.group('Class 7b')}/races", json=race), 201)["id"]
    page = visit.open(f"/league/{number}")
    end, away = (page.get_by_role("button", name=name, exact=True).first for name in ("End the race", "Put away"))
    for asked in (away, end):
        asked.press("Enter")
        page.get_by_role("alert").get_by_role("button", name="Cancel").press("Enter")
        expect(asked).to_be_focused()
    end.press("Enter")
    page.get_by_role("alert").get_by_role("button", name="End the race").press("Enter")
    page.get_by_text("Over", exact=True).wait_for()
    expect(page.locator("#main")).to_be_focused()


@needs_axe
@pytest.mark.parametrize("language", ["en", "de"])
def test_a_teacher_renames_a_class_closes_it_and_opens_it_again(
    league: RunningLeague, visit: Visit, language: str
) -> None:
    from playwright.sync_api import expect

    group = league.group("Class 7b")
    pupil = league.join(league.code(group), "Comet")
    race = ok(league.owner.post(f"/api/groups/{group}/races", json={"title": "Friday cup", "track": "oval"}), 201)["id"]
    told = {
        "en": "Name of the group|Rename|Close the group|Cancel|Open the group again|Closed|New race",
        "de": "Name der Gruppe|Umbenennen|Gruppe schließen|Abbrechen|Gruppe wieder öffnen|Geschlossen|Neues Rennen",
    }
    title, rename, close, cancel, again, closed, new_race = told[language].split("|")
    visit.look("light", language)
    page = visit.open(f"/groups/{group}", width=360, height=740)
    button = page.get_by_role("button", name=close, exact=True)

    button.press("Enter")
    expect(page.get_by_role("alert").get_by_role("button", name=cancel)).to_be_focused()
    page.keyboard.press("Escape")
    expect(button).to_be_focused()
    page.keyboard.press("Enter")
    visit.complaints.clear()
    page.get_by_role("alert").get_by_role("button", name=close).press("Enter")
    page.get_by_text("races are over; these" if language == "en" else "Rennen vorbei sind; diese").wait_for()
    expect(button).to_be_focused()
    assert len(visit.complaints) == 1, "of a race that is not over the browser tells that it was refused"
    visit.complaints.clear()
    ok(league.owner.delete(f"/api/league/races/{race}"), 204)

    page.get_by_label(title).fill("Class 7b, 2026")
    page.get_by_role("button", name=rename, exact=True).press("Enter")
    page.get_by_role("heading", name="Class 7b, 2026").wait_for()
    button.press("Enter")
    page.get_by_role("alert").get_by_role("button", name=close).press("Enter")
    expect(page.get_by_role("button", name=again)).to_be_focused()
    expect(page.get_by_text(closed, exact=True)).to_be_visible()
    expect(page.get_by_role("heading", name=new_race)).to_have_count(0)
    page.get_by_role("status").get_by_text("2026").first.wait_for()
    assert visit.violations() == []
    assert visit.overflow() <= 0
    page.goto(f"{league.console.client.base_url}/league")
    expect(page.locator("li", has_text="Class 7b, 2026").get_by_text(closed, exact=True)).to_be_visible()
    assert ok(pupil.get("/api/groups"))[0]["closed"]

    page = visit.open(f"/groups/{group}")
    page.get_by_role("button", name=again).press("Enter")
    expect(button).to_be_focused()
    expect(page.get_by_role("heading", name=new_race)).to_be_visible()


def test_who_looks_after_entries_without_a_mouse_is_led_into_the_field_and_back(
    league: RunningLeague, visit: Visit, entry: bytes
) -> None:
    from playwright.sync_api import expect

    group = league.group("Class 7b")
    pupil = league.join(league.code(group), "Comet")
    race = ok(league.owner.post(f"/api/groups/{group}/races", json=RACE), 201)["id"]
    address = f"/api/league/races/{race}/submissions"
    number = ok(pupil.post(f"{address}?model=rocket", content=entry), 202)["id"]
    league.console.wait_for(lambda: ok(pupil.get(f"{address}/{number}"))["state"] == "done")
    page = visit.open(f"/league/{race}")
    rename, out = page.get_by_role("button", name="Rename: rocket, Comet"), page.get_by_role("button", name="Take out")
    name = page.get_by_label("What the model is called")
    rename.press("Enter")
    expect(name).to_be_focused()
    name.press("Escape")
    expect(rename).to_be_focused()
    out.first.press("Enter")
    expect(page.get_by_label("Reason, which its owner reads")).to_be_focused()
    page.keyboard.press("Escape")
    expect(rename).to_be_focused()
    page.keyboard.press("Enter")
    name.fill("polite")
    name.press("Enter")
    expect(page.get_by_role("button", name="Rename: polite, Comet")).to_be_focused()


def test_a_window_that_is_older_than_the_end_of_a_class_says_so_and_shows_it(
    league: RunningLeague, visit: Visit
) -> None:
    from playwright.sync_api import expect

    group = league.group("Class 7b")
    page = visit.open(f"/groups/{group}")
    page.get_by_role("button", name="Make a code").wait_for()
    ok(league.owner.patch(f"/api/groups/{group}", json={"is_closed": True}), 204)  # in another window
    page.get_by_role("button", name="Make a code").click()
    page.get_by_text("The group is closed.").wait_for()
    page.get_by_role("button", name="Open the group again").wait_for()
    expect(page.get_by_role("button", name="Make a code")).to_have_count(0)
    assert len(visit.complaints) == 1, "of what was refused"
    visit.complaints.clear()


def test_whose_row_of_a_season_it_is_stays_in_sight_on_a_phone(league: RunningLeague, visit: Visit) -> None:
    group = league.group("Class 7b")
    pupil = league.number(league.join(league.code(group), "Comet"))
    titles = [f"The long night of the oval, part {number}" for number in range(4)]
    races = [ok(league.owner.post(f"/api/groups/{group}/races", json={**RACE, "title": one}), 201) for one in titles]
    database = Database(f"sqlite:///{league.console.runs / '.racecraft' / 'console.db'}")
    with database.transaction() as session:
        session.add(Job(id="j", kind="judge", run="", state="done", user_id=pupil))
        session.flush()
        for race in races:
            driven = {"score_ms": 9000, "best_lap_ms": 9000, "completion": 1.0, "judged": now()}
            session.add(Submission(race_id=race["id"], user_id=pupil, job_id="j", digest="d", model="m", **driven))
    database.close()
    for race in races:
        ok(league.owner.patch(f"/api/league/races/{race['id']}", json={"is_over": True}))
    page = visit.open(f"/groups/{group}/season", width=360, height=740)
    season = page.get_by_role("region", name="Season")
    name, last = season.get_by_text("Comet"), season.locator("tbody td").last
    season.evaluate("one => one.scrollLeft = one.scrollWidth")
    seen = [one.bounding_box() for one in (season, name, last)]
    (frame, row, cell) = ((box["x"], box["x"] + box["width"]) for box in seen if box is not None)
    assert frame[0] <= row[0] < row[1] <= cell[0] < cell[1] <= frame[1] + 1
    assert visit.overflow() <= 0


@needs_axe
def test_the_audit_log_is_read_on_a_phone(league: RunningLeague, visit: Visit) -> None:
    group = league.group("Class 7b, which meets on Fridays")
    league.join(league.code(group), "Comet")
    member = ok(league.owner.get(f"/api/groups/{group}"))["members"][1]["id"]
    ok(league.owner.post(f"/api/groups/{group}/members/{member}/revoke"), 204)
    page = visit.open("/league/audit", width=360, height=740)
    log = page.get_by_role("region", name="Audit log")
    log.get_by_text("revoke_member").wait_for()
    assert log.evaluate("one => one.scrollWidth - one.clientWidth") <= 0, "nothing of it is beyond the edge"
    for text in (
        "revoke_member",
        f"/api/groups/{group}/members/{member}/revoke",
        "title Class 7b, which meets on Fridays",
    ):
        box = log.get_by_text(text).bounding_box()
        assert box is not None, text
        assert box["x"] >= 0, text
        assert box["x"] + box["width"] <= 360, text
    assert visit.overflow() <= 0
    assert visit.violations() == []


@pytest.mark.parametrize("ahead", [timedelta(hours=1), timedelta(days=-400)])
def test_a_race_ends_now_on_a_computer_whose_clock_is_wrong(
    league: RunningLeague, visit: Visit, ahead: timedelta
) -> None:
    race = {"title": "Friday cup", "track": "oval", "laps": 1}
    number = ok(league.owner.post(f"/api/groups/{league.group('Class 7b')}/races", json=race), 201)["id"]
    own = ok(league.owner.post("/api/races", json=race), 201)["id"]
    visit.page.clock.set_fixed_time(datetime.now(UTC) + ahead)
    page = visit.open(f"/league/{number}")
    page.get_by_role("button", name="End the race").click()
    page.get_by_role("alert").get_by_role("button", name="End the race").click()
    page.get_by_text("Over", exact=True).wait_for()
    assert ok(league.owner.get(f"/api/boards/{number}"))["race"]["secret"]
    page = visit.open(f"/races/{own}")
    page.get_by_role("button", name="Close the race").click()
    page.get_by_text("Over", exact=True).wait_for()
    assert ok(league.owner.get(f"/api/races/{own}"))["state"] == "closed"


HURRY = """(() => {
  const again = window.setInterval;
  window.setInterval = (act, wait, ...more) => again(act, wait === 8000 ? 1000 : wait, ...more);
})()"""  # how often the wall asks for the code


@needs_axe
def test_the_code_on_the_wall_is_the_one_that_is_good_now(league: RunningLeague, visit: Visit) -> None:
    group = league.group("Class 7b")
    race = {"title": "Friday cup", "track": "oval", "laps": 1}
    number = ok(league.owner.post(f"/api/groups/{group}/races", json=race), 201)["id"]
    visit.page.add_init_script(HURRY)
    page = visit.open(f"/league/{number}/screen", width=1024, height=768)
    page.get_by_role("img", name="Paperclip").wait_for()
    join = page.get_by_role("heading", name="Join in")
    assert join.count() == 0
    for _ in range(2):
        code = league.code(group)
        page.get_by_text(f"{code[:4]}-{code[4:]}").wait_for()
    size = page.get_by_text(f"{code[:4]}-{code[4:]}").evaluate("one => parseFloat(getComputedStyle(one).fontSize)")
    assert size > 768 / 40, "read from the last row"
    assert visit.overflow() <= 0
    assert visit.violations() == []
    ok(league.owner.delete(f"/api/groups/{group}/joining"), 204)
    join.wait_for(state="detached")
    ok(league.owner.delete(f"/api/league/races/{number}"), 204)
    page.get_by_role("heading", name=f"There is no race {number} in this league.").wait_for()  # and no board of it
    page.goto("about:blank")
    visit.complaints = [one for one in visit.complaints if "404" not in one]
