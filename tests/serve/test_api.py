"""The console's API against a real server, real trainings and real files."""

from __future__ import annotations

import json
import shutil
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest
from running_consoles import RunningConsole

from racecraft.limits import known_limit
from racecraft.serve.models.names import ANIMALS, free_name
from racecraft.sim.vehicle import load_vehicle
from racecraft.track import load_track

OF_OBJECTS = """def reward_function(params):
    _, ahead = params["closest_objects"]
    x, y = params["objects_location"][ahead]
    return abs(params["x"] - x) + abs(params["y"] - y)
"""
GATE = "def reward_function(params):\n    return 1.0 if params['all_wheels_on_track'] else 0.001\n"


def error(reply: httpx.Response, status: int) -> dict[str, Any]:
    assert reply.status_code == status, reply.text
    document = reply.json()
    assert set(document) == {"error"}
    assert document["error"]["code"]
    assert document["error"]["message"]
    return dict(document["error"])


@pytest.mark.costly
def test_what_the_console_offers(console: RunningConsole) -> None:
    client = console.client
    assert client.get("/api/console").json()["runs"] == str(console.runs)
    tracks = client.get("/api/tracks").json()
    assert {"oval", "reinvent_2018"} <= {track["name"] for track in tracks}
    assert all(len(track["outline"]) >= 20 for track in tracks)
    lines = client.get("/api/tracks/oval").json()
    assert len(lines["center"]) == len(lines["inner"]) == len(lines["outer"])
    assert "racing" in {reward["name"] for reward in client.get("/api/rewards").json()}
    presets = client.get("/api/actions").json()
    (fast,) = (preset for preset in presets if preset["name"] == "fast")
    assert [action["speed"] for action in fast["actions"][:3]] == [4 / 3, 8 / 3, 4.0]  # all their digits
    kinds = {preset["name"]: preset["kind"] for preset in presets}
    assert kinds["continuous"] == "continuous"
    assert kinds["default"] == "discrete"
    assert client.get("/api/openapi.json").json()["paths"]["/api/models"]


@pytest.mark.costly
def test_a_reward_is_checked_and_painted(console: RunningConsole) -> None:
    client = console.client
    verdict = client.post("/api/rewards/check", json={"source": GATE, "track": "oval"}).json()
    assert verdict["ok"]
    rewards = verdict["painting"]["rewards"]
    middle = [row[len(row) // 2] for row in rewards]
    assert set(middle) == {1.0}
    assert {row[0] for row in rewards} == {0.001}

    among = {"source": OF_OBJECTS, "track": "oval"}
    alone = client.post("/api/rewards/check", json=among).json()
    assert not alone["ok"]
    assert "IndexError" in alone["problems"][0]["message"]
    assert verdict["painting"]["objects"] == []
    for race, count in (
        ({"race": "object-avoidance"}, 6),
        ({"race": "head-to-bot", "objects": 1}, 1),
        ({"race": "head-to-head"}, 1),
    ):
        told = client.post("/api/rewards/check", json={**among, **race}).json()
        assert told["ok"], race
        assert len(told["painting"]["objects"]) == count  # and what it pays is known everywhere
        assert all(value is not None for row in told["painting"]["rewards"] for value in row)
    boxes = {"name": "among-boxes", "train": False, "track": "oval", "race": "object-avoidance"}
    assert client.post("/api/models", json=boxes).status_code == 201
    told = client.post("/api/rewards/check", json={**among, "of": "among-boxes"}).json()
    assert (told["ok"], len(told["painting"]["objects"])) == (True, 6)
    nowhere = client.post("/api/rewards/check", json={**among, "race": "downhill"})
    assert (nowhere.status_code, "downhill" in nowhere.json()["error"]["message"]) == (422, True)
    broken = client.post("/api/rewards/check", json={"source": "def reward_function(p:\n", "track": "oval"}).json()
    assert not broken["ok"]
    assert broken["problems"][0]["line"] == 1
    elsewhere = GATE.replace("\n", "\n    assert params['track_length'] < 20\n", 1)
    wide = {"source": elsewhere, "track": "oval"}
    assert client.post("/api/rewards/check", json=wide).json()["ok"]
    verdict = client.post("/api/rewards/check", json={**wide, "more_tracks": ["oval", "hairpin"]}).json()
    assert (verdict["ok"], verdict["problems"][-1]["line"]) == (False, 2)
    assert verdict["problems"][-1]["hint"] == "It failed on the track 'hairpin', one of 2."
    both = {"name": "on-both", "train": False, "track": "oval", "more_tracks": ["hairpin"]}
    refused = client.post("/api/models", json={**both, "reward": elsewhere})
    assert (refused.status_code, refused.json()["error"]["hint"]) == (422, verdict["problems"][-1]["hint"])
    assert client.post("/api/models", json=both).status_code == 201
    assert not client.post("/api/rewards/check", json={**wide, "of": "on-both"}).json()["ok"]
    nowhere = client.post("/api/rewards/check", json={**wide, "more_tracks": ["/etc/passwd.npy"]})
    assert nowhere.status_code == 404
    failing = GATE.replace("1.0 if", "1 / 0 if")
    verdict = client.post("/api/rewards/check", json={"source": failing, "track": "oval"}).json()
    assert not verdict["ok"]
    assert verdict["problems"][-1]["line"] == 2


def test_every_preset_has_a_picture(console: RunningConsole) -> None:
    pictures = console.client.get("/api/rewards/pictures").json()
    assert set(pictures["rewards"]) == {reward["name"] for reward in console.client.get("/api/rewards").json()}
    grid = [len(across) for across in pictures["points"]]
    assert all([len(across) for across in paid] == grid for paid in pictures["rewards"].values())


@pytest.mark.costly
def test_from_a_click_to_a_race(console: RunningConsole) -> None:
    client = console.client
    name = console.create(name="first", until="2000 steps", tags=["mine"], train=False)
    events: dict[str, list[Any]] = {"points": [], "live": [], "eye": [], "jobs": []}
    identity = ""
    with client.stream("GET", f"/api/events/{name}?eye=true") as stream:
        job = client.post(f"/api/models/{name}/train", json={}).json()  # now that somebody looks
        kind = ""
        for line in stream.iter_lines():
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            elif line.startswith("id: "):
                identity = line.removeprefix("id: ")
            elif line.startswith("data: "):
                events[kind].append(json.loads(line.removeprefix("data: ")))
                if events["points"] and any(one["state"] == "done" for jobs in events["jobs"][-1:] for one in jobs):
                    break
    assert console.wait_for(console.job_ended(job["id"]))["result"]["steps"] >= 2000
    looks = events["live"]
    assert looks
    assert all(len(look["poses"]) == 64 and len(look["policy"]) == 10 for look in looks)
    assert all(len(json.dumps(look, separators=(",", ":"))) <= 3000 for look in looks)
    assert 0 < len(events["eye"]) <= len(looks)
    assert all(np.prod(picture["frame_shape"]) == len(b64decode(picture["frame"])) for picture in events["eye"])
    assert looks[-1]["step"] > 0
    assert abs(sum(looks[-1]["policy"]) - 1) < 0.01

    page = client.get(f"/api/models/{name}/history").json()
    assert {"iteration", "evaluation"} <= {point["kind"] for point in page["points"]}
    with client.stream("GET", f"/api/events/{name}", headers={"Last-Event-ID": "0"}) as stream:
        lines = stream.iter_lines()
        assert next(line for line in lines if line.startswith("id: ")) == f"id: {page['offset']}"
    assert int(identity) <= page["offset"]

    detail = client.get(f"/api/models/{name}").json()
    assert detail["status"] == "finished"
    assert detail["tags"] == ["mine"]
    assert detail["checkpoints"]
    raced = client.post(
        f"/api/models/{name}/evaluations", json={"laps": 1, "num_trials": 2, "rules": "first_lap"}
    ).json()
    ended = console.wait_for(console.job_ended(raced["id"]))
    assert ended["state"] == "done", ended
    card = client.get(f"/api/models/{name}/evaluations").json()[0]
    assert len(card["laps"]) >= 2
    picture = client.get(f"/api/models/{name}/files/{card['picture']}")
    assert picture.headers["content-type"] == "image/png"
    telemetry = client.get(f"/api/models/{name}/evaluations/{card['stamp']}/telemetry").json()["columns"]
    assert len(telemetry["X"]) == len(telemetry["episode_status"]) > 10
    assert client.get("/api/models").json()[0]["picture"] == card["picture"]


@pytest.mark.costly
def test_a_training_is_stopped_and_goes_on(console: RunningConsole) -> None:
    client = console.client
    name = console.create(name="long", until="10 minutes")
    console.wait_for(lambda: client.get(f"/api/models/{name}/history").json()["points"])
    error(client.post(f"/api/models/{name}/train", json={}), 409)
    error(client.delete(f"/api/models/{name}"), 409)
    job = client.post(f"/api/models/{name}/stop").json()
    ended = console.wait_for(console.job_ended(job["id"]))
    assert ended["result"]["reason"] == "interrupted"
    steps = ended["result"]["steps"]
    assert client.get(f"/api/models/{name}").json()["status"] == "stopped"
    again = client.post(f"/api/models/{name}/train", json={"until": f"{steps + 1000} steps", "reward": GATE}).json()
    ended = console.wait_for(console.job_ended(again["id"]))
    assert ended["result"]["steps"] >= steps + 1000
    assert client.get(f"/api/models/{name}").json()["reward"] == GATE


def test_models_are_cloned_renamed_tagged_deleted_and_restored(console: RunningConsole) -> None:
    client = console.client
    name = console.create(name="a", train=False, track="oval", seed=7)
    assert client.get(f"/api/models/{name}").json()["status"] == "new"
    names = [client.post("/api/models/a/clone", json={}).json()["name"] for _ in range(2)]
    assert names == ["a-2", "a-3"]
    assert all(client.delete(f"/api/models/{one}").status_code == 204 for one in names)
    copy = client.post("/api/models/a/clone", json={"name": "b"}).json()
    assert copy["track"] == "oval"
    assert client.get("/api/models/b").json()["seed"] == 7
    error(client.patch("/api/models/a", json={"name": "b"}), 409)
    assert client.patch("/api/models/a", json={"name": "c", "tags": ["x", "x"]}).json()["tags"] == ["x"]
    error(client.get("/api/models/a"), 404)
    assert client.delete("/api/models/c").status_code == 204
    error(client.get("/api/models/c"), 404)
    assert client.post("/api/models/c/restore").json()["tags"] == ["x"]
    error(client.post("/api/models/nothing/restore"), 404)


def test_a_starter_is_brought_once_and_is_a_model_like_any_other(console: RunningConsole) -> None:
    client = console.client
    card = client.post("/api/models/starters/quick").json()
    assert card["name"] == "starter-quick"
    assert client.post("/api/models/starters/quick").json() == card
    assert [model["name"] for model in client.get("/api/models").json()].count("starter-quick") == 1
    assert client.get("/api/models/starter-quick").json()["checkpoints"]
    assert client.delete("/api/models/starter-quick").status_code == 204
    assert client.post("/api/models/starters/quick").json()["name"] == "starter-quick"
    for nothing in ("quik", "starter-quick", "x" * 300):
        error(client.post(f"/api/models/starters/{nothing}"), 404)


@pytest.mark.parametrize(
    ("settings", "status", "text"),
    [
        ({"track": "nowhere"}, 404, "nowhere"),
        ({"track": "../../etc/passwd"}, 404, "does not exist"),
        ({"track": "/etc/hostname.npy"}, 404, "does not exist"),
        ({"reward": "def reward_function(params): return open('x')"}, 422, "open"),
        ({"reward": "import os"}, 422, ""),
        ({"until": "whenever"}, 422, "whenever"),
        ({"actions": "sideways"}, 422, "sideways"),
        ({"vehicle": "/etc/passwd"}, 422, "vehicle"),
        ({"name": "../up"}, 422, "1 to 64 letters"),
        ({"name": "x" * 65}, 422, "1 to 64 letters"),
        ({"name": ".racecraft"}, 422, "1 to 64 letters"),
        ({"seed": -1}, 422, "seed"),
        ({"colour": "red"}, 422, "colour"),
        ({"model_metadata": {"action_space": []}}, 422, ""),
        ({"hyperparameters": {"lr": "fast"}}, 422, "lr"),
        ({"tags": ["x" * 41]}, 422, "tags"),
    ],
)
def test_bad_settings_are_told_in_one_sentence(
    console: RunningConsole, settings: dict[str, Any], status: int, text: str
) -> None:
    before = {model["name"] for model in console.client.get("/api/models").json()}
    assert text in error(console.client.post("/api/models", json=settings), status)["message"]
    assert {model["name"] for model in console.client.get("/api/models").json()} == before


def test_only_a_models_own_files_are_handed_out(console: RunningConsole) -> None:
    name = console.create(name="files", train=False)
    (console.runs / name / "metrics").mkdir(exist_ok=True)
    (console.runs / name / "metrics" / "x.json").write_text("{}")
    (console.runs / name / "metrics" / "link.json").symlink_to("/etc/hostname")
    client = console.client
    assert client.get(f"/api/models/{name}/files/metrics/x.json").status_code == 200
    for path in (
        "run.json",
        "checkpoints/manifest.json",
        "metrics/link.json",
        "metrics/../run.json",
        "metrics/%2e%2e/run.json",
        "%2fetc%2fhostname",
        "metrics",
        "metrics/none.json",
    ):
        error(client.get(f"/api/models/{name}/files/{path}"), 404)


def test_a_damaged_run_folder_hides_only_itself(console: RunningConsole) -> None:
    damaged = console.runs / "damaged"
    damaged.mkdir()
    (damaged / "run.json").write_text("{")
    names = {model["name"] for model in console.client.get("/api/models").json()}
    assert "damaged" not in names
    error(console.client.get("/api/models/damaged"), 404)


def test_a_history_that_no_training_wrote_hides_no_other_model(console: RunningConsole) -> None:
    """An archive brings its own along."""
    name = console.create(name="strange", train=False, track="oval")
    history = console.runs / name / "metrics" / "history.jsonl"
    history.parent.mkdir(exist_ok=True)
    for seconds in ("x", [1], {"a": 1}, True, 2.5):
        with history.open("a") as file:
            file.write(json.dumps({"kind": "iteration", "step": 512, "seconds": seconds}) + "\n")
    listed = console.client.get("/api/models")
    assert listed.status_code == 200, listed.text
    assert {model["name"]: model["seconds"] for model in listed.json()}[name] == 2.5


def test_runs_of_the_command_line_appear(console: RunningConsole) -> None:
    from racecraft.agent import ModelMetadata, action_space
    from racecraft.reward import load_preset
    from racecraft.training.settings import make_settings
    from racecraft.training.start import start_run

    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    settings = make_settings(metadata=metadata, track="oval")
    start_run(settings, reward=load_preset("racing"), metadata=metadata, root=console.runs, name="from-the-shell")
    assert console.client.get("/api/models/from-the-shell").json()["track"] == "oval"


@pytest.mark.costly
def test_the_garage_of_many_runs_is_read_once(console: RunningConsole) -> None:
    for number in range(20):
        console.create(name=f"many-{number}", train=False)
    first = console.client.get("/api/models").json()
    assert len([model for model in first if model["name"].startswith("many-")]) == 20
    assert console.client.get("/api/models").json() == first


@pytest.mark.costly
def test_two_who_look_at_new_models_at_the_same_time(console: RunningConsole) -> None:
    for number in range(20):
        shutil.copytree(console.runs / "many-0", console.runs / f"twin-{number}")
    with ThreadPoolExecutor(8) as pool:
        replies = list(pool.map(lambda _: console.client.get("/api/models"), range(16)))
    assert {reply.status_code for reply in replies} == {200}
    assert all(f"twin-{number}" in reply.text for reply in replies for number in range(20))


def test_a_card_is_read_again_when_an_evaluation_has_ended(console: RunningConsole) -> None:
    name = console.create(name="raced", train=False)

    def card() -> Any:
        return next(model for model in console.client.get("/api/models").json() if model["name"] == name)

    folder = console.runs / name / "evaluation-20260101000000"
    folder.mkdir()
    assert card()["evaluations"] == 0
    (folder / "racing-line.png").write_bytes(b"picture")
    (folder / "evaluation.json").write_text("{}")
    assert card()["evaluations"] == 1
    assert card()["picture"] == "evaluation-20260101000000/racing-line.png"


def test_one_best_lap_for_training_and_races(console: RunningConsole) -> None:
    """The fastest of all, on the model's own track; and the card's picture is of the race that drove it."""
    name = console.create(name="quick", train=False, track="oval")
    run = console.runs / name
    (run / "metrics").mkdir(exist_ok=True)
    point = {"kind": "evaluation", "step": 9, "seconds": 1, "completions": [1.0], "lap_times": [10.47], "is_best": True}
    (run / "metrics" / "history.jsonl").write_text(json.dumps(point) + "\n")

    def race(stamp: str, lap: float, track: str = "oval") -> tuple[Any, Any]:
        folder = run / f"evaluation-{stamp}"
        folder.mkdir()
        (folder / "racing-line.png").write_bytes(b"picture")
        (folder / "evaluation.json").write_text(json.dumps({"track": track, "step": 9, "best_lap_seconds": lap}))
        card = next(model for model in console.client.get("/api/models").json() if model["name"] == name)
        assert console.client.get(f"/api/models/{name}").json()["best_lap"] == card["best_lap"]
        return card["best_lap"], card["picture"]

    assert race("20260101000000", 10.8)[0] == 10.47
    assert race("20260101000001", 9.6) == (9.6, "evaluation-20260101000001/racing-line.png")
    assert race("20260101000002", 10.0) == (9.6, "evaluation-20260101000001/racing-line.png")
    assert race("20260101000003", 5.0, track="hairpin")[0] == 9.6


def test_a_card_says_how_long_a_training_was_that_ended_before_a_checkpoint(console: RunningConsole) -> None:
    name = console.create(name="brief", train=False, track="oval")
    history = console.runs / name / "metrics" / "history.jsonl"
    history.parent.mkdir(exist_ok=True)
    for seconds in (1.0, 5.5):
        with history.open("a") as file:
            file.write(json.dumps({"kind": "iteration", "step": 512, "seconds": seconds}) + "\n")
        (card,) = (model for model in console.client.get("/api/models").json() if model["name"] == name)
        assert card["seconds"] == seconds


def test_the_medals_are_those_of_its_own_road_car_and_direction(console: RunningConsole) -> None:
    def medals(name: str, **settings: Any) -> Any:
        console.create(name=name, train=False, track="reinvent_2018", **settings)
        listed = {model["name"]: model for model in console.client.get("/api/models").json()}
        return listed[name]["medals"]

    road = load_track("reinvent_2018")
    limit = known_limit(road, load_vehicle("v5"))
    assert limit is not None
    assert known_limit(road.reversed(), load_vehicle("v5")) is None, "the table has one direction"
    assert medals("there", vehicle="v5") == vars(limit.medals)
    assert medals("back", vehicle="v5", direction="reverse") is None
    assert medals("old", vehicle="v4") != vars(limit.medals)
    file = console.runs / "there" / "run.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"track": "reinvent_2018 + oval"}))
    assert console.client.get("/api/models/there").json()["medals"] is None


def test_a_model_in_use_is_not_moved_away(console: RunningConsole) -> None:
    client = console.client
    name = console.create(name="busy", train=False)
    job = client.post(f"/api/models/{name}/evaluations", json={}).json()  # fails: there is no checkpoint
    moved = client.patch(f"/api/models/{name}", json={"name": "elsewhere"})
    if moved.status_code != 200:
        assert "in use" in error(moved, 409)["message"]
    ended = console.wait_for(console.job_ended(job["id"]))
    assert ended["state"] == "failed"


@pytest.mark.costly
def test_models_that_nobody_named_have_names_of_their_own_that_one_can_say(console: RunningConsole) -> None:
    with ThreadPoolExecutor(4) as pool:
        names = list(pool.map(lambda _: console.create(track="oval", train=False), range(8)))
    assert len(set(names)) == 8
    assert set(names) <= set(ANIMALS)
    for name in names:
        console.client.delete(f"/api/models/{name}")
    again = [console.create(track="oval", train=False) for _ in range(2)]
    assert not set(again) & set(names)  # they may come back from the trash
    for name in again:
        console.client.delete(f"/api/models/{name}")


def test_a_track_that_is_named_twice_is_learned_on_once(console: RunningConsole) -> None:
    name = console.create(track="oval", more_tracks=["hairpin", "oval", "hairpin"], train=False)
    assert console.client.get(f"/api/models/{name}").json()["num_tracks"] == 2
    console.client.delete(f"/api/models/{name}")


def test_when_all_words_are_taken_a_name_has_a_number() -> None:
    assert free_name(set(ANIMALS) - {"heron"}) == "heron"
    word, number = free_name(set(ANIMALS)).split("-")
    assert word in ANIMALS
    assert number == "2"


def test_a_new_model_by_the_name_of_one_in_the_trash_is_new(console: RunningConsole) -> None:
    client = console.client
    console.create(name="again", train=False, tags=["old"])
    client.delete("/api/models/again")
    console.create(name="again", train=False)
    assert client.get("/api/models/again").json()["tags"] == []
    error(client.post("/api/models/again/restore"), 409)
