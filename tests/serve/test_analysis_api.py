"""Laps, maps, saliency, report and the choices of a new model, from a real console."""

from __future__ import annotations

import base64
import json
import shutil
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from leagues import untrained_run
from model_requests import BESIDE, REQUESTS
from running_consoles import RunningConsole

from racecraft import load_track
from racecraft.analysis import read_laps
from racecraft.car.export import read_exported
from racecraft.perceiving import perceive
from racecraft.perceiving.reading import read_pictures
from racecraft.perception import Perceiver, Watcher
from racecraft.race.policy import load_policy
from racecraft.replay import read_replay
from racecraft.run import RunFolder
from racecraft.run.starters import unpack_starter
from racecraft.serve.evaluations.beliefs import REMEMBERED
from racecraft.serve.models.schemas import NewModel
from racecraft.sim.camera import CAMERAS
from racecraft.sim.views import driver_frames

pytestmark = pytest.mark.costly

GATE = "def reward_function(params):\n    return params['speed']\n"


def refused(reply: httpx.Response, status: int, text: str = "") -> None:
    assert reply.status_code == status, reply.text
    assert text in reply.json()["error"]["message"]


@pytest.fixture(scope="module")
def raced(console: RunningConsole) -> tuple[RunningConsole, str, str]:
    """A model that was trained a little and raced once; its name and the race's stamp."""
    client = console.client
    name = console.create(name="raced", track="oval", until="3000 steps", seed=1)
    job = client.get("/api/jobs", params={"run": name}).json()[0]
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    request = {"laps": 1, "num_trials": 2, "rules": "first_lap"}
    job = client.post(f"/api/models/{name}/evaluations", json=request).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    return console, name, client.get(f"/api/models/{name}/evaluations").json()[0]["stamp"]


def test_laps_with_their_sectors(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, stamp = raced
    found = console.client.get(f"/api/models/{name}/evaluations/{stamp}/laps").json()
    assert found["track"] == "oval"
    assert sum(s["end"] - s["start"] for s in found["sectors"]) == pytest.approx(found["length"])
    assert [lap["number"] for lap in found["laps"]] == [1, 2]
    for lap in found["laps"]:
        assert len(lap["passages"]) == len(found["sectors"])
        columns = ("time", "share", "x", "y", "heading", "speed", "throttle", "steering", "reward")
        assert len({len(lap[column]) for column in columns}) == 1
    for wrong in ("20200101000000", "x", "..", "٣"):
        refused(console.client.get(f"/api/models/{name}/evaluations/{wrong}/laps"), 404)


def test_laps_have_the_reward_of_their_own_training(raced: tuple[RunningConsole, str, str]) -> None:
    """And not AWS's default for the centre line, which is all that an evaluation's files know."""
    console, name, stamp = raced
    client, path = console.client, f"/api/models/{name}/evaluations/{stamp}/laps"
    before = client.get(path).json()
    assert before["reward"] == {"stretch": 1, "stretches": 1, "is_afresh": False, "error": None}
    x_pays = "BEFORE = {}\ndef reward_function(params):\n    BEFORE['x'] = params['x']\n    return 100 * params['x']\n"
    steps = client.get(f"/api/models/{name}").json()["steps"]
    job = client.post(f"/api/models/{name}/train", json={"reward": x_pays, "until": f"{steps + 1024} steps"}).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    after = client.get(path).json()
    assert after["reward"] == {"stretch": 1, "stretches": 2, "is_afresh": False, "error": None}
    assert [lap["reward"] for lap in after["laps"]] == [lap["reward"] for lap in before["laps"]]
    request = {"laps": 1, "num_trials": 2, "rules": "first_lap", "checkpoint": "last"}
    job = client.post(f"/api/models/{name}/evaluations", json=request).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    newest = client.get(f"/api/models/{name}/evaluations").json()[0]["stamp"]
    found = client.get(f"/api/models/{name}/evaluations/{newest}/laps").json()
    assert found["reward"] == {"stretch": 2, "stretches": 2, "is_afresh": True, "error": None}
    for lap in found["laps"]:
        asked = [(x, paid) for x, paid in zip(lap["x"], lap["reward"], strict=True) if paid is not None]
        assert len(asked) > 3
        assert all(paid == pytest.approx(100 * x, abs=0.02) for x, paid in asked)


def test_saliency_of_one_moment(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, stamp = raced
    path = f"/api/models/{name}/evaluations/{stamp}/saliency"
    seen = console.client.get(path, params={"lap": 1, "row": 3}).json()
    assert (seen["method"], seen["layer"]) == ("Grad-CAM", "conv2")
    size = seen["height"] * seen["width"]
    frame, picture = (base64.b64decode(seen[key]) for key in ("frame", "saliency"))
    assert len(frame) == len(picture) == size
    assert len(set(frame)) > 10
    assert max(picture) == 255
    assert sum(seen["policy"]) == pytest.approx(1, abs=1e-3)
    assert seen["target"] == max(range(len(seen["policy"])), key=seen["policy"].__getitem__)
    other = console.client.get(path, params={"lap": 1, "row": 3, "target": 0}).json()
    assert other["target"] == 0
    document = (console.runs / name / "run.json").read_text()
    (console.runs / name / "run.json").write_text(document.replace('"camera": "2018"', '"camera": "2026"'))
    lap = read_laps(console.runs / name / f"evaluation-{stamp}" / "evaluation-simtrace" / "0-iteration.csv")[0]
    fast = int(lap.speed.argmax())
    try:
        in_2026 = console.client.get(path, params={"lap": 1, "row": 3}).json()
        aged = [
            console.client.get(path.replace("saliency", what), params={"lap": 1, "row": fast}).json()["frame"]
            for what in ("saliency", "belief")
        ]
    finally:
        (console.runs / name / "run.json").write_text(document)
    looks = [np.frombuffer(pixels, np.uint8).astype(int) for pixels in (frame, base64.b64decode(in_2026["frame"]))]
    assert np.abs(looks[0] - looks[1]).mean() > 4.0  # of 255
    camera = CAMERAS["2026"]
    then, now = (driver_frames(load_track("oval"), [lap.seen_from(age)[fast]], camera) for age in (camera.age, 0.0))
    taken, colours = (np.frombuffer(base64.b64decode(one), np.uint8).reshape(then[0].shape).astype(int) for one in aged)
    assert (taken == then[0]).all()
    assert np.abs(colours - then[0]).mean() < 1.0 < np.abs(colours - now[0]).mean()
    refused(console.client.get(path, params={"lap": 9, "row": 3}), 404, "no step 3 in lap 9")
    refused(console.client.get(path, params={"lap": 1, "row": 10**6}), 404)
    refused(console.client.get(path, params={"lap": 1, "row": 3, "target": 50}), 404, "no output 50")
    refused(console.client.get(path, params={"lap": 1}), 422, "row")


def test_what_perception_believes_of_one_moment(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, stamp = raced
    path = f"/api/models/{name}/evaluations/{stamp}/belief"
    track = load_track("oval")
    lap = console.client.get(f"/api/models/{name}/evaluations/{stamp}/laps").json()["laps"][0]
    for row in (1, 3):
        seen = console.client.get(path, params={"lap": 1, "row": row}).json()
        frame = base64.b64decode(seen["frame"])
        assert len(frame) == seen["height"] * seen["width"]
        drawn = console.client.get(path.replace("belief", "saliency"), params={"lap": 1, "row": row}).json()
        colours = np.frombuffer(frame, np.uint8).astype(int) - np.frombuffer(base64.b64decode(drawn["frame"]), np.uint8)
        assert np.abs(colours).mean() < 1.0  # the policy's own picture, but for how colours are mixed at edges
        assert seen["on_road"]
        _, left = track.project([lap["x"][row], lap["y"][row]])
        assert seen["offset_m"] == pytest.approx(float(left), abs=0.05)
        assert len(seen["line_rows"]) == len(seen["line_columns"]) == len(seen["line_error"]) > 3
        assert np.shape(seen["regions"]) == (len(seen["region_rows"]), len(seen["region_columns"]))
        assert seen["distance_m"] is None
    sensors = console.runs / name / "model_metadata.json"
    document = sensors.read_text()
    sensors.write_text(json.dumps({**json.loads(document), "sensor": ["LEFT_CAMERA"]}))
    try:
        beside = console.client.get(path, params={"lap": 1, "row": 3}).json()
        drawn = console.client.get(path.replace("belief", "saliency"), params={"lap": 1, "row": 3}).json()
    finally:
        sensors.write_text(document)
    assert beside["offset_m"] - seen["offset_m"] == pytest.approx(0.03, abs=0.015)
    looks = [np.frombuffer(base64.b64decode(one["frame"]), np.uint8).astype(int) for one in (seen, beside, drawn)]
    assert np.abs(looks[1] - looks[0]).mean() > 3.0
    assert np.abs(looks[1] - looks[2]).mean() < 1.0
    refused(console.client.get(path, params={"lap": 9, "row": 3}), 404, "no step 3 in lap 9")
    refused(console.client.get(path, params={"lap": 1, "row": 10**6}), 404)


def test_perception_believes_of_a_lap_what_its_command_says(raced: tuple[RunningConsole, str, str]) -> None:
    """The command looks at the replay, the console at the trace; both know the pictures before and what was told."""
    console, name, stamp = raced
    folder = console.runs / name / f"evaluation-{stamp}"
    number = read_replay(folder / "evaluation.replay").evaluation.best_trial.index + 1
    lap = next(one for one in read_laps(folder / "evaluation-simtrace" / "0-iteration.csv") if one.number == number)
    pictures = list(read_pictures([folder / "evaluation.replay"]))
    commands = np.array([picture.commands or (np.nan, np.nan) for picture in pictures])
    np.testing.assert_allclose(lap.commands, commands, atol=1e-7)
    assert np.isfinite(commands).all(axis=1).sum() > 10

    said = perceive([folder / "evaluation.replay"], num_threads=1)
    path = f"/api/models/{name}/evaluations/{stamp}/belief"
    rows = [row for row in range(min(len(said), REMEMBERED)) if said[row]["on_road"]]  # beside it nobody knows much
    told = [console.client.get(path, params={"lap": number, "row": row}).json() for row in rows]
    seen = np.stack([picture.seen for picture in pictures])
    silent = Watcher(Perceiver(num_threads=1)).film(seen, np.array([picture.is_first for picture in pictures]))
    without = np.stack([silent.heading, silent.offset], axis=1)[rows]
    ours, theirs = (np.array([[one["heading_rad"], one["offset_m"]] for one in them]) for them in (told, said))
    away, untold = (np.abs(them - theirs[rows]).mean(axis=0) for them in (ours, without))
    assert (away < 0.003).all()  # rad and m: only how the pictures are made small differs
    assert (untold > 2 * away).all()  # who is not told believes something else


def test_perception_remembers_a_lap_in_the_next_one(console: RunningConsole) -> None:
    folder = unpack_starter("quick", console.runs)
    request = {"track": "oval", "laps": 2, "num_trials": 1, "rules": "drfc"}
    job = console.client.post(f"/api/models/{folder.name}/evaluations", json=request).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    (evaluation,) = folder.glob("evaluation-*/evaluation.replay")
    laps = read_laps(evaluation.parent / "evaluation-simtrace" / "0-iteration.csv")
    assert [lap.goes_on for lap in laps] == [False, True]
    said = perceive([evaluation], num_threads=1)[len(laps[0].time) :]
    path = f"/api/models/{folder.name}/evaluations/{evaluation.parent.name.removeprefix('evaluation-')}/belief"
    told = [console.client.get(path, params={"lap": 2, "row": row}).json() for row in range(4)]
    ours, theirs = (np.array([[one["heading_rad"], one["offset_m"]] for one in them]) for them in (told, said[:4]))
    away = np.abs(ours - theirs).mean(axis=0)  # rad and m; 0.0056 and 0.0058 without the lap before
    assert (away < 0.002).all()


def test_a_model_for_a_car_and_driven_as_one(raced: tuple[RunningConsole, str, str], tmp_path: Path) -> None:
    console, name, _ = raced
    client, path = console.client, f"/api/models/{name}/export"
    notes = client.get(path).json()
    assert notes["network"] == "RACECRAFT_SMALL"
    assert any("throttle" in note for note in notes["notes"])
    reply = client.get(f"{path}/car")
    assert reply.headers["Content-Disposition"] == f'attachment; filename="{name}.tar.gz"'
    archive = tmp_path / "archive.tar.gz"
    archive.write_bytes(reply.content)
    own = load_policy(RunFolder.open(console.runs / name))[1]
    weights = own.learner.weights()
    for key, array in read_exported(archive).learner.weights().items():
        if key.startswith("policy."):
            assert np.array_equal(array, weights[key]), key
    assert client.get(f"{path}/onnx").headers["Content-Disposition"] == f'attachment; filename="{name}.onnx"'
    refused(client.get(f"{path}/toaster"), 422, "target")
    refused(client.get(f"{path}/car", params={"checkpoint": "../x"}), 422, "checkpoint")
    refused(client.get(f"{path}/car", params={"checkpoint": "77"}), 404, f"{name!r} has no checkpoint 77")

    request = {"laps": 1, "num_trials": 1, "rules": "first_lap", "as_car": True}
    job = client.post(f"/api/models/{name}/evaluations", json=request).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    cards = client.get(f"/api/models/{name}/evaluations").json()
    assert [card["as_car"] for card in cards[:2]] == [True, False]
    assert cards[1]["commands"] is None
    picture = client.get(f"/api/models/{name}/files/{cards[0]['commands']}")
    assert picture.headers["Content-Type"] == "image/png"


def test_a_model_that_no_car_can_drive_says_why(console: RunningConsole) -> None:
    name = untrained_run(console.runs, "seer", sensors=("FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR")).name
    refused(console.client.get(f"/api/models/{name}/export"), 422, "DISCRETIZED_SECTOR_LIDAR")
    assert console.client.get(f"/api/models/{name}/export/onnx").status_code == 200


def test_maps_of_a_training(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, _ = raced
    maps = console.client.get(f"/api/models/{name}/maps").json()
    assert maps["shown"] == maps["iterations"]
    assert sum(map(sum, maps["visits"])) == maps["rows"] > 100
    assert len(maps["grid"]) == len(maps["visits"]) + 1
    assert sum(maps["usage"]) == pytest.approx(1, abs=1e-3)
    none = console.client.get(f"/api/models/{name}/maps", params={"first": 999}).json()
    assert none["shown"] == []
    assert none["rows"] == 0
    fresh = console.create(name="fresh", train=False)
    assert console.client.get(f"/api/models/{fresh}/maps").json()["iterations"] == []


def test_a_track_that_was_redrawn_is_not_shown_under_older_laps(console: RunningConsole) -> None:
    client, stranger = console.client, untrained_run(console.runs, "stranger").name
    drawings = [client.get(f"/api/tracks/{name}/sketch").json() for name in ("oval", "hairpin")]

    def draw(drawing: Any) -> None:
        reply = client.put("/api/tracks/mine", params={"replace": True}, json=drawing)
        assert reply.status_code == 200, reply.text

    def race(name: str) -> str:
        request = {"laps": 1, "num_trials": 1, "rules": "first_lap", "track": "mine"}
        job = client.post(f"/api/models/{name}/evaluations", json=request).json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        return str(client.get(f"/api/models/{name}/evaluations").json()[0]["stamp"])

    def shown(name: str, stamp: str) -> list[httpx.Response]:
        moment = {"lap": 1, "row": 3}
        of_laps = [f"evaluations/{stamp}/{part}" for part in ("laps", "saliency", "belief")]
        return [client.get(f"/api/models/{name}/{route}", params=moment) for route in of_laps]

    def of_training(name: str) -> list[httpx.Response]:
        return [client.get(f"/api/models/{name}/{route}") for route in ("maps", "report")]

    draw(drawings[0])
    name = console.create(name="homebody", track="mine", until="1500 steps", seed=1)
    job = client.get("/api/jobs", params={"run": name}).json()[0]
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    stamps = {name: race(name), stranger: race(stranger)}
    draw(drawings[0])  # the same again
    for model, stamp in stamps.items():
        assert [reply.status_code for reply in shown(model, stamp) + of_training(model)] == [200] * 5
    summary = console.runs / name / f"evaluation-{stamps[name]}" / "evaluation.json"
    document = json.loads(summary.read_text())
    older = json.dumps({key: value for key, value in document.items() if key != "track_digest"})
    summary.write_text(older)
    assert [reply.status_code for reply in shown(name, stamps[name])] == [200] * 3

    draw(drawings[1])
    evaluated = "The track 'mine' was changed since this model was evaluated on it."
    trained = "The track 'mine' was changed since this model was trained on it."
    replies = [(reply, evaluated) for model, stamp in stamps.items() for reply in shown(model, stamp)]
    replies += [(reply, trained) for reply in of_training(name)]
    summary.write_text(json.dumps(document))
    replies += [(reply, evaluated) for reply in shown(name, stamps[name])]
    for reply, text in replies:
        assert reply.status_code == 409, reply.text
        assert reply.json()["error"]["message"] == text
        assert reply.json()["error"]["hint"] == "Train a new model on it."
    assert client.get(f"/api/models/{stranger}/maps").status_code == 200
    assert client.get(f"/api/models/{name}/evaluations/{stamps[name]}/share.png").status_code == 200

    draw(drawings[0])
    for model, stamp in stamps.items():
        assert [reply.status_code for reply in shown(model, stamp) + of_training(model)] == [200] * 5

    assert client.delete("/api/tracks/mine").status_code == 204
    for reply in [*(reply for model, stamp in stamps.items() for reply in shown(model, stamp)), *of_training(name)]:
        refused(reply, 404, "The track 'mine' is not there any more.")
    assert client.get(f"/api/models/{stranger}/maps").status_code == 200


def test_the_report_is_a_file_to_keep(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, _ = raced
    reply = console.client.get(f"/api/models/{name}/report")
    assert reply.headers["content-type"].startswith("text/html")
    assert reply.headers["content-disposition"] == f'attachment; filename="{name}-report.html"'
    assert "Laps of the last evaluation" in reply.text


def test_a_reward_pays_the_last_laps_of_a_model_anew(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, _ = raced
    request = {"source": GATE, "track": "oval", "run": name}
    laps = console.client.post("/api/rewards/check", json=request).json()["laps"]
    newest = console.client.get(f"/api/models/{name}/evaluations").json()[0]["stamp"]
    driven = console.client.get(f"/api/models/{name}/evaluations/{newest}/laps").json()["laps"]
    assert len(laps) == len(driven) > 0
    assert all(len(lap["points"]) == len(lap["rewards"]) > 3 for lap in laps)
    # m/s: the two speeds of its actions, or what a physical car's throttle makes of the slower one
    assert {round(reward, 3) for lap in laps for reward in lap["rewards"]} <= {1.0, 1.6, 2.0}
    elsewhere = {**request, "track": "hairpin"}
    assert console.client.post("/api/rewards/check", json=elsewhere).json()["laps"] == []
    refused(console.client.post("/api/rewards/check", json={**request, "run": "nobody"}), 404)


def test_choices_can_all_be_chosen(console: RunningConsole) -> None:
    choices = console.client.get("/api/choices").json()
    assert {"lr", "batch_size", "beta_entropy"} <= {number["name"] for number in choices["hyperparameters"]}
    for number in choices["hyperparameters"]:
        assert number["low"] <= number["safe_low"] < number["safe_high"] <= number["high"]
        assert number["low"] <= number["default"] <= number["high"]
    for key, field in (
        ("vehicles", "vehicle"),
        ("races", "race"),
        ("randomizations", "randomize"),
        ("critics", "critic"),
    ):
        for choice in choices[key]:
            console.create(track="oval", train=False, **{field: choice})
    console.create(track="oval", train=False, sensors=[choices["sensors"][0]], network=choices["networks"][0])
    for algorithm in choices["algorithms"]:
        actions = "continuous" if algorithm == "sac" else "default"
        console.create(track="oval", train=False, algorithm=algorithm, actions=actions)
    console.create(track="oval", train=False, hyperparameters=choices["aws"])
    console.create(track="oval", train=False, tuning=choices["fast"])


def test_a_race_among_bots_tuned_by_hand(console: RunningConsole) -> None:
    tuning = {"lr": 0.002, "discount_factor": 0.97, "loss_type": "huber"}
    race = {"race": "head-to-bot", "objects": 2, "bot_speed": 0.4, "lane_changes": True}
    actions = [{"steering_angle": angle, "speed": 1.5} for angle in (-20, 0, 20)]
    metadata = {"action_space": actions, "neural_network": "RACECRAFT_SMALL", "sensor": ["FRONT_FACING_CAMERA"]}
    name = console.create(track="oval", train=False, tuning=tuning, model_metadata=metadata, **race)
    detail = console.client.get(f"/api/models/{name}").json()
    assert detail["settings"]["ppo"]["learning_rate"] == 0.002
    assert detail["settings"]["ppo"]["gamma"] == 0.97
    assert detail["settings"]["ppo"]["value_loss"] == "huber"
    assert detail["settings"]["objects"]["bots"]["count"] == 2
    assert len(detail["model_metadata"]["action_space"]) == 3


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"objects": 3}, "time-trial"),
        ({"race": "demolition"}, "demolition"),
        ({"randomize": "/etc/passwd"}, "randomize"),
        ({"critic": "film"}, "film"),
        ({"algorithm": "luck"}, "luck"),
        ({"algorithm": "sac"}, "continuous"),
        ({"algorithm": "sac", "actions": "continuous", "tuning": {}}, "tuning"),
        ({"sensors": ["NOSE"]}, "NOSE"),
        ({"tuning": {"lr": 1.0}}, "lr"),
        ({"tuning": {"lr": 0.001}, "hyperparameters": {}}, "tuning"),
        ({"sensors": ["FRONT_FACING_CAMERA"], "model_metadata": {}}, "sensors"),
        ({"vehicle": "/etc/passwd"}, "vehicle"),
        ({"vehicle": {"masses": 2.0}}, "masses"),
        ({"vehicle": {"mass": -1.0}}, "mass"),
        ({"randomize": {"weather": [0, 1]}}, "weather"),
        ({"randomize": {"friction": [2, 1]}}, "friction"),
        ({"bot_speed": 1.0}, "bot_speed"),
        ({"race": "head-to-bot", "parked_cars": True}, "parked_cars"),
        ({"race": "head-to-head", "positions": [[0.5, 1]]}, "positions"),
    ],
)
def test_choices_that_do_not_go_together(console: RunningConsole, settings: dict[str, Any], text: str) -> None:
    refused(console.client.post("/api/models", json={"train": False, **settings}), 422, text)


def test_a_model_of_many_tracks_names_one_that_there_is(console: RunningConsole) -> None:
    run = untrained_run(console.runs, "one")
    document = json.loads((run.path / "run.json").read_text())
    for name, track, shown in (
        ("many", "oval + generated:0..2", ("oval", 4)),
        ("mine", str(console.runs / "my-own.npy"), ("my-own", 1)),
    ):
        shutil.copytree(run.path, console.runs / name, dirs_exist_ok=True)
        (console.runs / name / "run.json").write_text(json.dumps({**document, "track": track}))
        card = console.client.get(f"/api/models/{name}").json()
        assert (card["track"], card["num_tracks"]) == shown


def test_a_lap_is_sent_as_one_file(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, stamp = raced
    address = f"/api/models/{name}/evaluations/{stamp}/share"
    page = console.client.get(f"{address}.html", params={"language": "de"})
    assert page.headers["content-disposition"] == 'attachment; filename="raced.html"'
    assert '<html lang="de">' in page.text
    assert "raced.replay" in page.text
    picture = console.client.get(f"{address}.png")
    assert picture.headers["content-type"] == "image/png"
    assert picture.content.startswith(b"\x89PNG")
    refused(console.client.get(f"/api/models/{name}/evaluations/20200101000000/share.html"), 404)
    assert console.client.get(f"{address}.html", params={"language": "xx"}).status_code == 422


def test_how_it_learned_is_shown_and_filmed(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, _ = raced
    found = console.client.get(f"/api/models/{name}/evolution").json()
    laps = found["laps"]
    assert len(laps) > 1
    assert [lap["step"] for lap in laps] == sorted({lap["step"] for lap in laps})
    ranks = [(lap["completion"], -(lap["seconds"] or 1e6)) for lap in laps[:-1]]
    assert ranks == sorted(set(ranks))
    starts = {tuple(lap["poses"][0]) for lap in laps[:-1]}
    assert len(starts) == 1
    assert found["film"] is None
    job = console.client.post(f"/api/models/{name}/evolution").json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    film = console.client.get(f"/api/models/{name}/evolution").json()["film"]
    assert console.client.get(f"/api/models/{name}/files/{film}").headers["content-type"] == "video/mp4"


def test_notes_are_kept_in_the_run(raced: tuple[RunningConsole, str, str]) -> None:
    console, name, _ = raced
    address = f"/api/models/{name}"
    assert console.client.get(address).json()["notes"] == ""
    assert console.client.patch(address, json={"notes": "Läuft.\n<b>"}).status_code == 200
    assert console.client.get(address).json()["notes"] == "Läuft.\n<b>"
    assert (console.runs / name / "notes.md").read_text(encoding="utf-8") == "Läuft.\n<b>"
    assert console.client.patch(address, json={"notes": "x" * 20_001}).status_code == 422
    assert console.client.patch(address, json={"notes": " "}).status_code == 200
    assert not (console.runs / name / "notes.md").exists()


def test_a_model_says_what_it_is_made_of(raced: tuple[RunningConsole, str, str]) -> None:
    """So that the request which it answers with makes the same one again."""
    console, name, _ = raced
    request = console.client.get(f"/api/models/{name}/again").json()
    request["tuning"].pop("loss_type")
    copy = console.client.post("/api/models", json={**request, "name": "again", "train": False})
    assert copy.status_code == 201, copy.text
    first, second = (console.client.get(f"/api/models/{one}").json() for one in (name, "again"))
    for key in ("reward", "model_metadata", "settings", "seed", "track", "until"):
        assert first[key] == second[key], key
    boxes = {"name": "boxes", "track": "oval", "race": "object-avoidance", "objects": 4, "randomize": "light"}
    console.create(train=False, **boxes)
    request = console.client.get("/api/models/boxes/again").json()
    assert boxes.items() <= {**request, "name": "boxes"}.items()


@pytest.mark.parametrize("settings", REQUESTS, ids=lambda settings: settings.get("race", "time-trial"))
def test_every_field_of_a_request_comes_back_for_a_copy(
    raced: tuple[RunningConsole, str, str], settings: dict[str, Any]
) -> None:
    console, driven, _ = raced
    asked = settings | ({"opponents": [driven]} if "opponents" in settings else {})
    name = console.create(train=False, **asked)
    request = console.client.get(f"/api/models/{name}/again").json()
    for field, value in asked.items():
        if field == "sensors":
            assert request["model_metadata"]["sensor"] == value
        elif field == "actions":
            assert NewModel(**request).model_metadata is not None
        elif isinstance(value, dict):
            assert {key: request[field][key] for key in value} == value, field
        else:
            assert request[field] == value, field
    copy = console.create(train=False, **{key: value for key, value in request.items() if key not in BESIDE})
    first, second = (console.client.get(f"/api/models/{one}").json() for one in (name, copy))
    for key in ("reward", "model_metadata", "hyperparameters", "settings", "seed", "track", "num_tracks", "until"):
        assert first[key] == second[key], key
