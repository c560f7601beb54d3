"""Who did what with power is written down, and only admins read it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from leagues import RunningLeague, ok, refused, running_league

from racecraft.serve.audit.audit import Audit
from racecraft.serve.people.keys import Keys
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Reset, now

pytestmark = pytest.mark.costly


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("audit") / "runs") as league:
        yield league


def lines(league: RunningLeague, **query: int) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = ok(league.owner.get("/api/audit", params=query))
    return found


def test_what_is_done_with_power_is_written_down(league: RunningLeague) -> None:
    teacher, other = league.organiser("Ms Frizzle"), league.organiser("Mr Chips")
    group = league.group("5b", teacher)
    people = [{"name": "Ada", "real_name": "Augusta King"}]
    ada = ok(teacher.post(f"/api/groups/{group}/members", json={"people": people}), 201)[0]["id"]
    ok(teacher.post(f"/api/groups/{group}/cards", json={"members": [ada]}), 201)
    ok(teacher.put("/api/account/password", json={"new": "correct horse battery"}), 204)
    refused(other.post(f"/api/groups/{group}/members/{ada}/revoke"), 404)
    refused(teacher.post(f"/api/groups/{group}/cards", json={"members": "all"}), 422)
    ok(teacher.post(f"/api/groups/{group}/members/{ada}/revoke"), 204)
    assert [(line["name"], line["what"], line["target"], line["details"]) for line in lines(league, count=7)] == [
        ("Ms Frizzle", "revoke_member", f"/api/groups/{group}/members/{ada}/revoke", {}),
        ("Ms Frizzle", "set_password", "/api/account/password", {}),
        ("Ms Frizzle", "print_cards", f"/api/groups/{group}/cards", {"members": [ada]}),
        ("Ms Frizzle", "add_members", f"/api/groups/{group}/members", {}),
        ("Ms Frizzle", "create_group", "/api/groups", {"title": "5b"}),
        ("Mr Chips", "join", "/api/door/join", {"address": "127.0.0.1"}),
        ("you", "invite_organisers", "/api/invitations", {"uses": 1}),
    ]
    told = ok(league.owner.get("/api/audit"))
    assert all(line["is_done"] for line in told)
    assert not any(secret in json.dumps(told) for secret in ("Augusta", "correct horse"))
    assert [line["id"] for line in lines(league, before=told[1]["id"])] == [line["id"] for line in told[2:]]
    assert {deed["what"] for deed in teacher.get("/api/account/data").json()["deeds"]} >= {"print_cards"}
    refused(teacher.get("/api/audit"), 404)


def test_who_came_in_and_who_did_not_is_written_down(league: RunningLeague) -> None:
    miss, group = league.organiser("Miss Honey"), league.group("Doors")
    password = {"password": "a long password"}
    ok(miss.put("/api/account/password", json={"new": "a long password"}), 204)
    (card,) = ok(league.owner.post(f"/api/groups/{group}/members", json={"people": [{"name": "Kit"}]}), 201)
    with league.stranger() as stranger:
        refused(stranger.post("/api/door/sign-in", json={"name": "miss honey", "password": "hunter2 hunter2"}), 401)
        refused(stranger.post("/api/door/sign-in", json={"name": "a long password", **password}), 401)
        refused(stranger.post("/api/door/card", json={"secret": "hunter2"}), 401)
        refused(stranger.post("/api/door/join", json={"code": "hunter2", "name": "hunter2"}), 401)
        ok(stranger.post("/api/door/sign-in", json={"name": "Miss Honey", **password}))
        ok(stranger.post("/api/door/sign-out"), 204)
        ok(stranger.post("/api/door/card", json={"secret": card["link"].split("#")[1]}))
    told = [(line["name"], line["what"]) for line in lines(league, count=8)]
    assert told == [
        ("Kit", "show_card"),
        ("Miss Honey", "sign_out"),
        ("Miss Honey", "sign_in"),
        ("", "join_failed"),
        ("", "show_card_failed"),
        ("", "sign_in_failed"),
        ("Miss Honey", "sign_in_failed"),
        ("you", "add_members"),
    ]
    everything = json.dumps(ok(league.owner.get("/api/audit")))
    assert "hunter2" not in everything, "people type passwords into the wrong field"
    assert "a long password" not in everything
    failed = ok(league.owner.get("/api/audit", params={"what": "failed", "name": "honey"}))
    assert [(line["name"], line["what"], line["details"]) for line in failed] == [
        ("Miss Honey", "sign_in_failed", {"address": "127.0.0.1"})
    ]
    assert ok(league.owner.get("/api/audit", params={"what": "%"})) == []
    assert "sign_in_failed" in [deed["what"] for deed in ok(miss.get("/api/account/data"))["deeds"]]


def test_a_link_for_a_new_password_works_once_and_ends_all_that_was(league: RunningLeague) -> None:
    miss = league.organiser("Miss Trunchbull")
    ok(miss.put("/api/account/password", json={"new": "the first password"}), 204)
    token = ok(miss.post("/api/account/tokens", json={}), 201)["secret"]
    made = ok(league.owner.post("/api/resets", json={"person": "miss trunchbull"}), 201)
    address, _, secret = made["link"].partition("/reset#")
    assert (made["name"], address) == ("Miss Trunchbull", str(league.owner.base_url).rstrip("/"))
    assert secret not in json.dumps(ok(league.owner.get("/api/audit")))
    fresh = {"secret": secret, "password": "the second password"}
    with league.stranger() as stranger:
        short = refused(stranger.post("/api/door/reset", json={"secret": secret, "password": "short"}), 422)
        assert "10 to 256" in short
        ok(miss.get("/api/account"))
        assert ok(stranger.post("/api/door/reset", json=fresh))["name"] == "Miss Trunchbull"
        assert len(ok(stranger.get("/api/account/sessions"))) == 1
        assert "no longer good" in refused(stranger.post("/api/door/reset", json=fresh), 401)
    refused(miss.get("/api/account"), 401)
    with league.stranger() as stranger:
        refused(stranger.get("/api/models", headers={"authorization": f"Bearer {token}"}), 401)
        refused(stranger.post("/api/door/sign-in", json={"name": made["name"], "password": "the first password"}), 401)
        ok(stranger.post("/api/door/sign-in", json={"name": made["name"], "password": "the second password"}))
    assert "nobody called" in refused(league.owner.post("/api/resets", json={"person": "Nobody"}), 404)


def test_a_link_for_a_new_password_gets_old_and_only_the_latest_is_good(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    keys = Keys(database)
    first, second = keys.make_reset(OWNER), keys.make_reset(OWNER)
    assert (keys.reset_user(first), keys.reset_user(second)) == (None, OWNER)
    with database.transaction() as session:
        session.execute(sa.update(Reset).values(expires=now() - timedelta(seconds=1)))
    assert (keys.reset_user(second), keys.use_reset(second, "hash")) == (None, None)
    keys.revoke(OWNER)
    with database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Reset)) == 0
    database.close()


def test_whoever_has_the_servers_folder_makes_such_a_link(league: RunningLeague) -> None:
    command = [sys.executable, "-m", "racecraft", "league", "reset", "you", "--runs", str(league.console.runs)]
    made = subprocess.run([*command, "--address", "https://x/", "--json"], capture_output=True, text=True, check=True)
    link = json.loads(made.stdout)["link"]
    assert link.startswith("https://x/reset#")
    (line,) = lines(league, count=1)
    assert (line["what"], line["target"], line["details"]) == (
        "make_reset",
        "racecraft league reset",
        {"person": "you"},
    )


def test_the_log_is_read_beside_a_running_server(league: RunningLeague) -> None:
    ok(league.owner.post("/api/invitations", json={"uses": 3}), 201)
    command = [sys.executable, "-m", "racecraft", "league", "audit", "--runs", str(league.console.runs)]
    shown = subprocess.run([*command, "--json"], capture_output=True, text=True, check=True)
    newest = lines(league, count=1)[0]
    assert json.loads(shown.stdout)["lines"][-1]["id"] == newest["id"]
    told = subprocess.run([*command, "--count", "1"], capture_output=True, text=True, check=True).stdout
    assert told.endswith("you (1)  invite_organisers  /api/invitations  uses=3\n")


def test_a_deed_that_a_killed_server_left_is_told_as_unknown(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    audit = Audit(database)
    audit.begin(1, "revoke_member", "/api/groups/1/members/2/revoke", {"reason": "lost", "password": "x"})
    (line,) = audit.latest(5)
    assert (line.is_done, line.details) == (False, {"reason": "lost"})
    database.close()
