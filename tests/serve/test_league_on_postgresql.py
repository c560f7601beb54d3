"""A league's whole way on PostgreSQL, through its server: in, a race, an entry, its judge, the board, the end."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from leagues import ok, refused, running_league, untrained_run
from postgres_servers import PostgresServer

from racecraft.race.entry_file import pack_entry

pytestmark = pytest.mark.costly
CUP: dict[str, Any] = {"title": "Cup", "track": "oval", "laps": 1, "trials": 2, "max_resets": 1}


def test_a_class_joins_enters_is_judged_and_ranked(postgres: PostgresServer, tmp_path: Path) -> None:
    entries = [pack_entry(untrained_run(tmp_path / "models", f"novice-{seed}", seed=seed)) for seed in (1, 2)]
    with running_league(tmp_path / "runs", "--database", postgres.new_database()) as league:
        teacher = league.organiser("Ms Frizzle")
        group = league.group("5b", teacher)
        code = league.code(group, teacher, uses=2)
        ada, bob = league.join(code, "Ada"), league.join(code, "Bob")
        assert "no such code" in refused(
            league.stranger().post("/api/door/join", json={"code": code, "name": "C"}), 401
        )
        race = ok(teacher.post(f"/api/groups/{group}/races", json=CUP), 201)["id"]
        address = f"/api/league/races/{race}/submissions"

        def enter(client: httpx.Client, data: bytes) -> int:
            return int(ok(client.post(f"{address}?model=novice", content=data), 202)["id"])

        def judged(client: httpx.Client, number: int) -> Any:
            found = ok(client.get(f"{address}/{number}"))
            return found if found["state"] in ("done", "failed", "cancelled") else None

        mine, his = enter(ada, entries[0]), enter(bob, entries[1])
        assert enter(ada, entries[0]) == mine, "the same file again is the same submission"
        assert "already" in refused(bob.post(f"{address}?model=x", content=entries[0]), 409)
        for client, number in ((ada, mine), (bob, his)):
            assert league.console.wait_for(lambda: judged(client, number))["state"] == "done"  # noqa: B023
        refused(bob.get(f"{address}/{mine}"), 404)

        board = ok(ada.get(f"/api/boards/{race}"))
        assert (board["entrants"], board["running"]) == (2, 0)
        assert {row["name"] for row in board["rows"]} == {"Ada", "Bob"}
        assert [row["is_me"] for row in board["rows"] if row["name"] == "Ada"] == [True]
        assert board["race"]["secret"] == ""
        ok(teacher.patch(f"{address}/{his}", json={"model": "polite"}), 204)
        ok(teacher.post(f"{address}/{his}/disqualify", json={"reason": "Too early."}), 204)
        assert [row["name"] for row in ok(bob.get(f"/api/boards/{race}"))["rows"]] == ["Ada"]
        ok(teacher.post(f"{address}/{his}/restore"), 204)

        ok(teacher.patch(f"/api/league/races/{race}", json={"closes": datetime.now(UTC).isoformat()}))
        assert "over" in refused(bob.post(f"{address}?model=late", content=entries[1]), 409)
        told = ok(ada.get(f"/api/boards/{race}/race.json"))
        assert len(told["secret"]) == 64
        assert sorted(row["model"] for row in told["board"]) == ["novice", "polite"]
        assert ada.get(f"/api/boards/{race}/replays/{mine}").status_code == 200
        ok(teacher.post(f"/api/groups/{group}/members/{league.number(bob)}/revoke"), 204)
        refused(bob.get("/api/account"), 401)
