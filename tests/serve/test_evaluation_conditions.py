"""Evaluations in another car, under other conditions and rules than a model learned with: what they drive and tell."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from running_consoles import RunningConsole

from racecraft.race.recording import Recording
from racecraft.replay import Replay, read_replay, verify
from racecraft.run import RunFolder
from racecraft.serve.evaluations.tasks import settings_of
from racecraft.sim.objects import Obstacles
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import PRESETS, Vehicle

CAR: dict[str, float] = {"mass": 9.5, "speed_gain": 0.3}
RANGES: dict[str, list[float]] = {"friction": [0.5, 0.5], "blur": [0.0, 1.5]}
JSON = {"Content-Type": "application/json"}
SHORT: dict[str, Any] = {"rules": "first_lap", "laps": 1, "num_trials": 1, "seed": 3}


@pytest.fixture(scope="module")
def ada(console: RunningConsole) -> str:
    name = console.create(name="ada", track="oval", until="2000 steps", seed=1, vehicle="v4")
    (job,) = console.client.get("/api/jobs", params={"run": name}).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    return name


def evaluated(console: RunningConsole, name: str, **asked: Any) -> tuple[dict[str, Any], Replay]:
    """What its card tells, and its replay."""
    reply = console.client.post(f"/api/models/{name}/evaluations", json=SHORT | asked)
    assert reply.status_code == 202, reply.text
    ended = console.wait_for(console.job_ended(reply.json()["id"]))
    assert ended["state"] == "done", ended
    card = console.client.get(f"/api/models/{name}/evaluations").json()[0]
    path = RunFolder(console.runs / name).evaluation_replay(card["stamp"])
    return card, read_replay(path)


def _driven(recording: Recording) -> float:
    """Metres in the first second."""
    return float(np.hypot(*np.diff(recording.poses[:15, :2], axis=0).T).sum())


def test_jobs_from_before_there_was_a_choice_are_as_learned() -> None:
    before = {"laps": 3, "num_trials": 5, "rules": "drfc", "checkpoint": "best", "seed": 0, "as_car": False}
    assert settings_of(before) == before


@pytest.mark.costly
def test_another_car_drives_other_laps_and_is_told(console: RunningConsole, ada: str) -> None:
    card, usual = evaluated(console, ada)
    told = card["held"]
    assert (told["vehicle"], told["randomize"], told["seed"]) == ("v4", "none", 3)
    assert (told["rules"]["direction"], told["objects"]["obstacles"]) == ("forward", None)
    assert "conditions" not in card["summary"]  # the same once more
    assert usual.conditions.vehicle == PRESETS["v4"]

    card, own = evaluated(
        console,
        ada,
        **{"vehicle": CAR, "randomize": RANGES, "direction": "reverse", "offtrack_penalty": 1.5, "max_resets": 2},
        **{"race": "object-avoidance", "objects": 3, "parked_cars": True, "collision_penalty": 2.5},
    )
    told = card["held"]
    assert (told["vehicle"], told["randomize"]) == (CAR, RANGES)
    rules = {"direction": "reverse", "offtrack_penalty": 1.5, "collision_penalty": 2.5, "max_resets": 2}
    assert told["rules"].items() >= rules.items()
    assert (told["objects"]["obstacles"]["count"], told["objects"]["obstacles"]["kind"]) == (3, "car")
    conditions = own.conditions
    assert conditions.vehicle == Vehicle(mass=9.5, speed_gain=0.3)
    assert conditions.randomize == Randomization(friction=(0.5, 0.5), blur=(0.0, 1.5))
    assert conditions.objects.obstacles == Obstacles(count=3, kind="car", placement="even")
    assert verify(own).is_genuine
    distances = [_driven(replay.cars[0].recording) for replay in (usual, own)]
    assert distances[1] < 0.7 * distances[0]  # the other car is slower, whatever the same model asks of it

    laps = console.client.get(f"/api/models/{ada}/evaluations/{card['stamp']}/laps").json()
    assert {len(lap["objects"]) for lap in laps["laps"]} == {3}


@pytest.mark.costly
def test_as_a_car_drives_it_in_the_car_and_the_conditions_that_are_asked(console: RunningConsole, ada: str) -> None:
    card, replay = evaluated(console, ada, as_car=True, vehicle="v6", randomize="light")
    assert card["as_car"]
    assert (card["held"]["vehicle"], card["held"]["randomize"]) == ("v6", "light")
    assert replay.conditions.vehicle == PRESETS["v6"]


def test_what_cannot_be_is_refused_before_it_waits(console: RunningConsole, ada: str) -> None:
    for asked, message in (
        ({"vehicle": "v4.json"}, "allowed are v4, v5 and v6"),
        ({"vehicle": ""}, "allowed are v4, v5 and v6"),
        ({"vehicle": {"mas": 3}}, "A vehicle has no parameter 'mas'."),
        ({"vehicle": {"mass": -1}}, "mass"),
        ({"randomize": "../x.json"}, "allowed are none, light, strong, aws, real"),
        ({"randomize": {"blurr": [0, 1]}}, "randomize has no quantity 'blurr'."),
        ({"randomize": {"mass": [1, 1e6]}}, "mass"),
        ({"vehicle": {"mass": 9.9}, "randomize": {"mass": [1, 9]}}, "mass"),
        ({"direction": "sideways"}, "direction"),
        ({"offtrack_penalty": -1}, "offtrack_penalty"),
        ({"max_resets": -1}, "max_resets"),
        ({"race": "head-to-head"}, "race"),
        ({"objects": 3}, "objects goes with a race: time-trial, object-avoidance or head-to-bot."),
        ({"race": "time-trial", "bot_speed": 0.5}, "bot_speed goes with the race head-to-bot"),
        ({"race": "object-avoidance", "objects": 10**6}, "objects"),
    ):
        reply = console.client.post(f"/api/models/{ada}/evaluations", json=asked)
        assert reply.status_code == 422, (asked, reply.text)
        assert message in reply.text, (asked, reply.text)
    for number in ("NaN", "Infinity"):
        body = f'{{"vehicle": {{"mass": {number}}}}}'
        reply = console.client.post(f"/api/models/{ada}/evaluations", content=body, headers=JSON)
        assert reply.status_code == 422, reply.text
        told = f"Vehicle parameter mass is {float(number)}; allowed is a number from 0.1 to 1000."
        assert reply.json()["error"]["message"] == told
