"""Driving by hand over HTTP: laps, penalties, records, ghosts, and what strangers try."""

from __future__ import annotations

import json
import math
from typing import Any

import httpx
import numpy as np
import pytest
from raced_models import write_raced
from running_consoles import RunningConsole

from racecraft.limits import known_limit
from racecraft.serve.driving.drives import MAX_DRIVES
from racecraft.sim import load_vehicle
from racecraft.track import Track, load_track


def refused(reply: httpx.Response, status: int) -> dict[str, Any]:
    assert reply.status_code == status, reply.text
    assert set(reply.json()) == {"error"}
    return dict(reply.json()["error"])


def begin(console: RunningConsole, **settings: Any) -> dict[str, Any]:
    reply = console.client.post("/api/drives", json={"track": "oval", **settings})
    assert reply.status_code == 201, reply.text
    return dict(reply.json())


def lap(console: RunningConsole, drive: dict[str, Any], track: Track, *, speed: float) -> dict[str, Any]:
    """Follow the centre line until the lap is done."""
    pose = drive["start"]
    for _ in range(600):
        x, y, heading = (value / 1000 for value in pose[:3])
        s, _ = track.project([x, y])
        target = track.point_at(s + 0.7)
        error = math.atan2(target[1] - y, target[0] - x) - heading
        error = math.atan2(math.sin(error), math.cos(error))
        controls = {"steering": max(-0.5, min(0.5, 1.4 * error)), "speed": speed}
        state = console.client.post(f"/api/drives/{drive['id']}/steps", json=controls).json()
        pose = state["pose"]
        if state["finished"]:
            return dict(state)
    raise AssertionError("never came round")


@pytest.mark.costly
def test_laps_are_timed_and_the_fastest_is_ones_ghost(console: RunningConsole) -> None:
    client, track = console.client, load_track("oval")
    assert client.get("/api/ghosts", params={"track": "oval"}).json() == []
    drive = begin(console)
    assert drive["best"] is None
    x, y = track.point_at(0.0)
    assert np.hypot(drive["start"][0] / 1000 - x, drive["start"][1] / 1000 - y) < 0.01

    slow = lap(console, drive, track, speed=1.3)["finished"]
    assert slow["number"] == 1
    assert slow["mistakes"] == 0
    assert slow["is_best"]
    assert slow["seconds"] == pytest.approx(track.length / 1.3, rel=0.15)
    drive["start"] = client.post(f"/api/drives/{drive['id']}/steps", json={"steering": 0, "speed": 1.5}).json()["pose"]
    fast = lap(console, drive, track, speed=1.7)["finished"]
    assert fast["number"] == 2
    assert fast["seconds"] < slow["seconds"]
    assert fast["is_best"]
    drive["start"] = client.post(f"/api/drives/{drive['id']}/steps", json={"steering": 0, "speed": 1.5}).json()["pose"]
    assert not lap(console, drive, track, speed=1.2)["finished"]["is_best"]

    ghosts = client.get("/api/ghosts", params={"track": "oval"}).json()
    driven = {"direction": "forward", "vehicle": "v5"}
    assert ghosts == [{"key": "you", "name": "", "seconds": fast["seconds"], **driven}]
    ghost = client.get("/api/ghosts/you", params={"track": "oval"}).json()
    assert len(ghost["trace"]) == pytest.approx(15 * fast["seconds"], abs=2)
    assert np.abs(track.project(np.array(ghost["trace"])[:, :2] / 1000)[1]).max() < track.mean_width
    assert begin(console)["best"] == fast["seconds"]
    assert begin(console, direction="reverse")["best"] is None
    assert begin(console, vehicle="v4")["best"] is None


def test_the_medals_are_those_of_the_road_the_car_and_the_direction(console: RunningConsole) -> None:
    limit = known_limit(load_track("oval"), load_vehicle("v5"))
    assert limit is not None
    assert begin(console)["medals"] == vars(limit.medals)
    assert begin(console, direction="reverse")["medals"] is None, "the table has one direction"
    assert begin(console, vehicle="v4")["medals"] != vars(limit.medals)
    points = [{"x": 4 * math.cos(0.6 * i), "y": 3 * math.sin(0.6 * i), "width": 0.9} for i in range(10)]
    assert begin(console, track=None, sketch={"points": points})["medals"] is None


def test_leaving_the_road_costs_a_second_and_the_car_goes_on(console: RunningConsole) -> None:
    drive = begin(console)
    steps = f"/api/drives/{drive['id']}/steps"
    seen = []
    for _ in range(60):
        state = console.client.post(steps, json={"steering": 0.0, "speed": 3.0}).json()
        seen.append(state)
        if state["mistake"]:
            break
    assert seen[-1]["mistake"] == "off_track"
    assert seen[-1]["mistakes"] == 1
    assert seen[-1]["standing"] == pytest.approx(1.0)
    waiting = [console.client.post(steps, json={"steering": 0.0, "speed": 3.0}).json() for _ in range(14)]
    assert all(state["pose"][:3] == seen[-1]["pose"][:3] for state in waiting)
    assert waiting[-1]["clock"] > seen[-1]["clock"] + 0.9
    moved = [console.client.post(steps, json={"steering": 0.3, "speed": 1.0}).json() for _ in range(8)][-1]
    assert moved["pose"][:2] != seen[-1]["pose"][:2]


def test_who_waits_is_left_alone(console: RunningConsole) -> None:
    drive = begin(console)
    steps = f"/api/drives/{drive['id']}/steps"
    states = [console.client.post(steps, json={"steering": 0.2, "speed": 0, "steps": 15}).json() for _ in range(6)]
    assert all(state["mistakes"] == 0 for state in states)
    assert math.dist(states[-1]["pose"][:2], drive["start"][:2]) < 50
    gone = console.client.post(steps, json={"steering": 0, "speed": 1.5, "steps": 10}).json()
    assert math.dist(gone["pose"][:2], drive["start"][:2]) > 200


def test_a_drawing_can_be_tried_before_it_is_kept(console: RunningConsole) -> None:
    points = [{"x": 4 * math.cos(0.6 * i), "y": 3 * math.sin(0.6 * i), "width": 0.9} for i in range(10)]
    drive = begin(console, track=None, sketch={"points": points})
    assert drive["geometry"]["is_closed"]
    crossing = [{"x": x, "y": y, "width": 0.6} for x, y in ((-4, -2), (4, 2), (4, -2), (-4, 2))]
    refused(console.client.post("/api/drives", json={"sketch": {"points": crossing}}), 422)


def test_a_models_best_lap_is_a_ghost(console: RunningConsole) -> None:
    track = load_track("oval")
    folder = console.runs / "champion"
    evaluation = write_raced(folder, 12.0, 9.0)
    (folder / "run.json").write_text("{}")

    listed = console.client.get("/api/ghosts", params={"track": "oval"}).json()
    card = {"key": "model:champion", "name": "champion", "seconds": 9.0, "direction": "forward", "vehicle": None}
    assert card in listed
    ghost = console.client.get("/api/ghosts/model:champion", params={"track": "oval"}).json()
    assert ghost == {**card, "trace": ghost["trace"]}
    assert len(ghost["trace"]) == 136
    assert np.abs(track.project(np.array(ghost["trace"])[:, :2] / 1000)[1]).max() < 0.01
    params = {"track": "oval", "direction": "reverse"}
    refused(console.client.get("/api/ghosts/model:champion", params=params), 404)
    assert console.client.get("/api/ghosts", params={"track": "hairpin_hill"}).status_code in (200, 404)

    (evaluation / "evaluation-simtrace" / "0-iteration.csv").write_text("episode,X\n1,nonsense\n")
    refused(console.client.get("/api/ghosts/model:champion", params={"track": "oval"}), 404)
    listed = console.client.get("/api/ghosts", params={"track": "oval"}).json()
    assert all(one["name"] != "champion" for one in listed)


def test_a_ghost_says_which_way_round_and_in_what_it_was_driven(console: RunningConsole) -> None:
    """Also of models that learned in reverse, or in another car; and an evaluation's car is not always the model's."""

    def models(direction: str) -> list[Any]:
        listed = console.client.get("/api/ghosts", params={"track": "bowtie", "direction": direction}).json()
        return [(one["name"], one["direction"], one["vehicle"]) for one in listed]

    console.create(name="crab", train=False, track="bowtie", vehicle="v6", direction="reverse")
    write_raced(console.runs / "crab", 8.0, track="bowtie", direction="reverse")
    console.create(name="dove", train=False, track="bowtie", vehicle="v6")
    write_raced(console.runs / "dove", 11.0, track="bowtie", vehicle="v4")
    assert models("forward") == [("dove", "forward", "v4"), ("crab", "reverse", "v6")]
    assert models("reverse") == [("crab", "reverse", "v6"), ("dove", "forward", "v4")]

    params = {"track": "bowtie", "direction": "reverse", "vehicle": "v6"}
    ghost = console.client.get("/api/ghosts/model:crab", params=params).json()
    assert (ghost["direction"], ghost["vehicle"]) == ("reverse", "v6")
    start = begin(console, **params)["start"]
    assert math.dist(start[:2], ghost["trace"][0][:2]) < 10
    assert math.cos((start[2] - ghost["trace"][0][2]) / 1000) > 0.99


@pytest.mark.parametrize("tells_its_road", [True, False])
def test_no_ghost_drives_on_a_track_that_was_redrawn(console: RunningConsole, *, tells_its_road: bool) -> None:
    drawings = [console.client.get(f"/api/tracks/{name}/sketch").json() for name in ("oval", "hairpin")]

    def draw(drawing: Any) -> None:
        reply = console.client.put("/api/tracks/mine", params={"replace": True}, json=drawing)
        assert reply.status_code == 200, reply.text

    def ghosts() -> list[str]:
        listed = console.client.get("/api/ghosts", params={"track": "mine"}).json()
        return [one["key"] for one in listed if one["name"] == name]

    draw(drawings[0])
    name = console.create(track="mine", train=False)
    info = json.loads((console.runs / name / "run.json").read_text())
    evaluation = write_raced(console.runs / name, 9.0)
    about = {"track": "mine", "best_lap_seconds": 9.0}
    about |= {"track_digest": info["track_digest"]} if tells_its_road else {}
    (evaluation / "evaluation.json").write_text(json.dumps(about))
    ghost = f"/api/ghosts/model:{name}"
    assert ghosts() == [f"model:{name}"]
    assert console.client.get(ghost, params={"track": "mine"}).status_code == 200

    draw(drawings[1])
    assert ghosts() == []
    refused(console.client.get(ghost, params={"track": "mine"}), 404)
    draw(drawings[0])
    assert ghosts() == [f"model:{name}"]


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"track": "nowhere"},
        {"track": "../../etc/passwd"},
        {"track": "oval", "vehicle": "/etc/passwd"},
        {"track": "oval", "direction": "up"},
        {"sketch": {"points": []}},
        {"track": "x" * 300},
    ],
)
def test_drives_that_cannot_begin(console: RunningConsole, body: dict[str, Any]) -> None:
    reply = console.client.post("/api/drives", json=body)
    assert reply.status_code in (404, 422)
    refused(reply, reply.status_code)


@pytest.mark.parametrize(
    "controls",
    [
        "{}",
        '{"steering": NaN, "speed": 1}',
        '{"steering": 0, "speed": 1e999}',
        '{"steering": 5, "speed": 1}',
        '{"steering": 0, "speed": -1}',
        '{"steering": 0, "speed": 1, "steps": 1000000}',
        '{"steering": 0, "speed": 1, "steps": 0}',
        "[1, 2]",
    ],
)
def test_controls_that_are_none(console: RunningConsole, controls: str) -> None:
    drive = begin(console)
    headers = {"content-type": "application/json"}
    refused(console.client.post(f"/api/drives/{drive['id']}/steps", content=controls, headers=headers), 422)


def test_there_are_only_so_many_cars_and_the_oldest_is_taken(console: RunningConsole) -> None:
    first = begin(console)
    for _ in range(MAX_DRIVES):
        begin(console)
    controls = {"steering": 0, "speed": 1}
    refused(console.client.post(f"/api/drives/{first['id']}/steps", json=controls), 404)
    last = begin(console)
    assert console.client.delete(f"/api/drives/{last['id']}").status_code == 204
    refused(console.client.post(f"/api/drives/{last['id']}/steps", json=controls), 404)
    refused(console.client.post("/api/drives/nothing/steps", json=controls), 404)
