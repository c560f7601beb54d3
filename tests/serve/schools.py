"""A league in which one racer has one of everything that there is."""

from __future__ import annotations

from typing import Any

from leagues import RunningLeague, ok, untrained_run

from racecraft.race.entry_file import pack_entry

RACE: dict[str, Any] = {"title": "adas-race", "track": "oval", "laps": 1, "trials": 1, "max_resets": 0}
"""Without resets, of which one who has learned nothing needs a hundred, all of them filmed."""


class School:
    """A league in which Ada has one of everything."""

    def __init__(self, league: RunningLeague) -> None:
        self.league = league
        teacher, other = league.organiser("Teacher"), league.organiser("Other")
        group = league.group("adas-class", teacher)
        code = league.code(group, teacher)
        ada, bob = league.join(code, "Ada"), league.join(code, "Bob")
        elsewhere = league.group("Elsewhere", other)
        code = league.code(elsewhere, other)
        eve = league.join(code, "Eve")
        ok(ada.post("/api/groups/join", json={"code": code}))  # she races there, too
        self.people = {"owner": league.owner, "teacher": teacher, "other": other, "ada": ada, "bob": bob, "eve": eve}
        number = league.number(ada)
        home = league.console.runs / ".racecraft" / "people" / str(number)
        ok(ada.get("/api/models"))
        run = untrained_run(home, "adas-model")
        (home / ".racecraft" / "tracks" / "adas-track.npy").write_bytes(ada.get("/api/tracks/oval/route.npy").content)
        cup = ok(teacher.post(f"/api/groups/{group}/races", json=RACE), 201)["id"]
        data = pack_entry(run)
        submission = ok(ada.post(f"/api/league/races/{cup}/submissions?model=adas-model", content=data), 202)["id"]
        token = ok(ada.post("/api/account/tokens", json={"title": "adas-token"}), 201)["id"]
        race = ok(ada.post("/api/races", json=RACE), 201)["id"]
        heat = {"models": [{"model": "adas-model"}] * 2, "track": "oval", "max_resets": 0}
        entry = ok(ada.post(f"/api/races/{race}/entries", json={"models": ["adas-model"]}), 202)["undecided"]
        said = {"member": number, "model": "adas-model", "text": "Look at the hairpin."}
        (comment,) = ok(teacher.post(f"/api/groups/{group}/comments", json=said), 201)
        self.objects = {
            "comment_id": comment["id"],
            "lesson": 4,
            "picture": "lake",
            "track": "adas-track",
            "name": "adas-model",
            "starter": "quick",
            "drive_id": ok(ada.post("/api/drives", json={"track": "adas-track"}), 201)["id"],
            "key": "model:adas-model",
            "worker": "0" * 16,
            "path": "metrics/x.json",
            "stamp": "20260101000000",
            "target": "car",
            "tuning": "0" * 16,
            "race_id": race,
            "entry_id": entry[0]["entry"],
            "contest": ok(ada.post("/api/contests/heats", json=heat), 202)["id"],
            "job_id": ok(ada.get("/api/jobs"))[0]["id"],
            "token_id": token,
            "session_id": ok(ada.get("/api/account/sessions"))[0]["id"],
            "group_id": group,
            "elsewhere": elsewhere,
            "member": number,
            "cup": cup,
            "submission_id": submission,
            "duel": 0,
            "heat": 0,
        }


def label_of(operation: str) -> str:
    """As in the table, where a name says what kind of thing is named."""
    for room, name, ours in (
        ("/api/tracks/", "{name}", "{track}"),
        ("/api/league/", "{race_id}", "{cup}"),
        ("/api/boards/", "{race_id}", "{cup}"),
    ):
        if room in operation:
            operation = operation.replace(name, ours)
    return operation
