"""The table of params in docs/rewards.md is the contract: every row has its key, its type and its meaning.

The types are read from the table; the meaning is `slow_params.py`, a second computation that shares nothing with the
simulator, on cars that drive real tracks in both directions, and are thrown off them.
"""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from types import GenericAlias
from typing import Any, get_args, get_origin

import numpy as np
import pytest
from slow_params import Moment, Road

from racecraft.race.autopilot import Autopilot
from racecraft.reward import make_params
from racecraft.reward.params import TEMPLATE
from racecraft.reward.worker import waypoints_of
from racecraft.sim import Simulation, Start
from racecraft.track import load_track

DOCS = Path(__file__).parents[2] / "docs" / "rewards.md"
SHARED = Path(__file__).parents[3] / "shared" / "tracks"
TYPES = {
    "bool": bool,
    "float": float,
    "list[bool]": list[bool],
    "list[float]": list[float],
    "list[int]": list[int],
    "list[tuple[float, float]]": list[tuple[float, float]],
}
UNITS = {"", "m", "m/s", "degrees", "percent", "rad", "s"}
ROW = re.compile(r"^\| `(\w+)` \| `([^`]+)` \| ([^|]*)\| ([^|]+) \|$", re.MULTILINE)
TABLE = {key: (TYPES[kind], unit.strip()) for key, kind, unit, _ in ROW.findall(DOCS.read_text(encoding="utf-8"))}

TRACKS = {
    "library": ("hairpin", "bowtie"),
    "aws": ("reinvent_base", "2024_reinvent_champ_cw", "Straight_track"),
}
START = 0.37  # of the lap
EXACT = 1e-5  # positions are float32
ROUNDING = 1e-9  # m
STRIDE = 5  # calls; every one would take half a minute
DRIVE = {"speed": 3.0, "lateral_acceleration": 2.0}


def test_the_table_has_every_key_once_and_no_other():
    assert list(TABLE) == list(TEMPLATE)
    assert {unit for _, unit in TABLE.values()} <= UNITS


@pytest.mark.parametrize("where", TRACKS)
@pytest.mark.parametrize("key", TABLE)
def test_row_of_the_table(key: str, where: str):
    kind, unit = TABLE[key]
    seen = set()
    for moment, params in calls(where):
        value, expected = params[key], getattr(moment, key)()
        assert is_of_type(value, kind), (value, kind)
        if key == "closest_waypoints" and value != expected:  # on the outside of a bend many places project on one
            expected = moment.closest_waypoints(math.copysign(ROUNDING, value[0] - expected[0]))
        assert is_same(value, expected, EXACT), f"call {moment.call}: {value}, expected {expected}"
        seen.add(repr(value))
    never_changes = key.startswith("object") or key in ("closest_objects", "is_crashed")
    assert len(seen) == 1 if never_changes else len(seen) > 1  # the drive shows something of this key
    assert bool(unit) == (kind in (float, list[float], list[tuple[float, float]]) and key != "steps")


def test_the_drive_goes_where_keys_differ():
    params = [params for _, params in calls("library")]
    assert {p["is_offtrack"] for p in params} == {p["is_reversed"] for p in params} == {True, False}
    assert any(not p["is_offtrack"] and not p["all_wheels_on_track"] for p in params)
    assert min(p["progress"] for p in params) < 0.0
    assert max(p["progress"] for p in params) == 100.0
    assert min(p["heading"] for p in params) < -170.0
    assert max(p["heading"] for p in params) > 170.0
    laps = {p["projection_distance"] > p["track_length"] * START for p in params}
    assert laps == {True, False}  # over the start line, which is not where episodes start


def test_an_action_shows_in_this_call_and_moves_the_car_for_the_next():
    track = load_track("hairpin")
    waypoints = waypoints_of([track])
    cars = Simulation(track, num_envs=2, camera=None, start=Start(mode="fixed"), num_threads=1)
    before = cars.vehicles[:3].copy()
    actions = np.array([[0.3, 1.0], [-0.2, 3.0]], np.float32)
    cars.step(actions)
    first, second = (make_params(row, waypoints) for row in cars.rows.tolist())
    assert first["steps"] == second["steps"] == 2.0
    commanded = ("speed", "steering_angle")
    assert {key for key in first if first[key] != second[key]} == set(commanded)
    assert first["x"] == pytest.approx(before[0, 0] + 0.14 * math.cos(before[2, 0]), abs=EXACT)
    assert (first["speed"], second["speed"]) == (1.0, 3.0)  # told so, while both still stand
    assert cars.column("actual_speed").tolist() == [0.0, 0.0]
    cars.step(actions[::-1])
    first, second = (make_params(row, waypoints) for row in cars.rows.tolist())
    assert first["x"] != second["x"]
    assert (first["speed"], second["speed"]) == (3.0, 1.0)


@cache
def calls(where: str) -> list[tuple[Moment, dict[str, Any]]]:
    """Laps of all tracks in both directions: each moment, and the dict that a reward function gets."""
    found = []
    for name in TRACKS[where]:
        if where == "aws" and not SHARED.is_dir():
            pytest.skip("AWS's routes are not beside this repository")
        track = load_track(str(SHARED / f"{name}.npy") if where == "aws" else name)
        route = np.load(SHARED / f"{name}.npy") if where == "aws" else _as_route(track)
        for direction in ("forward", "reverse"):
            found += list(_drive(track, Road(route, direction == "reverse"), direction))
    return found


def _drive(track, road, direction):
    """A lap with the autopilot, and beside it a car that is thrown about along the way."""
    start = Start(mode="fixed", offset=START)
    cars = Simulation(track, num_envs=2, camera=None, start=start, direction=direction, num_threads=1)
    waypoints, autopilot = waypoints_of([track]), Autopilot(**DRIVE)
    rng = np.random.default_rng(7)
    progress = [0.0, 0.0]
    for call in range(1500):
        x, y, heading = cars.vehicles[:3, 0].tolist()
        aside, turn = rng.uniform(-1.0, 1.0), rng.uniform(-3.0, 3.0)
        cars.set_pose(1, x - aside * math.sin(heading), y + aside * math.cos(heading), heading + turn)
        poses = cars.vehicles[:3].T.tolist()
        actions = autopilot(cars.state)
        actions[1] = rng.uniform((-0.5, 0.1), (0.5, 4.0))
        cars.step(actions)
        for car, row in enumerate(cars.rows.tolist()):
            command = (float(actions[car, 0]), float(actions[car, 1]))
            begin = START if track.is_closed else 0.0
            moment = Moment(road, tuple(poses[car]), command, call, begin, progress[car])
            params = make_params(row, waypoints)
            progress[car] = params["progress"] / 100.0
            if call < 3 or call % STRIDE == 0 or cars.terminated[0]:
                yield moment, params
        if cars.terminated[0]:
            assert params["steps"] > 20
            return
    raise AssertionError("the autopilot did not get round")


def _as_route(track) -> np.ndarray:
    return np.concatenate((track.centerline, track.inner, track.outer), axis=1)


def is_of_type(value: object, kind: type | GenericAlias) -> bool:
    """Exactly this type, outside and inside; a bool is no int here."""
    if get_origin(kind) is None:
        return type(value) is kind
    inner = get_args(kind)
    if type(value) is not get_origin(kind):
        return False
    return all(is_of_type(item, inner[i] if len(inner) > 1 else inner[0]) for i, item in enumerate(value))


def is_same(value: Any, expected: Any, tolerance: float) -> bool:
    if isinstance(value, float):
        return abs(value - expected) <= tolerance * max(1.0, abs(expected))
    return type(value) is type(expected) and value == expected
