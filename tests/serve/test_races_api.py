"""Races over HTTP: made, entered, decided by real jobs, told when they are over; and what strangers try."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from running_consoles import RunningConsole

from racecraft.judging.verification import published
from racecraft.race.announcement import commitment_of, seed_of
from racecraft.replay import read_replay, verify
from racecraft.serve.races.schemas import RuleSet
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.vehicle import PRESETS

pytestmark = pytest.mark.costly


def refused(reply: httpx.Response, status: int) -> dict[str, Any]:
    assert reply.status_code == status, reply.text
    assert set(reply.json()) == {"error"}
    return dict(reply.json()["error"])


def make(console: RunningConsole, **settings: Any) -> dict[str, Any]:
    reply = console.client.post("/api/races", json={"title": "Sunday cup", "track": "oval", **settings})
    assert reply.status_code == 201, reply.text
    return dict(reply.json())


def test_a_race_from_beginning_to_end(console: RunningConsole, tmp_path: Path) -> None:
    client = console.client
    for name in ("ada", "bob"):
        console.create(name=name, track="oval", until="3000 steps", seed=len(name) + ord(name[0]))
    for job in client.get("/api/jobs").json():
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    road = {"kind": "object-avoidance", "objects": 2}
    race = make(console, laps=1, offtrack_penalty=1.0, max_resets=3, trials=3, **road)
    assert (race["state"], race["is_withheld"], race["secret"], race["seed"]) == ("open", True, "", None)
    entered = client.post(f"/api/races/{race['id']}/entries", json={"models": ["ada", "bob", "ada"]})
    assert entered.status_code == 202, entered.text
    assert len(entered.json()["undecided"]) == 2

    def decided() -> Any:
        found = client.get(f"/api/races/{race['id']}").json()
        assert not any(one["state"] == "failed" for one in found["undecided"]), found
        return found if not found["undecided"] else None

    found = console.wait_for(decided)
    assert {row["model"] for row in found["standings"]} == {"ada", "bob"}
    scores = [row["score"] for row in found["standings"] if row["score"] is not None]
    assert scores == sorted(scores)
    for row in found["standings"]:
        assert row["is_verified"] is True
        assert len(row["scores"]) == len(row["lap_times"]) == 3
        assert (row["has_replay"], row["video"]) == (False, None)
        for file in ("video", "replay"):
            refused(client.get(f"/api/races/{race['id']}/entries/{row['entry']}/{file}"), 409)
    entries = ",".join(str(row["entry"]) for row in found["standings"])
    refused(client.get(f"/api/races/{race['id']}/replay", params={"entries": entries}), 409)
    # while it is open neither the secret, nor the seed, nor a place is to be had anywhere
    open_race = client.get(f"/api/races/{race['id']}/race.json").json()
    assert (open_race["commitment"], open_race["secret"]) == (race["commitment"], "")
    addresses = ["/api/races", f"/api/races/{race['id']}", f"/api/races/{race['id']}/race.json", "/api/jobs"]
    for name in ("ada", "bob"):
        addresses += [f"/api/models/{name}", f"/api/models/{name}/evaluations"]
        assert not list((console.runs / name).glob("evaluation-*"))  # nor as a ghost, a report or a download
    texts = [client.get(address).text for address in addresses]
    for job in client.get("/api/jobs").json():
        if job["kind"] == "race":
            assert "files" not in job["result"]
    assert "model:" not in client.get("/api/ghosts", params={"track": "oval"}).text

    # over: the secret is told, and everything can be looked at and checked
    closed = client.patch(f"/api/races/{race['id']}", json={"closes": datetime.now(UTC).isoformat()}).json()
    secret = closed["secret"]
    assert (closed["state"], closed["is_withheld"], len(secret)) == ("closed", False, 64)
    assert race["commitment"] == commitment_of(open_race["document"], bytes.fromhex(secret))
    for text in texts:
        assert secret not in text
        assert str(seed_of(bytes.fromhex(secret))) not in text
    told = client.get(f"/api/races/{race['id']}/race.json")
    (tmp_path / "race.json").write_bytes(told.content)
    driven = []
    for row in closed["standings"]:
        assert row["has_replay"]
        assert client.get(row["video"]).headers["content-type"] == "video/mp4"
        content = client.get(f"/api/races/{race['id']}/entries/{row['entry']}/replay").content
        (tmp_path / "entry.replay").write_bytes(content)
        replay = read_replay(tmp_path / "entry.replay")
        assert verify(replay, race=published(str(tmp_path / "race.json")), num_threads=1).is_genuine
        assert verify(replay, race=race["commitment"], num_threads=1).is_genuine
        assert len(replay.cars) == 3
        assert [list(car.lap_times) for car in replay.cars] == row["lap_times"]
        assert replay.conditions.vehicle == PRESETS["v5"]
        driven.append(replay.cars[1].recording)
    film = client.get(f"/api/races/{race['id']}/replay", params={"entries": entries, "trial": 1}).json()
    assert film["trial"] == 1
    assert (film["is_reversed"], [sector["number"] for sector in film["sectors"]]) == (False, [1, 2])
    assert [car["model"] for car in film["cars"]] == [row["model"] for row in closed["standings"]]
    assert film["objects"] == []  # everybody met their own
    for car, recording in zip(film["cars"], driven, strict=True):
        there = [(one["x"], one["y"], one["heading"]) for one in car["objects"]]
        assert [one["kind"] for one in car["objects"]] == ["box", "box"]
        assert there == [tuple([pytest.approx(value, abs=6e-4)] for value in box[:3]) for box in recording.objects(0)]
    begin = [car["trace"][0] for car in film["cars"]]
    assert begin[0] == begin[1]  # everybody from the same place
    other = client.get(f"/api/races/{race['id']}/replay", params={"entries": entries, "trial": 2}).json()
    assert other["cars"][0]["trace"][0] != begin[0]
    for car in film["cars"]:
        assert len(car["trace"]) > 10
    refused(client.post(f"/api/races/{race['id']}/entries", json={"models": ["ada"]}), 409)
    for closes in (None, (datetime.now(UTC) + timedelta(days=1)).isoformat()):
        again = refused(client.patch(f"/api/races/{race['id']}", json={"closes": closes}), 409)
        assert "everybody knows its secret" in again["message"]
    assert client.patch(f"/api/races/{race['id']}", json={"title": "Last cup"}).json()["title"] == "Last cup"

    # a model's new name is the standings', too; its files are found again
    client.patch("/api/models/ada", json={"name": "ada-lovelace"})
    found = client.get(f"/api/races/{race['id']}").json()
    renamed = next(row for row in found["standings"] if row["model"] == "ada-lovelace")
    assert renamed["video"]
    own = client.get(f"/api/races/{race['id']}/entries/{renamed['entry']}/replay").content
    file = next(path for path in console.runs.rglob("*.replay") if path.read_bytes() == own)
    file.write_bytes(own[:100])  # damaged; the others are shown
    film = client.get(f"/api/races/{race['id']}/replay", params={"entries": entries}).json()
    assert film["missing"] == [{"entry": renamed["entry"], "model": "ada-lovelace"}]
    assert [car["entry"] for car in film["cars"]] == [row["entry"] for row in found["standings"] if row != renamed]
    refused(client.get(f"/api/races/{race['id']}/replay", params={"entries": "99999"}), 404)
    assert client.delete(f"/api/races/{race['id']}/entries/{renamed['entry']}").status_code == 204
    refused(client.delete(f"/api/races/{race['id']}/entries/{renamed['entry']}"), 404)
    assert len(client.get(f"/api/races/{race['id']}").json()["standings"]) == 1


def test_a_race_is_changed_closed_deleted_and_brought_back(console: RunningConsole) -> None:
    client = console.client
    moment = datetime.now(UTC)
    race = make(console, opens=(moment + timedelta(days=1)).isoformat())
    address = f"/api/races/{race['id']}"
    assert race["state"] == "upcoming"
    refused(client.patch(address, json={"closes": moment.isoformat()}), 422)
    race = make(console, title="  Night cup  ", description=" late ", seed=3)
    address = f"/api/races/{race['id']}"
    assert (race["title"], race["description"]) == ("Night cup", "late")
    changed = client.patch(address, json={"closes": datetime.now(UTC).isoformat(), "title": "Day cup"}).json()
    assert (changed["state"], changed["title"]) == ("closed", "Day cup")
    assert client.patch(address, json={"closes": None}).json()["state"] == "open"
    assert client.delete(address).status_code == 204
    refused(client.get(address), 404)
    assert race["id"] not in [one["id"] for one in client.get("/api/races").json()]
    assert client.post(f"{address}/restore").json()["title"] == "Day cup"
    refused(client.post(f"{address}/restore"), 404)


def test_entries_that_cannot_be(console: RunningConsole) -> None:
    client = console.client
    race = make(console, seed=1)
    entries = f"/api/races/{race['id']}/entries"
    refused(client.post(entries, json={"models": ["nobody"]}), 404)
    refused(client.post(entries, json={"models": ["../../etc"]}), 422)
    refused(client.post(entries, json={"models": []}), 422)
    refused(client.post(entries, json={"models": ["x"] * 51}), 422)
    console.create(name="untrained", track="oval", train=False)
    assert "no checkpoint" in refused(client.post(entries, json={"models": ["untrained"]}), 409)["message"]
    refused(client.post("/api/races/99999/entries", json={"models": ["untrained"]}), 404)
    refused(client.get("/api/races/99999999999999999999"), 422)
    refused(client.get(f"/api/races/{race['id']}/replay", params={"entries": "1;2"}), 422)
    refused(client.get(f"/api/races/{race['id']}/replay", params={"entries": ",".join("123456789")}), 404)
    many = ",".join(map(str, range(13)))
    refused(client.get(f"/api/races/{race['id']}/replay", params={"entries": many}), 422)


@pytest.mark.parametrize(
    "settings",
    [
        {"title": ""},
        {"title": "   "},
        {"title": "x" * 101},
        {"description": "x" * 501},
        {"track": "nowhere"},
        {"track": "/etc/passwd"},
        {"laps": 0},
        {"laps": 10**9},
        {"ranking": "worst"},
        {"ranking": "average", "laps": 2, "minimum_laps": 3},
        {"kind": "drag"},
        {"offtrack_penalty": -1},
        {"objects": 1000, "kind": "object-avoidance"},
        {"seed": -1},
        {"rules": "none"},
        {"randomize": "../../x.json"},
        {"time_limit": 1e9},
        {"bot_speed": 0.4},
        {"kind": "object-avoidance", "lane_changes": True},
        {"kind": "head-to-bot", "parked_cars": True},
        {"positions": [[0.5, 1]]},
        {"closes": "2001-01-01T00:00:00Z"},
        {"opens": "2001-01-01T00:00:00"},
        {"opens": "soon"},
        {"vehicle": "../x"},
        {"vehicle": ""},
        {"trials": 0},
        {"trials": 100},
        {"secret": "00" * 32},
        {"commitment": "00" * 32},
        {"owner_id": 2},
    ],
)
def test_races_that_cannot_be(console: RunningConsole, settings: dict[str, Any]) -> None:
    reply = console.client.post("/api/races", json={"title": "Cup", "track": "oval", **settings})
    assert reply.status_code in (404, 422)
    refused(reply, reply.status_code)


@pytest.mark.parametrize(("kind", "group"), [("object-avoidance", "obstacles"), ("head-to-bot", "bots")])
def test_races_with_objects(console: RunningConsole, kind: str, group: str) -> None:
    own = {"bot_speed": 0.4, "lane_changes": True} if group == "bots" else {"parked_cars": True}
    race = make(console, kind=kind, objects=2, placement="random", **own)
    there = race["objects"][group]
    assert (there["count"], there["placement"]) == (2, "random")
    if group == "bots":
        assert (there["speed"], there["changes_lane"]) == (0.4, True)
    else:
        assert there["kind"] == "car"
    placed = make(console, kind=kind, positions=[[0.2, 1], [0.5, -1], [0.8, 1]], **own)["objects"][group]
    assert (placed["count"], placed["placement"], placed["positions"][1]) == (3, "fixed", [0.5, -1])


def test_a_kept_checkpoint_is_what_drives(console: RunningConsole) -> None:
    client = console.client
    name = console.create(track="oval", until="1000 steps", seed=1)
    (job,) = client.get("/api/jobs", params={"run": name}).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    (first, *_) = client.get(f"/api/models/{name}").json()["checkpoints"]
    race = make(console, laps=1, trials=1, max_resets=0, seed=1, time_limit=5)
    entries = f"/api/races/{race['id']}/entries"
    assert str(first["step"]) in refused(client.post(entries, json={"models": [name], "checkpoint": 1}), 409)["message"]
    reply = client.post(entries, json={"models": [name], "checkpoint": first["step"]})
    assert reply.status_code == 202, reply.text
    (drive,) = [one for one in client.get("/api/jobs", params={"run": name}).json() if one["kind"] == "race"]
    assert console.wait_for(console.job_ended(drive["id"]))["result"]["step"] == first["step"]


def test_ghosts_accompany_the_film_of_an_entry(console: RunningConsole) -> None:
    """They are in the video and beside the cars of the trial that it shows, and change nothing that was driven."""
    client = console.client
    for name, seed in (("gina", 1), ("hank", 2)):
        console.create(name=name, track="oval", until="512 steps", seed=seed)
        (job,) = client.get("/api/jobs", params={"run": name}).json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    asked = {"laps": 1, "num_trials": 1, "seed": 9, "rules": "first_lap"}
    job = client.post("/api/models/hank/evaluations", json=asked).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    (card,) = client.get("/api/contests/ghosts?track=oval").json()
    before = {"model": "hank", "evaluation": card["evaluation"]}

    race = make(console, laps=1, trials=2, max_resets=0, seed=1, time_limit=8)
    entries = f"/api/races/{race['id']}/entries"
    replay = console.runs / "hank" / f"evaluation-{card['evaluation']}" / "evaluation.replay"
    ghosts = [before, {"model": "hank", "checkpoint": "last"}, {"model": "gina", "checkpoint": "best"}, "best-lap"]
    for beside in ([], ghosts):
        reply = client.post(entries, json={"models": ["gina"], "ghosts": beside})
        assert reply.status_code == 202, reply.text
    found = sorted(one["entry"] for one in reply.json()["undecided"] + reply.json()["standings"])
    jobs = [one for one in client.get("/api/jobs", params={"run": "gina"}).json() if one["kind"] == "race"]
    kept = replay.read_bytes()
    replay.unlink()  # as when it is removed before the entry is driven
    try:
        driven = [console.wait_for(console.job_ended(job["id"])) for job in jobs]
    finally:
        replay.write_bytes(kept)
    assert [job["state"] for job in driven] == ["done", "done"], driven
    (plain, haunted) = sorted(driven, key=lambda job: job["created"])
    folders = [console.runs / ".racecraft" / "races" / job["id"] for job in (plain, haunted)]
    assert (folders[1] / "ghosts" / "0.replay").read_bytes() == kept
    assert plain["result"]["lap_seconds"] == haunted["result"]["lap_seconds"]  # who drives does not see them
    assert haunted["result"]["verification"]["is_genuine"]
    films = [(folder / "video.mp4").read_bytes() for folder in folders]
    assert films[0] != films[1]
    shown = json.loads((folders[1] / "ghosts.json").read_bytes())["trial"]
    for entry, trial, names in ((0, shown, []), (1, 1 - shown, []), (1, shown, ["hank", "hank@last"])):
        told = client.get(f"/api/races/{race['id']}/replay", params={"entries": found[entry], "trial": trial}).json()
        assert [ghost["name"] for ghost in told["ghosts"]][:2] == names
    (car,), (_, _, itself, *_) = told["cars"], told["ghosts"]
    assert itself["name"] == "gina"
    assert [place for place in itself["trace"] if place] == car["trace"]  # the same model in the same trial
    for ghost, status in (({"model": "nobody"}, 404), ({"heat": "0" * 16}, 404), ("@8192", 422)):
        refused(client.post(entries, json={"models": ["gina"], "ghosts": [ghost]}), status)
    back = make(console, seed=1, direction="reverse")
    reply = client.post(f"/api/races/{back['id']}/entries", json={"models": ["gina"], "ghosts": [before]})
    assert "in another direction or of another form" in refused(reply, 422)["message"]
    assert client.get(f"/api/races/{back['id']}").json()["undecided"] == []


def test_a_race_is_announced_by_all_that_was_asked(console: RunningConsole) -> None:
    sets = {one["name"]: one for one in console.client.get("/api/races/rules").json()}
    assert list(sets) == ["drfc", "worker", "droa", "live"]
    race = make(console, rules="live", randomize="strong", offtrack_penalty=1.5, direction="reverse")
    assert (race["randomize"], race["laps"], race["rules"]["direction"]) == ("strong", 15, "reverse")
    document = console.client.get(f"/api/races/{race['id']}/race.json").json()["document"]
    told = {name: document["rules"][name] for name in RuleSet.model_fields if name != "name"}
    assert told == {name: value for name, value in (sets["live"] | {"offtrack_penalty": 1.5}).items() if name != "name"}
    assert document["randomize"]["friction"] == list(RANDOMIZATIONS["strong"].friction)
    assert make(console)["rules"]["time_limit"] == 0.0
    assert make(console, rules="live", time_limit=60)["rules"]["time_limit"] == 60.0
