"""Searches for better numbers: what may be searched, a real short one, its best trial as a model, and refusals."""

from __future__ import annotations

from typing import Any

import pytest
from full_consoles import full
from running_consoles import RunningConsole

pytest.importorskip("optuna")

pytestmark = pytest.mark.costly

REWARD = """PRÄMIE = 2.0
STEPS = 3
ZERO = 0.0


def reward_function(params):
    return float(params["speed"] * PRÄMIE * STEPS + ZERO)
"""
GAMMA = {"name": "gamma", "low": 0.95, "high": 0.99}


def refused(reply: Any, status: int, text: str = "") -> None:
    assert reply.status_code == status, reply.text
    assert text in reply.json()["error"]["message"]


@pytest.fixture(scope="module")
def model(console: RunningConsole) -> str:
    return console.create(name="seeker", track="oval", reward=REWARD, train=False, until="3 laps")


def test_what_may_be_searched(console: RunningConsole, model: str) -> None:
    space = {n["name"]: n for n in console.client.get(f"/api/models/{model}/tunings/space").json()}
    assert list(space)[:2] == ["PRÄMIE", "STEPS"]
    assert (space["PRÄMIE"]["low"], space["PRÄMIE"]["high"], space["PRÄMIE"]["default"]) == (0.5, 8.0, 2.0)
    assert space["STEPS"]["is_whole"]
    assert {name for name, number in space.items() if number["is_usual"]} == {
        "PRÄMIE", "STEPS", "learning_rate", "gamma", "ent_coef"
    }  # fmt: skip
    for number in space.values():
        assert number["low"] <= number["default"] <= number["high"]
    sac = console.create(name="sac", track="oval", reward=REWARD, train=False, algorithm="sac", actions="continuous")
    assert [n["kind"] for n in console.client.get(f"/api/models/{sac}/tunings/space").json()] == ["constant"] * 2
    refused(console.client.get("/api/models/nobody/tunings/space"), 404)


def test_a_search_tells_what_of_the_models_files_has_no_effect(console: RunningConsole) -> None:
    actions = [{"steering_angle": angle, "speed": 1.0, "index": index} for index, angle in enumerate((-30, 30))]
    metadata = {"action_space": actions, "neural_network": "RACECRAFT_SMALL", "preview": 1}
    name = console.create(name="noted", track="oval", reward=REWARD, train=False, model_metadata=metadata)
    path = f"/api/models/{name}/tunings"
    job = console.client.post(path, json={"search": [GAMMA], "trials": 1, "trial_steps": 500}).json()
    (card,) = console.client.get(path).json()
    assert card["notes"] == ["model_metadata.json: unknown field 'preview' has no effect."]
    console.client.post(f"/api/jobs/{job['id']}/cancel")
    console.wait_for(console.job_ended(job["id"]))


@pytest.mark.slow
def test_a_search_whose_best_trial_becomes_a_model(console: RunningConsole, model: str) -> None:
    client, path = console.client, f"/api/models/{model}/tunings"
    search = [{"name": "PRÄMIE", "low": 1, "high": 4}, GAMMA]
    with full(console, "train"):
        job = client.post(path, json={"search": search, "trials": 2, "trial_steps": 2000, "minutes": 5})
        assert job.status_code == 202, job.text
        card = client.get(path).json()[0]
        assert card["job"] == job.json()["id"]
        refused(client.delete(f"{path}/{card['id']}"), 409, "under way")
        refused(client.post(f"{path}/{card['id']}/keep", json={}), 404, "yet")
    ended = console.wait_for(console.job_ended(card["job"]))
    assert ended["state"] == "done", ended
    assert ended["result"]["trials"] == 2
    card = client.get(path).json()[0]
    first, second = card["trials"]
    assert first["params"] == {"PRÄMIE": 2.0, "gamma": pytest.approx(0.98, abs=0.02)}
    assert 1 <= second["params"]["PRÄMIE"] <= 4
    best = min(card["trials"], key=lambda trial: trial["value"])
    assert card["best"] == best["number"]

    kept = client.post(f"{path}/{card['id']}/keep", json={}).json()
    assert kept["name"] == f"{model}-tuned"
    assert kept["steps"] == best["steps"]
    detail = client.get(f"/api/models/{kept['name']}").json()
    assert detail["settings"]["ppo"]["gamma"] == best["params"]["gamma"]
    assert f"PRÄMIE = {best['params']['PRÄMIE']!r}" in detail["reward"]
    assert detail["checkpoints"]
    assert client.post(f"{path}/{card['id']}/keep", json={"trial": 1}).json()["name"] == f"{model}-tuned-2"
    refused(client.post(f"{path}/{card['id']}/keep", json={"name": model}), 409, "already")
    refused(client.post(f"{path}/{card['id']}/keep", json={"trial": 7}), 404, "no trial 7")
    assert client.get(f"/api/models/{model}").json()["reward"] == REWARD  # the model itself stays as it is

    assert client.delete(f"{path}/{card['id']}").status_code == 204
    assert client.get(path).json() == []
    assert client.get(f"/api/models/{kept['name']}").status_code == 200


@pytest.mark.slow
def test_a_search_is_stopped_and_one_that_fails_says_why(console: RunningConsole, model: str) -> None:
    client, path = console.client, f"/api/models/{model}/tunings"
    job = client.post(path, json={"search": [GAMMA], "trial_steps": 10**8, "minutes": 60}).json()
    (card,) = (card for card in client.get(path).json() if card["job"] == job["id"])
    console.wait_for((console.runs / ".racecraft" / "tunings" / card["id"] / "trial-0000" / "run.json").exists)
    refused(client.delete(f"/api/models/{model}"), 409, "tune")
    client.post(f"/api/jobs/{job['id']}/cancel")
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    card = client.get(path).json()[0]
    assert (card["best"], {trial["state"] for trial in card["trials"]}) == (None, {"out of time"})

    wrong = console.create(name="wrong", track="oval", train=False)
    (console.runs / wrong / "reward_function.py").write_text(
        "def reward_function(params):\n    return params['sped']\n"
    )
    job = client.post(f"/api/models/{wrong}/tunings", json={"search": [GAMMA]}).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "failed"
    assert "sped" in client.get(f"/api/models/{wrong}/tunings").json()[0]["error"]


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        ({"search": []}, "empty"),
        ({"search": [{"name": "fame", "low": 0, "high": 1}]}, "neither a constant"),
        ({"search": [{"name": "gamma", "low": 1, "high": 0}]}, "lower and a higher"),
        ({"search": [{"name": "STEPS", "low": 0.5, "high": 2}]}, "whole number"),
        ({"search": [GAMMA, GAMMA]}, "twice"),
        ({"search": [{"name": "../x", "low": 0, "high": 1}]}, "name"),
        ({"minutes": 0}, "minutes"),
        ({"trial_steps": 0}, "trial_steps"),
        ({"goal": "fame"}, "goal"),
    ],
)
def test_a_search_that_makes_no_sense(console: RunningConsole, model: str, request_: Any, text: str) -> None:
    refused(console.client.post(f"/api/models/{model}/tunings", json=request_), 422, text)


@pytest.mark.parametrize("tuning", ["x", "0" * 16, "٣"])
def test_no_search_by_another_name(console: RunningConsole, model: str, tuning: str) -> None:
    for reply in (
        console.client.delete(f"/api/models/{model}/tunings/{tuning}"),
        console.client.post(f"/api/models/{model}/tunings/{tuning}/keep", json={}),
    ):
        assert reply.status_code in (404, 405), reply.text
