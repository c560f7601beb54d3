"""A league's people: how they come in, what opens the door, who may do what to whom; and what strangers try."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from leagues import RunningLeague, ok, refused, running_league
from running_consoles import PATIENCE, plain_client, running_console

from racecraft.course import find_lesson
from racecraft.errors import ConfigError
from racecraft.serve.people.devices import MOST, Devices
from racecraft.serve.people.names import checked_name, handle_of
from racecraft.serve.problems import NotFound, NotLetIn, TooMany
from racecraft.serve.settings import ServeSettings

pytestmark = pytest.mark.costly


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("league") / "runs") as league:
        yield league


@pytest.fixture(scope="module")
def school(league: RunningLeague) -> dict[str, Any]:
    """A teacher with a class of two, and another teacher with a class of one."""
    teacher, other = league.organiser("Ms Frizzle"), league.organiser("Mr Chips")
    mine, theirs = league.group("5b", teacher), league.group("6a", other)
    code = league.code(mine, teacher)
    return {
        "teacher": teacher,
        "other": other,
        "group": mine,
        "code": code,
        "ada": league.join(code, "Ada"),
        "bob": league.join(code, "Bob"),
        "eve": league.join(league.code(theirs, other), "Eve"),
    }


def test_the_owners_link_is_the_first_admin(league: RunningLeague) -> None:
    me = ok(league.owner.get("/api/door"))["me"]
    assert (me["id"], me["role"]) == (1, "admin")
    assert ok(league.owner.get("/api/console"))["runs"] == str(league.console.runs)
    with league.stranger() as stranger:
        assert ok(stranger.get("/api/door")) == {"is_league": True, "me": None, "provider": None}
        assert "not signed in" in refused(stranger.get("/api/models"), 401)


@pytest.mark.costly
def test_thirty_people_behind_one_address_come_in_by_card(league: RunningLeague) -> None:
    group = league.group("Thirty")
    people = [{"name": f"Racer {number}", "real_name": f"Real {number}"} for number in range(30)]
    cards = ok(league.owner.post(f"/api/groups/{group}/members", json={"people": people}), 201)
    assert all(card["picture"].startswith("data:image/svg") for card in cards)
    began = time.process_time()
    replies: list[int] = []

    def come_in(link: str) -> None:
        with league.stranger() as client:
            replies.append(client.post("/api/door/card", json={"secret": link.split("#")[1]}).status_code)
            replies.append(client.get("/api/models").status_code)

    threads = [threading.Thread(target=come_in, args=(card["link"],)) for card in cards]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert replies == [200] * 60
    assert time.process_time() - began < 60


def test_what_may_hold_a_secret_is_not_compressed(league: RunningLeague) -> None:
    """Its length would tell who listens whether a name that they chose has a sign in common with it (BREACH)."""
    group = league.group("Lengths")
    people = [{"name": f"Length {number}"} for number in range(3)]
    told = [
        league.owner.post(f"/api/groups/{group}/members", json={"people": people}),
        league.owner.post(f"/api/groups/{group}/joining", json={}),
        league.owner.get(f"/api/groups/{group}"),
        league.owner.post("/api/invitations", json={"uses": 1}),
    ]
    assert all(len(reply.content) > 1024 and reply.status_code in (200, 201) for reply in told)
    assert ["content-encoding" in reply.headers for reply in told] == [False] * 4
    assert league.owner.get("/api/tracks").headers["content-encoding"] == "gzip"


def test_a_supervisor_learns_whether_it_works_and_nothing_else(league: RunningLeague) -> None:
    with league.stranger() as stranger:
        found = stranger.get("/api/health")
        assert (found.status_code, found.content) == (204, b"")
        assert stranger.head("/api/health").status_code == 204
        refused(stranger.post("/api/health"), 401)
        assert stranger.get("/api/health", headers={"host": "evil.example"}).status_code == 421
        with sqlite3.connect(league.console.runs / ".racecraft" / "console.db") as database:
            database.execute("ALTER TABLE alembic_version RENAME TO away")
        assert "does not answer" in refused(stranger.get("/api/health"), 503)
        assert stranger.head("/api/health").status_code == 503
        with sqlite3.connect(league.console.runs / ".racecraft" / "console.db") as database:
            database.execute("ALTER TABLE away RENAME TO alembic_version")
        ok(stranger.get("/api/health"), 204)


def test_twenty_wrong_passwords_on_one_account_are_stopped_and_the_others_come_in(league: RunningLeague) -> None:
    owner = league.owner
    assert "10 to 256" in refused(owner.put("/api/account/password", json={"new": "short"}), 422)
    ok(owner.put("/api/account/password", json={"new": "correct horse"}), 204)
    assert "not your" in refused(owner.put("/api/account/password", json={"new": "battery staple", "old": "x"}), 422)
    victim = league.organiser("Victim")
    ok(victim.put("/api/account/password", json={"new": "a long password"}), 204)
    with league.stranger() as stranger:
        for name in ("Victim", "Nobody at all"):
            wrong = {"name": name, "password": "guess"}
            statuses = [stranger.post("/api/door/sign-in", json=wrong).status_code for _ in range(20)]
            assert statuses[:10] == [401] * 10
            assert statuses[-1] == 429
        right = {"name": "victim", "password": "a long password"}
        assert "too many" in refused(stranger.post("/api/door/sign-in", json=right), 429)
        me = ok(stranger.post("/api/door/sign-in", json={"name": "YOU", "password": "correct horse"}))
        assert me["id"] == 1


def test_a_code_has_uses_and_an_end_and_can_be_closed(league: RunningLeague) -> None:
    group = league.group("Codes")
    first = league.code(group, uses=1)
    league.join(f"{first[:4].lower()}-{first[4:]}", "One")
    with league.stranger() as stranger:
        assert "no such code" in refused(stranger.post("/api/door/join", json={"code": first, "name": "Two"}), 401)
        second, third = league.code(group), league.code(group)
        assert "no such code" in refused(stranger.post("/api/door/join", json={"code": second, "name": "Two"}), 401)
        for name in ("one", " O n e", "Оne\u200b", "", "x" * 33, "\u202eevil"):
            reply = stranger.post("/api/door/join", json={"code": third, "name": name})
            assert reply.status_code in (409, 422), (name, reply.text)
        uses = ok(league.owner.get(f"/api/groups/{group}"))["joining"]["uses_left"]
        assert uses == 40, "a name that is refused costs no use"
        ok(league.owner.delete(f"/api/groups/{group}/joining"), 204)
        refused(stranger.post("/api/door/join", json={"code": third, "name": "Two"}), 401)
    assert [member["name"] for member in ok(league.owner.get(f"/api/groups/{group}"))["members"]] == ["you", "One"]


def test_names_that_look_alike_are_one() -> None:
    assert handle_of("Ada") == handle_of("ＡＤＡ") == handle_of("a d-a") == handle_of("Ädà")
    assert handle_of("Ada") != handle_of("Adam")
    assert checked_name("  Zoë   B. ") == "Zoë B."
    assert checked_name("Вера 7") == "Вера 7"
    unseen = [f"Ada{filler}" for filler in "\u115f\u1160\u3164\uffa0"]
    for name in (
        "",
        "  ",
        "a\nb\u0007",
        "\u200bx",
        "x" * 33,
        "...",
        "\ud800",
        "\u3164",
        *unseen,
        "Ad\u0430",
        "\u0391da",
    ):
        with pytest.raises(ConfigError):
            checked_name(name)


def test_a_stolen_card_is_worth_nothing_once_it_is_revoked(league: RunningLeague, school: dict[str, Any]) -> None:
    teacher, group = school["teacher"], school["group"]
    (card,) = ok(teacher.post(f"/api/groups/{group}/members", json={"people": [{"name": "Carl"}]}), 201)
    secret = card["link"].split("#")[1]
    thief = league.stranger()
    ok(thief.post("/api/door/card", json={"secret": secret}))
    token = ok(thief.post("/api/account/tokens", json={}), 201)["secret"]
    ok(teacher.post(f"/api/groups/{group}/members/{card['id']}/revoke"), 204)
    refused(thief.get("/api/models"), 401)
    assert "no longer good" in refused(thief.post("/api/door/card", json={"secret": secret}), 401)
    with league.stranger() as program:
        refused(program.get("/api/models", headers={"authorization": f"Bearer {token}"}), 401)
    (fresh,) = ok(teacher.post(f"/api/groups/{group}/cards", json={"members": [card["id"]]}), 201)["cards"]
    ok(thief.post("/api/door/card", json={"secret": fresh["link"].split("#")[1]}))
    (newest,) = ok(teacher.post(f"/api/groups/{group}/cards", json={"members": [card["id"]]}), 201)["cards"]
    refused(league.stranger().post("/api/door/card", json={"secret": fresh["link"].split("#")[1]}), 401)
    assert newest["link"].startswith(str(league.owner.base_url).rstrip("/") + "/card#")


def test_who_comes_in_anew_ends_the_session_that_was_there(league: RunningLeague, school: dict[str, Any]) -> None:
    people = [{"name": "Fred"}, {"name": "Emil"}]
    cards = ok(school["teacher"].post(f"/api/groups/{school['group']}/members", json={"people": people}), 201)
    browser, other = league.stranger(), league.stranger()
    ok(browser.post("/api/door/card", json={"secret": cards[0]["link"].split("#")[1]}))
    other.cookies.update(browser.cookies)
    assert ok(other.get("/api/account"))["name"] == "Fred"
    ok(browser.post("/api/door/card", json={"secret": cards[1]["link"].split("#")[1]}))
    assert ok(browser.get("/api/account"))["name"] == "Emil"
    refused(other.get("/api/account"), 401)


def test_an_open_stream_ends_with_its_session(league: RunningLeague, school: dict[str, Any]) -> None:
    teacher, group = school["teacher"], school["group"]
    (card,) = ok(teacher.post(f"/api/groups/{group}/members", json={"people": [{"name": "Dora"}]}), 201)
    with league.stranger() as dora:
        let_in = dora.post("/api/door/card", json={"secret": card["link"].split("#")[1]})
        assert {"HttpOnly", "SameSite=strict"} <= set(let_in.headers["set-cookie"].split("; "))
        ok(dora.post("/api/models", json={"name": "hers", "train": False, "track": "oval"}), 201)
        ended = threading.Event()
        began = threading.Event()

        def follow() -> None:
            with dora.stream("GET", "/api/events/hers") as stream:
                for _ in stream.iter_lines():
                    began.set()
            ended.set()

        threading.Thread(target=follow, daemon=True).start()
        assert began.wait(PATIENCE)
        ok(teacher.post(f"/api/groups/{group}/members/{card['id']}/revoke"), 204)
        assert ended.wait(PATIENCE)  # by itself it would never


def test_tokens_do_what_they_were_made_for_and_no_more(league: RunningLeague, school: dict[str, Any]) -> None:
    ada = school["ada"]
    made = ok(ada.post("/api/account/tokens", json={"scopes": ["read"], "days": 1}), 201)
    with plain_client(ada.base_url, headers={"authorization": f"Bearer {made['secret']}"}) as program:
        ok(program.get("/api/models"))
        assert "not for that" in refused(program.post("/api/models", json={}), 403)
        assert "not for that" in refused(program.get("/api/account"), 403)
        assert "not for that" in refused(program.post("/api/account/tokens", json={}), 403)
        assert "not for that" in refused(program.post("/api/league/races/1/submissions"), 403)
        ok(ada.delete(f"/api/account/tokens/{made['id']}"), 204)
        refused(program.get("/api/models"), 401)
    assert made["secret"] not in json.dumps(ok(ada.get("/api/account/tokens")))
    refused(school["bob"].delete(f"/api/account/tokens/{made['id']}"), 404)


def test_a_program_is_let_in_by_a_code_that_is_typed_into_a_browser(
    league: RunningLeague, school: dict[str, Any], tmp_path: Path
) -> None:
    ada, url = school["ada"], str(league.owner.base_url)
    command = [sys.executable, "-m", "racecraft", "login", url, "--json"]
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    environment.pop("RACECRAFT_TOKEN", None)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, env=environment, text=True, **pipes) as program:  # type: ignore[call-overload]
        shown = program.stderr.readline()
        code = shown.split(" let ")[1].split()[0]
        assert f"/me#{code.replace('-', '')} " in shown
        assert "No program shows" in refused(ada.post("/api/account/devices", json={"code": "WRNG-CODE"}), 404)
        ok(ada.post("/api/account/devices", json={"code": code.lower()}), 204)
        told, wrong = program.communicate(timeout=PATIENCE)
    assert (program.returncode, wrong) == (0, "")
    assert json.loads(told)["url"] == url.rstrip("/")
    assert "racecraft login" in [token["title"] for token in ok(ada.get("/api/account/tokens"))]
    with league.stranger() as stranger:
        asked = ok(stranger.post("/api/door/devices"), 201)
        wait = {"secret": asked["secret"]}
        assert ok(stranger.post("/api/door/devices/token", json=wait)) == {"token": ""}
        refused(stranger.post("/api/account/devices", json={"code": asked["code"]}), 401)
        ok(ada.post("/api/account/devices", json={"code": asked["code"]}), 204)
        refused(ada.post("/api/account/devices", json={"code": asked["code"]}), 404)  # it is let in, and by one
        assert ok(stranger.post("/api/door/devices/token", json=wait))["token"].startswith("rc_")
        assert "in time" in refused(stranger.post("/api/door/devices/token", json=wait), 401)
    for _ in range(8):
        refused(ada.post("/api/account/devices", json={"code": "WRNG-CODE"}), 404)
    assert "too many" in refused(ada.post("/api/account/devices", json={"code": "WRNG-CODE"}), 429)


def test_a_program_waits_ten_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    devices = Devices()
    secret, code = devices.begin()
    clock = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: clock + 601)
    with pytest.raises(NotFound):
        devices.confirm(code, 2, session="s")
    with pytest.raises(NotLetIn):
        devices.take(secret)
    begun = [devices.begin() for _ in range(MOST)]
    with pytest.raises(TooMany) as caught:
        devices.begin()
    assert str(caught.value) == "Too many programs wait to be let in."
    assert caught.value.hint == "Try again in ten minutes."
    devices.confirm(begun[0][1], 2, session="s")
    assert devices.take(begun[0][0]) == (2, "s")
    devices.begin()  # in the place of the one that was let in
    with pytest.raises(TooMany):
        devices.begin()
    monkeypatch.setattr(time, "monotonic", lambda: clock + 1202)
    devices.begin()


def test_everybodys_models_are_their_own_and_may_have_the_same_name(
    league: RunningLeague, school: dict[str, Any]
) -> None:
    ada, bob, teacher, other = school["ada"], school["bob"], school["teacher"], school["other"]
    for client, track in ((ada, "oval"), (bob, "hairpin"), (league.owner, "oval")):
        ok(client.post("/api/models", json={"name": "mine", "train": False, "track": track}), 201)
    assert [model["track"] for model in ok(ada.get("/api/models"))] == ["oval"]
    assert ok(bob.get("/api/models/mine"))["track"] == "hairpin"
    ok(ada.patch("/api/models/mine", json={"name": "hers", "tags": ["a"]}))
    refused(bob.get("/api/models/hers"), 404)
    assert ok(bob.get("/api/models/mine"))["tags"] == []
    number = league.number(ada)
    assert ok(teacher.get(f"/api/models?of={number}"))[0]["name"] == "hers"
    assert ok(teacher.get(f"/api/models/hers?of={number}"))["track"] == "oval"
    refused(teacher.patch(f"/api/models/hers?of={number}", json={"tags": ["x"]}), 404)
    refused(teacher.delete(f"/api/models/hers?of={number}"), 404)
    for nosy in (other, bob, school["eve"]):
        refused(nosy.get(f"/api/models/hers?of={number}"), 404)
    copied = ok(
        teacher.post(
            f"/api/groups/{school['group']}/models/copy", json={"member": number, "model": "hers", "name": "help"}
        ),
        201,
    )
    assert copied["name"] == "help"
    listed = ok(teacher.get(f"/api/groups/{school['group']}/models"))
    assert {one["name"]: [model["name"] for model in one["models"]] for one in listed}["Ada"] == ["hers"]
    foreign = {folder: json.loads((folder / "run.json").read_text())["foreign"] for folder in _runs(league)}
    assert all(is_foreign == (folder.parent != league.console.runs) for folder, is_foreign in foreign.items())


def _runs(league: RunningLeague) -> list[Path]:
    return [path.parent for path in league.console.runs.glob("**/run.json") if "trash" not in path.parts]


def test_a_guests_changed_reward_is_foreign_whatever_the_model_was(
    league: RunningLeague, school: dict[str, Any]
) -> None:
    bob = school["bob"]
    ok(bob.post("/api/models", json={"name": "tamed", "train": False, "track": "oval"}), 201)
    path = league.console.runs / ".racecraft" / "people" / str(league.number(bob)) / "tamed" / "run.json"
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, "foreign": False}))  # as an archive without a reward would give it
    gate = "def reward_function(params):\n    return 1.0\n"
    reply = bob.post("/api/models/tamed/train", json={"reward": gate, "until": "64 steps"})
    assert reply.status_code in (202, 422)  # refused where nothing can lock it in
    assert json.loads(path.read_text())["foreign"] is (reply.status_code == 202)


def test_real_names_are_for_organisers_and_names_can_be_moderated(
    league: RunningLeague, school: dict[str, Any]
) -> None:
    teacher, group, ada = school["teacher"], school["group"], school["ada"]
    address = f"/api/groups/{group}/members/{league.number(ada)}"
    ok(teacher.patch(address, json={"real_name": "Augusta King"}), 204)
    assert "Augusta King" in teacher.get(f"/api/groups/{group}").text
    assert "Augusta King" not in school["bob"].get(f"/api/groups/{group}").text
    assert ok(school["bob"].get(f"/api/groups/{group}"))["joining"] is None
    ok(teacher.patch(address, json={"name": "Countess"}), 204)
    assert ok(ada.get("/api/account"))["name"] == "Countess"
    assert "gave you this name" in refused(ada.patch("/api/account", json={"name": "Ada"}), 409)
    ok(ada.put("/api/account/password", json={"new": "a password of hers"}), 204)
    ok(teacher.patch(address, json={"name": "Lady Ada"}), 204)
    assert ok(ada.get("/api/account"))["name"] == "Lady Ada", "a password is no way round it"
    refused(teacher.patch(address, json={"name": "bob"}), 409)
    refused(school["other"].patch(address, json={"name": "Rude"}), 404)


def test_who_has_a_password_is_left_out_when_the_class_gets_new_cards(league: RunningLeague) -> None:
    group = league.group("Class 9")
    people = [{"name": name} for name in ("Nine", "Ten", "Eleven")]
    old = ok(league.owner.post(f"/api/groups/{group}/members", json={"people": people}), 201)
    ten = league.stranger()
    ok(ten.post("/api/door/card", json={"secret": old[1]["link"].split("#")[1]}))
    ok(ten.put("/api/account/password", json={"old": "", "new": "correct horse"}), 204)
    everybody = [card["id"] for card in old]
    printed = ok(league.owner.post(f"/api/groups/{group}/cards", json={"members": everybody}), 201)
    assert [card["name"] for card in printed["cards"]] == ["Nine", "Eleven"]
    assert printed["left_out"] == ["Ten"]
    ok(ten.get("/api/account"))
    for card, status in zip(old, (401, 200, 401), strict=True):  # who is left out keeps the card that there was
        ok(league.stranger().post("/api/door/card", json={"secret": card["link"].split("#")[1]}), status)
    for card in printed["cards"]:
        ok(league.stranger().post("/api/door/card", json={"secret": card["link"].split("#")[1]}))
    alone = refused(league.owner.post(f"/api/groups/{group}/cards", json={"members": everybody[1:2]}), 404)
    assert "Ten has an account of their own, with a password." in alone
    strange = [everybody[0], league.number(league.owner)]  # who is no racer here
    refused(league.owner.post(f"/api/groups/{group}/cards", json={"members": strange}), 404)


def test_an_organiser_cannot_print_a_card_for_who_has_power(league: RunningLeague, school: dict[str, Any]) -> None:
    teacher, group = school["teacher"], school["group"]
    for client in (league.owner, school["other"]):
        ok(client.post("/api/groups/join", json={"code": school["code"]}))
        number = league.number(client)
        assert "account of their own" in refused(
            teacher.post(f"/api/groups/{group}/cards", json={"members": [number]}), 404
        )
        refused(teacher.post(f"/api/groups/{group}/members/{number}/revoke"), 404)
        refused(teacher.patch(f"/api/groups/{group}/members/{number}", json={"name": "Rude"}), 404)
        ok(client.delete(f"/api/groups/{group}/members/{number}"), 204)


def test_who_leaves_takes_everything_along(league: RunningLeague, school: dict[str, Any]) -> None:
    gone = league.join(school["code"], "Gone")
    ok(gone.post("/api/models", json={"name": "last", "train": False, "track": "oval"}), 201)
    folder = league.console.runs / ".racecraft" / "people" / str(league.number(gone))
    assert (folder / "last").is_dir()
    ok(gone.delete("/api/account"), 204)
    refused(gone.get("/api/models"), 401)
    assert not folder.exists()
    assert "Gone" not in school["teacher"].get(f"/api/groups/{school['group']}").text
    league.join(school["code"], "Gone")
    refused(league.owner.request("DELETE", "/api/account", json={"password": "correct horse"}), 409)


@pytest.mark.costly
def test_one_person_alone_notices_nothing(league: RunningLeague, tmp_path: Path) -> None:
    with (
        running_console(tmp_path / "runs") as console,
        plain_client(console.client.base_url) as stranger,
    ):
        assert stranger.get("/api/door").status_code == 401
        assert "not known" in refused(stranger.get("/api/models"), 401)
        for path in ("/api/door", "/api/account", "/api/groups", "/api/league/races", "/api/boards/1"):
            assert "one person's" in refused(console.client.get(path), 404)
        assert "one person's" in refused(console.client.post("/api/invitations", json={}), 404)
        assert ok(console.client.get("/api/models?of=7")) == []


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"host": "0.0.0.0"}, "only on 127.0.0.1"),
        ({"host": "0.0.0.0", "league": True}, "unencrypted"),
        ({"address": "http://school.example:8321", "league": True}, "unencrypted"),
        ({"address": "ftp://x", "league": True}, "allowed are"),
        ({"address": "https://x/path", "league": True}, "allowed are"),
        ({"host": "0.0.0.0", "league": True, "plain_http": True}, ""),
        ({"host": "0.0.0.0", "league": True, "address": "https://school.example"}, "beside its proxy"),
        ({"address": "https://x", "league": True, "trusted_proxies": ("proxy.example",)}, "addresses and networks"),
        ({"trusted_proxies": ("127.0.0.1",)}, "for a league"),
        ({"address": "https://x", "league": True, "certificate": Path("x.pem")}, "needs its key"),
        ({"league": True, "certificate": Path("x.pem"), "key": Path("y.pem")}, "for a name"),
        ({"host": "0.0.0.0", "league": True, "address": "https://x", "trusted_proxies": ("10.0.0.0/24",)}, ""),
        (
            {
                "host": "0.0.0.0",
                "league": True,
                "address": "https://x",
                "certificate": Path("x.pem"),
                "key": Path("y.pem"),
            },
            "",
        ),
        ({"league": True, "address": "https://school.example"}, ""),
    ],
)
def test_what_would_show_secrets_is_refused_unless_said_twice(
    tmp_path: Path, settings: dict[str, Any], text: str
) -> None:
    if text:
        with pytest.raises(ConfigError, match=text):
            ServeSettings(runs=tmp_path, **settings)
    else:
        assert ServeSettings(runs=tmp_path, **settings).league


def test_a_teacher_sees_how_far_the_class_is_and_nobody_else(league: RunningLeague) -> None:
    teacher = league.organiser("Ms Lovelace")
    group = league.group("8b", teacher)
    ada = league.join(league.code(group, teacher), "Ada of 8b")
    answers = [question.answer for question in find_lesson(1).facts.questions]
    ok(ada.put("/api/lessons/1/progress", json={"is_read": True, "answers": answers}))
    ok(ada.put("/api/lessons/2/progress", json={"is_read": True}))
    (row,) = ok(teacher.get(f"/api/groups/{group}/lessons"))
    assert row["name"] == "Ada of 8b"
    assert {number: (one["is_read"], one["quiz"]) for number, one in row["lessons"].items()} == {
        "1": (True, 1.0),
        "2": (True, None),
    }
    assert ada.get(f"/api/groups/{group}/lessons").status_code == 404
    cards = ok(ada.get("/api/lessons"))
    assert [card["progress"]["is_read"] for card in cards] == [True, True] + [False] * 10
    assert not any(card["progress"]["is_read"] for card in ok(teacher.get("/api/lessons")))
    assert ada.put("/api/lessons/1/progress", json={"answers": [0]}).status_code == 409
    assert ada.get("/api/lessons/13").status_code == 404
    assert ada.get("/api/lessons/1/pictures/..%2F..%2Fanswers").status_code in (404, 422)
    assert ok(ada.get("/api/account/data"))["lessons"][0]["lesson"] == 1
    ok(ada.delete("/api/account"), 204)
    assert ok(teacher.get(f"/api/groups/{group}/lessons")) == []
