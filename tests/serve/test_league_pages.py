"""A lesson in real browsers: a teacher's and two pupils' at once, from the first card to the board at the wall."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest
from browsers import (
    THEMES,
    Visit,
    complaints_of,
    needs_axe,
    needs_browser,
    needs_pages,
    violations_by_theme,
)
from leagues import RunningLeague, ok, running_league, untrained_run
from running_consoles import PATIENCE

from chromium import launched
from few_frames import FEW_FRAMES
from racecraft.serve.store.tables import now

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@dataclass
class Lesson:
    """A league, and the browsers of who is in the room."""

    league: RunningLeague
    browser: Browser
    visits: dict[str, Visit]

    def arrive(self, name: str) -> Visit:
        """Somebody's own browser, that knows nothing yet."""
        page = self.browser.new_context(locale="en-GB").new_page()
        page.add_init_script(FEW_FRAMES)
        page.set_default_timeout(1000 * PATIENCE)
        visit = self.visits[name] = Visit(self.league.console, page)
        page.on("console", lambda message: visit.complaints.extend(complaints_of(message)))
        page.on("pageerror", lambda error: visit.complaints.append(str(error)))
        return visit


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lesson]:
    from playwright.sync_api import sync_playwright

    with running_league(tmp_path_factory.mktemp("lesson") / "runs") as league, sync_playwright() as playwright:
        browser = launched(playwright)
        lesson = Lesson(league, browser, {})
        teacher = lesson.arrive("teacher")
        cookie = league.owner.cookies["racecraft_session"]
        teacher.page.context.add_cookies(
            [{"name": "racecraft_session", "value": cookie, "url": str(league.owner.base_url)}]
        )
        yield lesson
        browser.close()
        assert {name: visit.complaints for name, visit in lesson.visits.items()} == {name: [] for name in lesson.visits}


@pytest.fixture(scope="module")
def race(lesson: Lesson) -> int:
    """A class with cards, two of them used, and a race that both have entered."""
    page = lesson.visits["teacher"].open("/league")
    page.get_by_label("New group").fill("Class 7b")
    page.get_by_role("button", name="Make", exact=True).click()
    page.get_by_role("heading", name="Class 7b").wait_for()
    page.get_by_role("textbox", name="Make cards for a class").fill("Comet, Ada Lovelace\nTurbo\n")
    page.get_by_role("button", name="Make 2 cards").click()
    page.get_by_role("heading", name="Login cards").wait_for()
    links = ["".join(link.split()) for link in page.locator(".sheet .link").all_inner_texts()]
    assert len(links) == 2
    page.get_by_role("button", name="Done").click()
    page.get_by_role("cell", name="Ada Lovelace").wait_for()
    page.get_by_label("Title").fill("Friday cup")
    page.get_by_role("combobox", name="Track", exact=True).select_option("oval")
    page.get_by_label("Laps", exact=True).fill("1")
    page.get_by_role("button", name="Make the race").click()
    page.get_by_text("Nobody has arrived yet.").wait_for()
    number = int(page.url.split("/")[-1])

    for name, link, seed in zip(("Comet", "Turbo"), links, (1, 3), strict=True):
        pupil = lesson.arrive(name).page
        address, _, secret = link.partition("/card")
        pupil.goto(f"{address}/card#{secret}")
        pupil.get_by_role("link", name="Friday cup").first.wait_for()
        assert pupil.evaluate("location.href").endswith("/league"), "the secret does not stay in the address"
        member = ok(pupil_client(lesson, name).get("/api/account"))["id"]
        home = lesson.league.console.runs / ".racecraft" / "people" / str(member)
        untrained_run(home, f"{name.lower()}-one", seed=seed)
    return number


def pupil_client(lesson: Lesson, name: str) -> Any:
    """What somebody's browser is known by, for a program."""
    client = lesson.league.stranger()
    (cookie,) = lesson.visits[name].page.context.cookies()
    client.cookies.set("racecraft_session", str(cookie["value"]))
    return client


def test_two_pupils_enter_and_see_where_they_stand(lesson: Lesson, race: int) -> None:
    wall = lesson.visits["teacher"].open(f"/league/{race}/screen")
    wall.get_by_text("Nobody has arrived yet.").wait_for()
    for name in ("Comet", "Turbo"):
        page = lesson.visits[name].open(f"/league/{race}")
        page.get_by_text("Not in the race yet").wait_for()
        page.get_by_label("Model", exact=True).select_option(f"{name.lower()}-one")
        page.get_by_role("button", name="Enter").click()
        page.get_by_text("Judged", exact=True).wait_for()
    rows = ok(lesson.league.owner.get(f"/api/boards/{race}"))["rows"]
    order = [row["name"] for row in rows]
    assert sorted(order) == ["Comet", "Turbo"]
    wall.get_by_role("listitem").nth(1).wait_for()  # by itself
    assert wall.locator("li .name").all_inner_texts() == order
    for place, name in enumerate(order, start=1):
        page = lesson.visits[name].open(f"/league/{race}")
        page.get_by_text(f"{place} of 2").wait_for()
        assert name in page.locator("tr[aria-current=true]").inner_text()
        page.get_by_text("You lead." if place == 1 else f"{rows[1]['gap']:.2f} s behind").wait_for()
        assert page.get_by_role("button", name="Film").count() == 0
        assert page.get_by_text("Ada Lovelace").count() == 0


def test_a_board_that_was_left_asks_for_nothing_more(lesson: Lesson, race: int) -> None:
    page = lesson.visits["Comet"].open(f"/league/{race}")
    held: list[Any] = []
    page.route(f"**/api/boards/{race}?*", lambda route: held.append(route))
    for _ in range(100):
        if held:
            break
        page.wait_for_timeout(100)
    page.get_by_role("navigation").get_by_role("link", name="League").click()
    page.wait_for_url("**/league")
    asked: list[str] = []
    note = lambda request: asked.append(request.url)  # noqa: E731
    page.on("request", note)
    for route in held:
        route.continue_()
    page.unroute(f"**/api/boards/{race}?*")
    page.wait_for_timeout(5500)  # longer than a board waits
    page.remove_listener("request", note)
    assert [url for url in asked if f"/api/boards/{race}?" in url] == []


def test_the_teacher_judges_and_ends_it_and_everybody_sees_the_films(lesson: Lesson, race: int) -> None:
    last = ok(lesson.league.owner.get(f"/api/boards/{race}"))["rows"][1]["name"]
    teacher, pupil = lesson.visits["teacher"].open(f"/league/{race}"), lesson.visits[last].open(f"/league/{race}")
    teacher.get_by_role("button", name=f"Take out: {last}").click()
    teacher.get_by_label("Reason, which its owner reads").fill("Driven by hand. " + 180 * "x")
    teacher.get_by_role("button", name="Take out", exact=True).click()
    pupil.get_by_text("Does not count: Driven by hand.").wait_for()
    pupil.set_viewport_size({"width": 390, "height": 844})
    assert lesson.visits[last].overflow() == 0, "whatever words are given as the reason"
    pupil.set_viewport_size({"width": 1440, "height": 900})
    teacher.get_by_role("button", name=f"Let in again: {last}").click()
    pupil.get_by_text("2 of 2").wait_for()

    teacher.get_by_role("button", name="End the race").click()
    teacher.get_by_role("alert").get_by_role("button", name="End the race").click()
    pupil.get_by_role("button", name="Film of the first eight").wait_for()
    pupil.locator(f"button[aria-label='Film: {'Turbo' if last == 'Comet' else 'Comet'}']").click()
    pupil.locator("#film").get_by_label("Live").wait_for()
    assert sorted(pupil.locator("#film li button span:first-of-type").all_inner_texts()) == ["Comet", "Turbo"]

    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    racer = f"/api/groups/{group}/members/{lesson.league.number(pupil_client(lesson, last))}"
    ok(lesson.league.owner.patch(racer, json={"name": 32 * "W"}), 204)
    wall = lesson.visits["teacher"].open(f"/league/{race}/screen", width=390)
    wall.get_by_role("heading", name=re.compile("^Time behind")).wait_for()
    assert lesson.visits["teacher"].overflow() == 0, "the longest name fits a phone"
    ok(lesson.league.owner.patch(racer, json={"name": last}), 204)


def test_the_best_meet_in_a_final_and_the_wall_shows_it_heat_by_heat(lesson: Lesson, race: int) -> None:
    teacher, group = lesson.visits["teacher"], ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    page = teacher.open(f"/groups/{group}")
    page.get_by_role("button", name="Final", exact=True).click()
    page.get_by_label("Title", exact=True).fill("Grand final")
    page.get_by_label("Qualifying is").select_option("Friday cup")
    page.get_by_label("How many of its first").fill("2")
    page.get_by_role("combobox", name="Track", exact=True).select_option("oval")
    page.get_by_label("Laps", exact=True).fill("1")
    page.get_by_role("button", name="Make the race").click()
    page.get_by_text("with what they qualified with, once that is over").wait_for()
    final = int(page.url.split("/")[-1])
    pupil = lesson.visits["Comet"].open(f"/league/{final}")
    pupil.get_by_role("heading", name="Bracket").wait_for()
    assert pupil.get_by_role("button", name="Enter").count() == 0
    page.get_by_role("button", name="Drive the final").click()
    duel = page.get_by_role("button", name=" wins")
    duel.wait_for()
    first, second = ok(lesson.league.owner.get(f"/api/boards/{final}"))["rows"]
    assert f"{first['name']} wins" in duel.inner_text()
    pupil.get_by_text("1 of 2" if first["name"] == "Comet" else "2 of 2").wait_for()
    duel.click()
    page.locator("#film").get_by_label("Live").wait_for()

    wall = teacher.open(f"/league/{final}/screen")
    wall.get_by_role("heading", name=f"{first['name']} and {second['name']}").or_(
        wall.get_by_role("heading", name=f"{second['name']} and {first['name']}")
    ).wait_for()
    wall.get_by_label("Live").wait_for()
    assert wall.get_by_role("button", name=" wins").count() == 0, "nothing is told before it was shown"
    wall.get_by_role("button", name="To its end").click()
    wall.get_by_role("button", name=" wins").wait_for()
    wall.locator(".stage li", has_text=first["name"]).get_by_text("1", exact=True).wait_for()

    page = teacher.open(f"/groups/{group}/season")
    row = page.get_by_role("row", name=first["name"])
    assert "+25" in row.inner_text()


def test_a_wall_says_what_film_is_gone_and_a_final_goes_on_without_it(lesson: Lesson, race: int) -> None:
    teacher, state = lesson.visits["teacher"], lesson.league.console.runs / ".racecraft"
    (final,) = [one["id"] for one in ok(lesson.league.owner.get("/api/league/races")) if one["form"] == "bracket"]
    replays = [*state.glob("submissions/*/entry.replay"), *state.glob("finals/*/0/heat-0.replay")]
    assert len(replays) == 3
    for replay in replays:
        replay.rename(replay.with_suffix(".away"))
    try:
        wall = teacher.open(f"/league/{race}/screen")
        wall.get_by_role("alert").get_by_text("has no replay.").wait_for()
        assert wall.get_by_text("Loading…").count() == 0
        wall = teacher.open(f"/league/{final}/screen")
        wall.get_by_role("alert").get_by_text("There is no heat 0 of a duel 0 in this race.").wait_for()
        wall.get_by_role("button", name="Heat 2", pressed=True).wait_for()  # by itself
        wall.get_by_label("Live").wait_for()
    finally:
        for replay in replays:
            replay.with_suffix(".away").rename(replay)
    gone = [one for one in teacher.complaints if "404" in one]
    assert len(gone) == 2
    teacher.complaints = [one for one in teacher.complaints if one not in gone]


def test_a_spectator_without_account_sees_how_the_pace_went_in_the_public_races(lesson: Lesson, race: int) -> None:
    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    terms = {"title": "Monday cup", "track": "oval", "laps": 1}
    second = ok(lesson.league.owner.post(f"/api/groups/{group}/races", json=terms), 201)["id"]
    address = f"/api/league/races/{second}"
    for name in ("Comet", "Turbo"):
        model = f"{name.lower()}-one"
        number = ok(pupil_client(lesson, name).post(f"{address}/enter", json={"model": model}), 202)["id"]
        entered = f"{address}/submissions/{number}"
        lesson.league.console.wait_for(lambda: ok(pupil_client(lesson, name).get(entered))["state"] == "done")  # noqa: B023
    ok(lesson.league.owner.patch(address, json={"closes": now().isoformat(), "is_public": True}))
    spectator = lesson.arrive("spectator")
    page = spectator.open(f"/league/{second}")
    page.get_by_role("row", name="Comet").wait_for()
    page.wait_for_load_state("networkidle")
    lines = page.locator("table.standings svg[role=img]")
    assert lines.count() == 0, "one race is no line, and the other one is not theirs to see"
    ok(lesson.league.owner.patch(f"/api/league/races/{race}", json={"is_public": True}))
    page = spectator.open(f"/league/{second}")
    lines.nth(1).wait_for()
    first = ok(lesson.league.owner.get(f"/api/boards/{race}"))["rows"][0]["name"]
    said = page.get_by_role("row", name=first).locator("svg[role=img]").get_attribute("aria-label")
    assert "Friday cup: first" in str(said)
    assert "Monday cup" in str(said)
    spectator.complaints = [one for one in spectator.complaints if "401" not in one]


def test_the_teacher_says_something_about_a_model_and_its_owner_reads_it(lesson: Lesson, race: int) -> None:
    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    page = lesson.visits["teacher"].open(f"/groups/{group}")
    page.get_by_role("button", name="Comment: comet-one, Comet").click()
    page.get_by_label("About comet-one").fill("Brake before the hairpin.")
    page.get_by_role("button", name="Say it").click()
    page.get_by_role("button", name="Remove: Brake before the hairpin.").wait_for()
    pupil = lesson.visits["Comet"].open("/league")
    pupil.get_by_text("Brake before the hairpin.").wait_for()
    pupil.get_by_text("from who organises the group").wait_for()  # as long as the teacher has no name but "you"
    pupil.get_by_role("link", name="comet-one").click()
    said = pupil.get_by_role("region", name="What was said about it")
    said.get_by_text("Brake before the hairpin.").wait_for()
    said.get_by_role("button", name="Remove").click()
    said.wait_for(state="detached")


def test_a_race_is_put_away_only_by_who_means_it_and_says_what_one_may(lesson: Lesson, race: int) -> None:
    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    spare = ok(lesson.league.owner.post(f"/api/groups/{group}/races", json={"title": "Spare", "track": "oval"}), 201)[
        "id"
    ]
    address = f"/api/league/races/{spare}"
    ok(lesson.league.owner.patch(address, json={"attempts_per_day": 3}))
    pupil = lesson.visits["Comet"].open(f"/league/{spare}")
    pupil.get_by_text("3 entries a day").wait_for()
    page = lesson.visits["teacher"].open(f"/league/{spare}")
    page.get_by_role("button", name="Put away").click()
    sure = page.get_by_role("alert")
    sure.get_by_role("button", name="Cancel").click()
    sure.wait_for(state="detached")
    ok(lesson.league.owner.get(f"/api/boards/{spare}"))
    lesson.visits["Comet"].open("/league")  # whose board would ask for what is no more
    page.get_by_role("button", name="Put away").click()
    sure.get_by_role("button", name="Put away").click()
    page.get_by_text("The race is put away.").wait_for()
    assert lesson.league.owner.get(f"/api/boards/{spare}").status_code == 404


def test_a_code_at_the_wall_and_a_card_that_was_lost(lesson: Lesson, race: int) -> None:
    teacher = lesson.visits["teacher"].open("/league")
    teacher.get_by_role("link", name="Class 7b", exact=True).click()
    teacher.get_by_role("button", name="Make a code").click()
    link = str(teacher.locator(".joining img").get_attribute("alt"))
    pupil = lesson.arrive("Rocket")
    page = pupil.page
    page.goto(link)
    page.get_by_role("button", name="Come in").wait_for()
    page.get_by_label("Nickname").fill("comet")
    page.get_by_role("button", name="Come in").click()
    page.get_by_role("alert").get_by_text("looks like one that is").wait_for()
    page.get_by_label("Nickname").fill("Rocket")
    page.get_by_role("button", name="Come in").click()
    page.get_by_role("heading", name="Hello, Rocket!").wait_for()
    page.get_by_role("button", name="Let's go").click()
    page.get_by_role("link", name="Friday cup").first.wait_for()

    teacher.reload()
    teacher.get_by_role("button", name="Lock out: Rocket").click()
    teacher.get_by_text("Rocket is locked out").wait_for()
    page.get_by_role("link", name="Class 7b").click()
    page.get_by_role("heading", name="Come in").wait_for()
    pupil.complaints = [one for one in pupil.complaints if "409" not in one and "401" not in one]  # both were wanted


def test_what_may_be_used_is_said_by_the_teacher_and_seen_by_everybody(lesson: Lesson, race: int) -> None:
    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    page = lesson.visits["teacher"].open(f"/groups/{group}")
    page.get_by_label("Minutes of training a day").fill("30")
    page.locator("form", has=page.get_by_label("Jobs at once")).get_by_role("button", name="Save").click()
    page.get_by_text("That is what they may use now.").wait_for()
    row = page.get_by_role("region", name="What everybody may use").get_by_role("row", name="Comet")
    row.get_by_text("0 of 30").wait_for()
    page = lesson.visits["Comet"].open("/me")
    page.get_by_text("0 of 30").wait_for()
    page.get_by_text("1 of 200").wait_for()


def test_whoever_holds_the_league_makes_tokens_for_workers(lesson: Lesson, race: int) -> None:
    page = lesson.visits["teacher"].open("/me")
    page.get_by_label("What for").fill("lab")
    page.get_by_label("For a worker").check()
    page.get_by_role("button", name="Make a token").click()
    bearer = {"authorization": f"Bearer {page.locator('code').inner_text()}"}
    page.get_by_text("lab (worker)").wait_for()
    stranger = lesson.league.stranger()
    assert stranger.get("/api/workers", headers=bearer).status_code == 200
    assert stranger.get("/api/models", headers=bearer).status_code == 403
    page = lesson.visits["Comet"].open("/me")
    page.get_by_role("button", name="Make a token").wait_for()
    assert page.get_by_label("For a worker").count() == 0


def test_an_account_is_ones_own(lesson: Lesson, race: int) -> None:
    visit = lesson.visits["Turbo"]
    page = visit.open("/me")
    page.get_by_label("New password, at least 10 characters").fill("correct horse")
    page.get_by_role("button", name="Save").nth(1).click()
    page.get_by_text("The password is set.").wait_for()
    page.get_by_role("button", name="Make a token").click()
    token = page.locator("code").inner_text()
    client = lesson.league.stranger()
    races = ok(client.get("/api/league/races", headers={"authorization": f"Bearer {token}"}))
    assert race in [one["id"] for one in races]
    with page.expect_download() as download:
        page.get_by_role("link", name="What is kept of me").click()
    assert "Friday cup" in download.value.path().read_text()
    page.get_by_role("button", name="Sign out", exact=True).click()
    page.get_by_role("button", name="Password").click()
    page.get_by_label("Nickname").fill("turbo")
    page.get_by_label("Password", exact=True).fill("correct horse")
    page.get_by_role("button", name="Come in").click()
    page.get_by_role("link", name="Friday cup").first.wait_for()
    page = visit.open("/me")
    assert [one for one in visit.complaints if "401" not in one] == []
    page.get_by_label("Type your nickname").fill("Turbo")
    page.get_by_label("Your password").fill("a wrong password")
    page.get_by_role("button", name="Delete my account").click()
    page.get_by_text("That is not your password.").wait_for()
    page.get_by_label("Your password").fill("correct horse")
    page.get_by_role("button", name="Delete my account").click()
    page.get_by_role("heading", name="Come in").wait_for()
    visit.complaints.clear()  # what a page had asked when she signed out, and when there was no account any more
    assert "Turbo" not in [row["name"] for row in ok(lesson.league.owner.get(f"/api/boards/{race}"))["rows"]]


def test_a_page_comes_up_behind_a_fragment_that_cannot_be_read(lesson: Lesson) -> None:
    astray, teacher = lesson.arrive("astray"), lesson.visits["teacher"]
    for visit, path in ((astray, "card"), (astray, "join"), (astray, "reset"), (teacher, "me")):
        visit.page.goto(f"{visit.console.client.base_url}/{path}#%E0%A4%A")
        visit.page.locator("h1").wait_for()
    assert [one for one in astray.complaints if "401" not in one] == []
    astray.complaints.clear()  # who asks at the door is a stranger: 401


def test_a_forgotten_password_and_the_log_that_tells_of_it(lesson: Lesson, race: int) -> None:
    from playwright.sync_api import expect

    page = lesson.visits["teacher"].open("/league")
    card = page.locator("section.card", has=page.get_by_role("heading", name="A forgotten password"))
    card.get_by_label("Nickname").fill("comet")
    card.get_by_role("button", name="Make a link").click()
    link = card.locator("code").inner_text()
    forgetful = lesson.arrive("forgetful")
    forgetful.page.goto(link)
    forgetful.page.get_by_label("New password").fill("correct horse battery")
    forgetful.page.get_by_role("button", name="Come in").click()
    forgetful.page.get_by_role("link", name="Friday cup").first.wait_for()
    forgetful.complaints.clear()  # who asks at the door is a stranger: 401
    lesson.visits["Comet"].page.context.add_cookies(forgetful.page.context.cookies())  # she was signed out
    lesson.visits["Comet"].complaints.clear()
    for _ in range(60):
        ok(lesson.league.owner.post("/api/resets", json={"person": "Comet"}), 201)
    page.get_by_role("link", name="Audit log").click()
    page.get_by_role("heading", name="Audit log").wait_for()
    rows = page.locator("tbody tr")
    rows.nth(49).wait_for()
    assert rows.count() == 50
    page.get_by_role("button", name="Older").click()
    page.get_by_role("cell", name="reset_password", exact=True).wait_for()
    page.get_by_role("button", name="To the latest").click()
    page.get_by_label("Who").fill("omet")
    page.get_by_role("combobox", name="What").select_option("Passwords")
    expect(rows).to_have_count(1, timeout=1000 * PATIENCE)
    assert rows.inner_text().split("\t")[1:3] == ["Comet", "reset_password"]
    page.get_by_label("Who").fill("nobody like that")
    page.get_by_text("nothing like that").wait_for()


def test_who_holds_the_league_gives_themselves_a_name(lesson: Lesson, race: int) -> None:
    page = lesson.visits["teacher"].open("/league")
    page.get_by_label("What are you called here?").fill("Ms Frizzle")
    page.get_by_role("button", name="Save").click()
    page.get_by_label("What are you called here?").wait_for(state="detached")
    assert ok(lesson.league.owner.get("/api/account"))["name"] == "Ms Frizzle"


@pytest.fixture(scope="module")
def flaws(lesson: Lesson, race: int) -> dict[str, dict[str, Any]]:
    """What axe finds in each theme on narrow German pages that are opened once for both; none sticks out."""
    teacher, pupil, stranger = lesson.visits["teacher"], lesson.visits["Comet"], lesson.arrive("stranger")
    group = ok(lesson.league.owner.get("/api/groups"))[0]["id"]
    for visit in (teacher, pupil):
        visit.look("system", "de")
    found: dict[str, dict[str, Any]] = {theme: {} for theme in THEMES}
    for who, visit, paths in (
        (
            "teacher",
            teacher,
            (
                *("/league", f"/groups/{group}", f"/league/{race}", f"/league/{race}/screen", "/me", "/league/audit"),
                *(f"/groups/{group}/season", f"/league/{race + 1}", f"/league/{race + 1}/screen"),
            ),
        ),
        ("pupil", pupil, ("/league", f"/groups/{group}", f"/league/{race}")),
        ("stranger", stranger, ("/",)),
    ):
        for path in paths:
            page = visit.open(path, width=390, height=844)
            page.wait_for_load_state("networkidle")
            assert visit.overflow() == 0, path
            for theme, there in violations_by_theme(page).items():
                found[theme] |= {f"{who} {path}": there} if there else {}
    stranger.complaints = [one for one in stranger.complaints if "401" not in one]
    return found


@needs_axe
@pytest.mark.parametrize("theme", THEMES)
def test_axe_finds_nothing_serious_and_nothing_sticks_out(flaws: dict[str, dict[str, Any]], theme: str) -> None:
    assert flaws[theme] == {}
