"""Who did what with power is written down, and only admins read it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from leagues import RunningLeague, ok, refused, running_league

from racecraft.serve.audit.audit import Audit
from racecraft.serve.store.database import Database


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
    assert [(line["name"], line["what"], line["target"], line["details"]) for line in lines(league, count=6)] == [
        ("Ms Frizzle", "revoke_member", f"/api/groups/{group}/members/{ada}/revoke", {}),
        ("Ms Frizzle", "set_password", "/api/account/password", {}),
        ("Ms Frizzle", "print_cards", f"/api/groups/{group}/cards", {"members": [ada]}),
        ("Ms Frizzle", "add_members", f"/api/groups/{group}/members", {}),
        ("Ms Frizzle", "create_group", "/api/groups", {"title": "5b"}),
        ("you", "invite_organisers", "/api/invitations", {"uses": 1}),
    ]
    told = ok(league.owner.get("/api/audit"))
    assert all(line["is_done"] for line in told)
    assert not any(secret in json.dumps(told) for secret in ("Augusta", "correct horse"))
    assert [line["id"] for line in lines(league, before=told[1]["id"])] == [line["id"] for line in told[2:]]
    assert {deed["what"] for deed in teacher.get("/api/account/data").json()["deeds"]} >= {"print_cards"}
    refused(teacher.get("/api/audit"), 404)


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
