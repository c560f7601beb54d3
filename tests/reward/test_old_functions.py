"""Functions of 2018 take twelve values instead of a dict, as AWS called them; what those of 2019 wait for is told."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft.race.autopilot import Autopilot
from racecraft.reward import RewardWorker, check_reward, dry_run, make_params
from racecraft.reward.worker import waypoints_of
from racecraft.sim import Simulation, Start
from racecraft.track import load_track

NAMES = (
    *("on_track", "x", "y", "distance_from_center", "car_orientation", "progress", "steps", "throttle", "steering"),
    *("track_width", "waypoints"),
)
OFF_TRACK = 1e-8  # what AWS's simulator of that time paid, without a call


def source_of(body: str, last: str = "closest_waypoint") -> str:
    return f"def reward_function({', '.join((*NAMES, last))}):\n    return {body}\n"


def drive(num_steps: int) -> list[np.ndarray]:
    """Judged rows of a car that follows the road, and of one that leaves it."""
    cars = Simulation(
        load_track("reinvent_2018"), num_envs=2, camera=None, start=Start(mode="fixed"), num_threads=1, seed=3
    )
    autopilot, found = Autopilot(speed=2.0), []
    for _ in range(num_steps):
        actions = autopilot(cars.state)
        actions[1] = (0.3, 2.0)
        cars.step(actions)
        found.append(cars.rows.copy())
        cars.reset(cars.terminated)
    return found


EXPECTED = {  # by name, from the dict that the same row gives
    "on_track": lambda p: p["all_wheels_on_track"],
    "x": lambda p: p["x"],
    "y": lambda p: p["y"],
    "distance_from_center": lambda p: p["distance_from_center"],
    "car_orientation": lambda p: math.radians(p["heading"]),
    "progress": lambda p: p["progress"],
    "steps": lambda p: p["steps"] - 1,
    "throttle": lambda p: p["speed"],
    "steering": lambda p: math.radians(p["steering_angle"]),
    "track_width": lambda p: p["track_width"],
    "waypoints[7][1]": lambda p: p["waypoints"][7][1],
    "closest_waypoint": lambda p: min(
        p["closest_waypoints"], key=lambda index: math.dist(p["waypoints"][index], (p["x"], p["y"]))
    ),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_a_value_is_what_aws_gave(name: str):
    track = load_track("reinvent_2018")
    steps, waypoints = drive(60), waypoints_of([track])
    with RewardWorker(source_of(name), [track]) as worker:
        rewards = np.stack([worker(rows) for rows in steps])
    dicts = [[make_params(row.tolist(), waypoints) for row in rows] for rows in steps]
    expected = np.array([[0.0 if p["steps"] == 1 else EXPECTED[name](p) for p in one] for one in dicts], float)
    is_off = np.array([[p["is_offtrack"] for p in one] for one in dicts])
    assert is_off.any()
    assert rewards[~is_off] == pytest.approx(expected[~is_off], abs=1e-12)
    assert (rewards[is_off] == OFF_TRACK).all()
    assert len(np.unique(rewards)) > 1


@pytest.mark.parametrize("last", ["closest_waypoint", "closest_waypoints"])
def test_it_is_fit_for_training(last: str):
    source = source_of("float(track_width - distance_from_center + isinstance(steps, int))", last)
    assert check_reward(source) == []
    assert all(outcome.error is None for outcome in dry_run(source, load_track("oval")))


def test_other_parameters_are_refused():
    for names in (NAMES[:-1], ("params", *NAMES[1:]), (*NAMES, "closest_waypoint", "speed")):
        problems = check_reward(f"def reward_function({', '.join(names)}, last):\n    return 1.0\n")
        assert "parameters, expected exactly one" in problems[0].message


def asking(test: str) -> str:
    return f"steps = 5\ndef reward_function(params, self=None):\n    if {test}:\n        return 2.0\n    return 1.0\n"


@pytest.mark.parametrize("test", ["steps == 0", "params['steps'] == 1", "steps <= 1.0", "self.steps < 2", "steps < 1"])
def test_a_step_that_no_call_sees_is_told(test: str):
    (problem,) = check_reward(asking(test))
    assert (problem.severity, problem.line, problem.column) == ("warning", 3, 8)
    assert "an episode's first call has steps 2" in problem.message
    assert "steps 2" not in str(check_reward(source_of(f"1.0 if {test} else 0.0", "self")))  # there it has steps 1


@pytest.mark.parametrize(
    "test", ["steps == 2", "steps > 1", "steps < 3", "steps <= 2", "steps % 9 == 0", "self.laps == 0"]
)
def test_a_step_that_a_call_sees_is_not_told(test: str):
    assert check_reward(asking(test)) == []


def test_an_error_has_its_line():
    with RewardWorker(source_of("1.0 / (steering * 0.0)"), [load_track("reinvent_2018")]) as worker:
        rows = drive(3)[-1]
        with pytest.raises(Exception, match=r"line 2"):
            worker(rows)
