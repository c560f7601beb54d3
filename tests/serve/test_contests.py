"""Heats and ladders over HTTP: two untrained cars on one road, rated and filmed, and what is refused."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_consoles import full
from running_consoles import RunningConsole

from racecraft.errors import ConfigError
from racecraft.film.ghost import Ghost
from racecraft.race.rules import RaceRules
from racecraft.replay import read_replay, verify
from racecraft.serve.contests.terms import terms_of
from racecraft.serve.races import ghosts
from racecraft.sim.objects import Bots, Objects, Obstacles
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.track import load_track

pytestmark = pytest.mark.costly


@pytest.fixture(scope="module")
def cars(console: RunningConsole) -> list[dict[str, str]]:
    for name in ("ada", "bob"):
        console.create(name=name, track="oval", until="2000 steps", seed=ord(name[0]))
    for job in console.client.get("/api/jobs").json():
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    return [{"model": "ada"}, {"model": "bob", "checkpoint": "last"}]


def over(console: RunningConsole, contest: str) -> Callable[[], Any]:
    def ended() -> Any:
        found = console.client.get(f"/api/contests/{contest}").json()
        assert found["state"] != "failed", found
        return found if found["state"] == "done" else None

    return ended


def by_car(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=lambda row: int(row["car"]))


def started(console: RunningConsole, room: str, **settings: Any) -> dict[str, Any]:
    reply = console.client.post(f"/api/contests/{room}", json=settings)
    assert reply.status_code == 202, reply.text
    return dict(console.wait_for(over(console, reply.json()["id"])))


def test_a_heat_is_driven_on_one_road_and_can_be_verified(
    console: RunningConsole, cars: list[dict[str, str]], tmp_path: Path
) -> None:
    road = {"track": "oval", "objects": "bots", "count": 2, "max_resets": 1, "offtrack_penalty": 1.5, "seed": 7}
    heat = started(console, "heats", models=[*cars, cars[0]], title="Sunday", **road)
    assert (heat["kind"], heat["is_ladder"], heat["title"], heat["has_video"]) == ("grid", False, "Sunday", True)
    assert [row["place"] for row in heat["heat"]] == sorted(row["place"] for row in heat["heat"])
    assert {row["car"] for row in heat["heat"]} == {0, 1, 2}
    assert heat["winner"] == heat["heat"][0]["name"]

    address = f"/api/contests/{heat['id']}"
    film = console.client.get(f"{address}/replay").json()
    assert [car["model"] for car in film["cars"]] == [row["name"] for row in heat["heat"]]
    starts = {tuple(car["trace"][0][:2]) for car in film["cars"]}
    assert len(starts) == 3  # a grid, and no car is in another
    path = tmp_path / "heat.replay"
    path.write_bytes(console.client.get(f"{address}/replay.file").content)
    replay = read_replay(path)
    assert verify(replay).is_genuine
    assert (replay.conditions.rules.max_resets, replay.conditions.rules.offtrack_penalty) == (1, 1.5)
    longest = max((car.recording for car in replay.cars), key=len)
    assert [thing["kind"] for thing in film["objects"]] == [
        "bot_car",
        "bot_car",
    ]  # and no racer
    assert [car["objects"] for car in film["cars"]] == [[], [], []]
    for step in range(len(longest)):
        there = [(thing["x"][step], thing["y"][step], thing["heading"][step]) for thing in film["objects"]]
        assert there == [pytest.approx(view[:3], abs=6e-4) for view in longest.objects(step)[:2]]
    assert film["objects"][0]["x"][0] != film["objects"][0]["x"][-1]
    assert console.client.get(f"{address}/video").headers["content-type"] == "video/mp4"

    sent = console.client.get(f"{address}/share.html", params={"language": "de"}).text
    (document,) = re.findall(r'<script type="application/json" id="lap">(.*?)</script>', sent, re.DOTALL)
    shown = json.loads(document)["cars"]
    assert [car["name"] for car in shown] == [row["name"] for row in heat["heat"]]
    assert [len(car["x"]) for car in shown] == [len(replay.cars[row["car"]].recording) for row in heat["heat"]]
    assert "<h1>Sunday</h1>" in sent
    assert "<dt>Sieger</dt>" in sent
    (inside,) = re.findall(r'download="heat.replay" href="data:application/octet-stream;base64,([^"]+)"', sent)
    assert base64.b64decode(inside) == path.read_bytes()
    picture = tmp_path / "heat.png"
    picture.write_bytes(console.client.get(f"{address}/share.png").content)
    assert verify(read_replay(picture)).is_genuine

    again = started(console, "heats", models=[*cars, cars[0]], **road)
    assert again["heat"] == heat["heat"]
    assert [card["id"] for card in console.client.get("/api/contests").json()] == [again["id"], heat["id"]]


@pytest.mark.parametrize("kind", ["head-to-model", "time-trial", "head-to-bot"])
def test_a_ladder_rates_and_shows_every_race(console: RunningConsole, cars: list[dict[str, str]], kind: str) -> None:
    ladder = started(console, "ladders", models=cars, tracks=["oval"], kind=kind, starts=2, seed=3)
    assert (ladder["is_ladder"], ladder["driven"], len(ladder["matches"])) == (True, 2, 2)
    assert sum(row["wins"] + row["draws"] / 2 for row in ladder["ladder"]) == 2
    if ladder["ladder"][0]["wins"] == 2:
        assert ladder["ladder"][0]["rating"] > 25 > ladder["ladder"][1]["rating"]
    for match in ladder["matches"]:
        film = console.client.get(f"/api/contests/{ladder['id']}/replay?match={match['number']}").json()
        first = match["models"][match["places"].index(min(match["places"]))]
        assert film["cars"][0]["model"] == first
        assert {car["model"] for car in film["cars"]} == set(match["models"])
        assert all(len(car["trace"]) > 10 for car in film["cars"])
        assert film["objects"] == []  # each met its own, which began where the other's did
        bots = [[(one["kind"], len(one["x"])) for one in car["objects"]] for car in film["cars"]]
        assert bots == [[("bot_car", len(car["trace"]))] * (3 if kind == "head-to-bot" else 0) for car in film["cars"]]
        begin = [[(one["x"][0], one["y"][0]) for one in car["objects"]] for car in film["cars"]]
        assert begin[0] == begin[1]
    assert console.client.get(f"/api/contests/{ladder['id']}/replay?match=2").status_code == 404


def test_everything_asked_of_a_heat_is_what_it_is_driven_under(
    console: RunningConsole, cars: list[dict[str, str]], tmp_path: Path
) -> None:
    (kept, *_) = console.client.get("/api/models/ada").json()["checkpoints"]
    asked: dict[str, Any] = {
        **{"rules": "worker", "laps": 2, "time_limit": 20.0, "collision_penalty": 0.5, "max_resets": 3},
        **{"ranking": "best", "direction": "reverse", "vehicle": "v4", "randomize": "light", "seed": 11},
        **{"objects": "bots", "bot_speed": 0.7, "lane_changes": True, "positions": [[0.25, 1], [0.75, -1]]},
    }
    heat = started(console, "heats", models=[cars[0] | {"checkpoint": kept["step"]}, cars[1]], track="oval", **asked)
    listed = {one["id"]: one["direction"] for one in console.client.get("/api/contests").json()}
    assert listed[heat["id"]] == "reverse"  # by which a page knows whose ghosts it may have
    assert heat["models"] == [f"ada@{kept['step']}", "bob@last"] == [row["name"] for row in by_car(heat["heat"])]
    path = tmp_path / "heat.replay"
    path.write_bytes(console.client.get(f"/api/contests/{heat['id']}/replay.file").content)
    driven = read_replay(path).conditions
    rules = driven.rules
    assert (rules.laps, rules.time_limit, rules.collision_penalty, rules.max_resets) == (2, 20.0, 0.5, 3)
    assert (rules.offtrack_penalty, rules.direction) == (2.0, "reverse")  # of the worker's; and what was asked
    assert (driven.vehicle, driven.randomize, driven.seed) == (VEHICLES["v4"], RANDOMIZATIONS["light"], 11)
    bots = Bots(count=2, speed=0.7, changes_lane=True, placement="fixed", positions=((0.25, 1), (0.75, -1)))
    assert driven.objects == Objects(bots=bots)
    race = read_replay(path).race
    assert race is not None
    assert race.document["ranking"] == "best"
    # and its page is told just that
    assert RaceRules.from_dict(heat["rules"]) == rules
    assert Objects.from_dict(heat["objects"]) == driven.objects
    assert {name: heat[name] for name in ("vehicle", "randomize", "seed", "ranking")} == {
        name: asked[name] for name in ("vehicle", "randomize", "seed", "ranking")
    }


def test_everything_asked_of_a_ladder_is_what_it_is_driven_under(
    console: RunningConsole, cars: list[dict[str, str]]
) -> None:
    asked: dict[str, Any] = {
        **{"kind": "head-to-model", "schedule": "swiss", "rounds": 3, "starts": 1, "seed": 3, "time_limit": 2.0},
        **{"objects": "boxes", "parked_cars": True, "positions": [[0.3, 1], [0.6, -1], [0.9, 1]]},
    }
    ladder = started(console, "ladders", models=cars, tracks=["oval"], **asked)
    assert (len(ladder["matches"]), ladder["rounds"], ladder["rules"]["time_limit"]) == (3, 3, 2.0)
    film = console.client.get(f"/api/contests/{ladder['id']}/replay?match=0").json()
    assert [one["kind"] for one in film["objects"]] == ["parked_car"] * 3
    assert [car["objects"] for car in film["cars"]] == [[], []]  # both met the same
    assert max(len(car["trace"]) for car in film["cars"]) <= 31  # 2 s
    usual = console.client.post("/api/contests/ladders", json={"models": cars, "tracks": ["oval"], "starts": 1}).json()
    assert usual["rules"]["time_limit"] == 180.0
    assert console.wait_for(over(console, usual["id"]))["objects"] == Objects().to_dict()


def test_a_heat_from_before_its_terms_were_kept_still_tells_them() -> None:
    before = {
        **{"models": [{"model": "ada", "checkpoint": "best"}] * 2, "track": "oval", "laps": 2, "title": ""},
        **{"direction": "reverse", "objects": "boxes", "count": 2, "offtrack_penalty": 1.0, "max_resets": 4},
        **{"kind": "head-to-model", "tracks": ["oval"], "paths": ["oval"], "seed": 5, "vehicle": "v5"},
    }
    terms = terms_of(before)
    assert (terms.rules.laps, terms.rules.direction, terms.rules.max_resets) == (2, "reverse", 4)
    assert terms.objects == Objects(obstacles=Obstacles(count=2))
    assert terms_of(before | {"terms": terms.to_dict(), "laps": 9}) == terms
    ladder = {"models": before["models"], "tracks": ["oval"], "schedule": "swiss", "kind": "head-to-bot", "laps": 1}
    assert terms_of(ladder).rules.time_limit == 0.0  # under none, as ladders were
    assert terms_of(ladder).objects == Objects(bots=Bots())


def test_what_cannot_be_driven_is_refused(console: RunningConsole, cars: list[dict[str, str]]) -> None:
    client = console.client
    heats: list[tuple[int, dict[str, Any]]] = [
        (422, {"models": cars[:1]}),
        (422, {"models": cars * 5}),
        (404, {"models": [*cars, {"model": "nobody"}]}),
        (404, {"models": cars, "track": "nowhere"}),
        (404, {"models": cars, "track": "/etc/passwd.npy"}),
        (422, {"models": [{"model": "../ada"}, cars[1]]}),
        (409, {"models": [cars[0] | {"checkpoint": 1}, cars[1]]}),
        (422, {"models": [cars[0] | {"checkpoint": "1/../../x"}, cars[1]]}),
        (422, {"models": cars, "rules": "mine"}),
        (422, {"models": cars, "randomize": "/etc/passwd"}),
        (422, {"models": cars, "time_limit": -1}),
        (422, {"models": cars, "bot_speed": 1.0}),  # of no bots
        (422, {"models": cars, "objects": "bots", "parked_cars": True}),
        (422, {"models": cars, "objects": "boxes", "lane_changes": True}),
        (422, {"models": cars, "placement": "even"}),  # of nothing
        (422, {"models": cars, "objects": "boxes", "placement": "even", "positions": [[0.5, 1]]}),
        (422, {"models": cars, "objects": "boxes", "placement": "fixed"}),  # nowhere
        (422, {"models": cars, "objects": "boxes", "positions": [[0.5, 0]]}),
        (422, {"models": cars, "objects": "boxes", "positions": [[1.5, 1]]}),
        (422, {"models": cars, "ranking": "best", "minimum_laps": 2}),  # of one lap
        (422, {"models": cars, "laps": 3, "minimum_laps": 1}),  # of which the total is ranked by
    ]
    for status, body in heats:
        reply = client.post("/api/contests/heats", json=body)
        assert reply.status_code == status, (body, reply.text)
    ladders: list[dict[str, Any]] = [
        {"tracks": []},
        {"tracks": ["oval"], "rounds": 2},  # of a round-robin
        {"tracks": ["oval"], "kind": "time-trial", "objects": "boxes"},
        {"tracks": ["oval"], "kind": "time-trial", "placement": "random"},
    ]
    for body in ladders:
        reply = client.post("/api/contests/ladders", json={"models": cars, **body})
        assert reply.status_code == 422, (body, reply.text)
    console.create(name="fresh", track="oval", train=False)
    assert client.post("/api/contests/heats", json={"models": [*cars, {"model": "fresh"}]}).status_code == 409
    job = client.get("/api/jobs?run=ada").json()[-1]
    for address in ("0" * 16, "..", job["id"]):
        assert client.get(f"/api/contests/{address}").status_code == 404


def test_a_heat_may_start_where_a_secret_says(
    console: RunningConsole, cars: list[dict[str, str]], tmp_path: Path
) -> None:
    asked = {"models": cars, "track": "oval", "secret": True, "max_resets": 1}
    with full(console, "store"):
        told = console.client.post("/api/contests/heats", json=asked).json()
        assert (len(told["commitment"]), told["secret"], told["seed"]) == (64, "", None)
        file = console.runs / ".racecraft" / "contests" / told["id"] / "race.replay"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"the secret")  # as while the film is made
        assert console.client.get(f"/api/contests/{told['id']}/replay.file").status_code == 404
    heat = console.wait_for(over(console, told["id"]))
    assert (heat["commitment"], len(heat["secret"]), heat["seed"]) == (told["commitment"], 64, None)
    path = tmp_path / "heat.replay"
    path.write_bytes(console.client.get(f"/api/contests/{heat['id']}/replay.file").content)
    replay = read_replay(path)
    assert verify(replay, race=heat["commitment"]).is_genuine
    assert replay.race is not None
    assert (replay.race.secret, replay.race.commitment) == (heat["secret"], heat["commitment"])
    assert replay.conditions.seed == replay.race.seed
    other = console.client.post("/api/contests/heats", json=asked).json()
    assert other["commitment"] != heat["commitment"]
    assert console.client.post(f"/api/jobs/{other['id']}/cancel").status_code < 300
    both = console.client.post("/api/contests/heats", json=asked | {"seed": 3})
    assert both.status_code == 422
    assert both.json()["error"]["message"] == "secret and seed are two ways to say where the heat starts; give one."
    known = console.client.post("/api/contests/heats", json=asked | {"secret": False, "seed": 3}).json()
    assert (known["commitment"], known["secret"], known["seed"]) == ("", "", 3)
    assert console.wait_for(over(console, known["id"]))["secret"] == ""


def test_ghosts_accompany_the_film_of_a_heat(console: RunningConsole, cars: list[dict[str, str]]) -> None:
    settings: dict[str, Any] = {"models": cars, "track": "oval", "seed": 5, "max_resets": 1}
    before = started(console, "heats", **settings)
    ghosts = [{"model": "bob", "checkpoint": "last"}, "best-lap", {"heat": before["id"]}]
    heat = started(console, "heats", **settings, ghosts=ghosts)
    assert heat["ghosts"] == ghosts
    assert heat["heat"] == before["heat"]  # nobody who drives sees them
    films = [console.client.get(f"/api/contests/{one['id']}/video").content for one in (before, heat)]
    assert films[0] != films[1]
    told = [console.client.get(f"/api/contests/{one['id']}/replay").json() for one in (before, heat)]
    assert told[0] == told[1] | {"ghosts": []}
    alone, *lap, again = told[1]["ghosts"]  # nobody may have driven a lap
    first, longest = told[1]["cars"][0], max((car["trace"] for car in told[1]["cars"]), key=len)
    assert (alone["name"], alone["is_lap"], len(alone["trace"])) == ("bob@last", False, len(longest))
    assert len(alone["trace"][0]) == 3
    assert again["name"] == before["heat"][0]["name"]
    driven = [place for place in again["trace"] if place]
    for there, here in zip(driven, first["trace"], strict=False):  # it was the best car of the very same heat
        assert there == pytest.approx(here, abs=1)
    assert len(lap) == any(row["best"] for row in heat["heat"])
    post = console.client.post
    for ghost, status in (
        ({"model": "nobody"}, 404),
        ({"model": "ada", "checkpoint": 1}, 409),
        ({"heat": "0" * 16}, 404),
        ({"heat": "../../console.db"}, 404),
        ("/etc/passwd", 422),
        ("@8192", 422),
    ):
        reply = post("/api/contests/heats", json=settings | {"ghosts": [ghost]})
        assert reply.status_code == status, (ghost, reply.text)
    away = post("/api/contests/heats", json=settings | {"direction": "reverse", "ghosts": [{"heat": before["id"]}]})
    assert away.status_code == 422
    assert "in another direction or of another form" in away.json()["error"]["message"]
    assert post("/api/contests/heats", json=settings | {"ghosts": ["best-lap"] * 17}).status_code == 422


def test_a_track_that_was_drawn_anew_is_no_more_the_road_of_a_heat(
    console: RunningConsole, cars: list[dict[str, str]]
) -> None:
    client = console.client
    sketch = client.get("/api/tracks/oval/sketch").json()
    assert client.put("/api/tracks/own", json=sketch).status_code == 200
    heat = started(console, "heats", models=cars, track="own", seed=1, max_resets=0)

    def is_as_it_was() -> bool:
        (listed,) = (one for one in client.get("/api/contests").json() if one["id"] == heat["id"])
        return bool(listed["is_road_as_it_was"])

    assert (heat["state"], heat["is_road_as_it_was"], is_as_it_was()) == ("done", True, True)
    for point in sketch["points"]:
        point["width"] *= 1.1
    assert client.put("/api/tracks/own?replace=true", json=sketch).status_code == 200
    assert not is_as_it_was()
    assert client.delete("/api/tracks/own").status_code == 204
    assert not is_as_it_was()


@pytest.fixture(scope="module")
def evaluation(console: RunningConsole, cars: list[dict[str, str]]) -> dict[str, str]:
    """One of Ada's on the oval, as a ghost is asked for."""
    assert cars
    asked = {"laps": 1, "num_trials": 2, "seed": 9, "rules": "first_lap"}  # or a beginner is filmed for minutes
    job = console.client.post("/api/models/ada/evaluations", json=asked).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    (card,) = console.client.get("/api/models/ada/evaluations").json()
    return {"model": "ada", "evaluation": card["stamp"]}


def test_the_best_trial_of_an_evaluation_is_a_ghost(
    console: RunningConsole, cars: list[dict[str, str]], evaluation: dict[str, str]
) -> None:
    (listed,) = console.client.get("/api/contests/ghosts?track=oval").json()
    assert {name: listed[name] for name in evaluation} == evaluation
    assert console.client.get("/api/contests/ghosts?track=bowtie").json() == []
    assert console.client.get("/api/contests/ghosts?track=oval&direction=forward").json() == [listed]
    assert console.client.get("/api/contests/ghosts?track=oval&direction=reverse").json() == []  # it is refused there
    assert console.client.get("/api/contests/ghosts?track=nowhere").status_code == 404

    settings: dict[str, Any] = {"models": cars, "track": "oval", "seed": 5, "max_resets": 0}
    before = started(console, "heats", **settings)
    haunted = console.client.post("/api/contests/heats", json=settings | {"ghosts": [evaluation, "best-lap"]})
    assert haunted.status_code == 202, haunted.text
    folder = console.runs / ".racecraft" / "contests" / haunted.json()["id"]
    replay = console.runs / "ada" / f"evaluation-{evaluation['evaluation']}" / "evaluation.replay"
    kept = replay.read_bytes()
    assert (folder / "ghosts" / "0.replay").read_bytes() == kept
    replay.unlink()  # as when the model is removed before the heat is driven
    try:
        heat = console.wait_for(over(console, haunted.json()["id"]))
        gone = console.client.post("/api/contests/heats", json=settings | {"ghosts": [evaluation]})
        assert console.client.get("/api/contests/ghosts?track=oval").json() == []
    finally:
        replay.write_bytes(kept)
    assert heat["ghosts"] == [evaluation, "best-lap"]
    assert heat["heat"] == before["heat"]
    films = [console.client.get(f"/api/contests/{one['id']}/video").content for one in (before, heat)]
    assert films[0] != films[1]

    stamp = evaluation["evaluation"]
    assert (gone.status_code, gone.json()["error"]) == (
        409,
        gone.json()["error"]
        | {"message": f"Evaluation '{stamp}' of model 'ada' has no replay.", "hint": "Evaluate the model once more."},
    )
    refused: list[tuple[dict[str, Any], int, str]] = [
        ({"ghosts": [{"model": "nobody", "evaluation": stamp}]}, 404, "There is no model 'nobody'."),
        ({"ghosts": [{"model": "bob", "evaluation": stamp}]}, 404, f"Model 'bob' has no evaluation '{stamp}'."),
        ({"ghosts": [{"model": "ada", "evaluation": "../x"}]}, 404, "Model 'ada' has no evaluation '../x'."),
        (
            {"ghosts": [evaluation], "track": "bowtie"},
            422,
            "The ghost 'ada' drove on oval, in another direction or of another form than bowtie.",
        ),
    ]
    for change, status, message in refused:
        reply = console.client.post("/api/contests/heats", json=settings | change)
        assert (reply.status_code, reply.json()["error"]["message"]) == (status, message)
    known = {one["id"] for one in console.client.get("/api/contests").json()}
    assert {path.name for path in folder.parent.iterdir()} <= known  # what was refused left nothing


def test_a_heat_whose_ghost_is_gone_says_so(
    console: RunningConsole, cars: list[dict[str, str]], evaluation: dict[str, str]
) -> None:
    """As one that waited while its folder was lost."""
    from racecraft.errors import ConfigError
    from racecraft.serve.problems import Conflict
    from racecraft.serve.races.ghosts import keep, sources_of

    with pytest.raises(ConfigError, match=r"The replay of ghost 2 is not there\."):
        sources_of(["best-lap", evaluation], folder=console.runs / "nowhere", runs=console.runs)
    with pytest.raises(Conflict, match=r"The replay of ghost 1 cannot be copied: No such file"):
        keep({0: console.runs / "nowhere"}, console.runs / "begun")
    assert not (console.runs / "begun").exists()


def test_a_removed_contest_leaves_nothing(console: RunningConsole, cars: list[dict[str, str]]) -> None:
    heat = started(console, "heats", models=cars, track="oval", max_resets=0)
    assert heat["kind"] == "head-to-model"
    assert console.client.get(f"/api/contests/{heat['id']}/replay").json()["objects"] == []  # the other car is none
    folder = console.runs / ".racecraft" / "contests" / heat["id"]
    assert (folder / "race.replay").is_file()
    assert console.client.delete(f"/api/contests/{heat['id']}").status_code == 204
    assert not folder.exists()
    assert console.client.get(f"/api/contests/{heat['id']}").status_code == 404


@pytest.mark.costly
def test_a_model_learns_against_itself_or_against_others(console: RunningConsole, cars: list[dict[str, str]]) -> None:
    wanted = {"track": "oval", "race": "head-to-head", "actions": "continuous", "critic": "lap", "until": "1000 steps"}
    found = {}
    for name, others in (("self-taught", []), ("pupil", [car["model"] for car in cars])):
        console.create(name=name, opponents=others, cars=3, **wanted)
        (job,) = console.client.get(f"/api/jobs?run={name}").json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        found[name] = console.client.get(f"/api/models/{name}").json()
        assert found[name]["race"] == "head-to-head"
    assert found["self-taught"]["settings"]["opponents"]["drivers"] == ["self"]
    assert found["pupil"]["settings"]["opponents"]["cars"] == 3
    assert [Path(path).name for path in found["pupil"]["settings"]["opponents"]["drivers"]] == ["ada", "bob"]
    for name in found:  # it drives its lap behind those that it met
        lap = console.client.get(f"/api/models/{name}/demonstration").json()
        assert [thing["kind"] for thing in lap["objects"]] == ["racer", "racer"]
        place = [thing["x"][0] - lap["poses"][0][0] / 1000 for thing in lap["objects"]]
        assert max(abs(away) for away in place) > 0.2
        assert (lap["road"], lap["roads"], lap["geometry"]["name"]) == (0, ["oval"], "oval")
        assert console.client.get(f"/api/models/{name}/demonstration?road=1").status_code == 404
    alone = console.client.post("/api/models", json={**wanted, "race": "time-trial", "opponents": ["ada"]})
    assert alone.status_code == 422
    assert "head-to-head" in alone.json()["error"]["message"]
    nobody = console.client.post("/api/models", json={**wanted, "opponents": ["nobody"]})
    assert nobody.status_code == 404


def standing(name: str) -> Ghost:
    return Ghost(name, poses=np.zeros((1, 3)), steering=np.zeros(1), clock=np.zeros(1), color=(0, 0, 0))


def test_a_ghost_is_called_as_its_model_is_now() -> None:
    lap, *others = map(standing, ("fastest lap", "oval-2026", "bob@last", "Sunday"))
    evaluated, driving = {"model": "heron", "evaluation": "2026"}, {"model": "bob", "checkpoint": "last"}
    asked: list[str | dict[str, Any]] = ["best-lap", evaluated, driving, {"heat": "0" * 16}]
    for found, names in (([lap, *others], ["fastest lap"]), (others, [])):  # nobody may have driven a lap
        named = ghosts.named_as_asked(found, asked)
        assert [ghost.name for ghost in named] == [*names, "heron", "bob@last", "Sunday"]


def test_ghosts_of_one_model_are_told_apart() -> None:
    found = [standing(name) for name in ("ada-old", "ada-old", "ada", "ada@last", "ada")]
    asked: list[str | dict[str, Any]] = [
        {"model": "ada", "evaluation": "20261128103821"},
        {"model": "ada", "evaluation": "20261128103825"},
        {"model": "ada", "checkpoint": "best"},
        {"model": "ada", "checkpoint": "last"},
        {"heat": "0" * 16},
    ]
    named = [ghost.name for ghost in ghosts.named_as_asked(found, asked)]
    assert named == ["ada 20261128103821", "ada 20261128103825", "ada", "ada@last", "ada-2"]


@pytest.mark.parametrize("text", ["{}", '{"ghosts": 3}', '{"ghosts": [3]}', '{"ghosts": [{"name": "a"}]}', "{"])
def test_a_damaged_file_of_ghosts_is_told(tmp_path: Path, text: str) -> None:
    assert ghosts.read_beside(tmp_path) == []
    (tmp_path / "ghosts.json").write_text(text)
    with pytest.raises(ConfigError, match=r"ghosts\.json"):
        ghosts.read_beside(tmp_path)


def test_a_full_garage_lists_the_newest_evaluations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two hundred models of two hundred evaluations each took three seconds."""
    monkeypatch.setattr(ghosts, "MAX_READ", 5)
    for name, hours in (("ada", (1, 4, 7)), ("bob", (2, 5, 8)), ("cid", (3, 6))):
        for hour in hours:
            folder = tmp_path / name / f"evaluation-202601010{hour}0000"
            folder.mkdir(parents=True)
            (folder / "evaluation.json").write_text(json.dumps({"track": "oval", "best_lap_seconds": hour}))
            (folder / "evaluation.replay").write_bytes(b"")
        (tmp_path / name / "run.json").write_text("{}")
    (tmp_path / "ada" / "evaluation-notes").mkdir()
    listed = [(card.model, card.best_lap) for card in ghosts.evaluated(tmp_path, load_track("oval"))]
    assert sorted(listed) == [("ada", 4), ("ada", 7), ("bob", 5), ("bob", 8), ("cid", 6)]
    assert listed.index(("ada", 7)) < listed.index(("ada", 4))
