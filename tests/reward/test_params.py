"""The params dict has AWS's keys, types and units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.agent import PRESETS, DiscreteActionSpace, action_space
from racecraft.race.autopilot import Autopilot
from racecraft.reward.params import TEMPLATE, format_params, make_params
from racecraft.reward.worker import waypoints_of
from racecraft.sim import Simulation, Start
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.track import load_track

WAYPOINTS = [[(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)], [(5.0, 5.0), (6.0, 5.0), (5.0, 5.0)]]

# key, columns of the row, what the function sees
CASES = [
    ("all_wheels_on_track", {"all_wheels_on_track": 1.0}, True),
    ("all_wheels_on_track", {"all_wheels_on_track": 0.0}, False),
    ("x", {"x": 1.25}, 1.25),
    ("y", {"y": -2.5}, -2.5),
    ("heading", {"heading": math.pi / 2}, 90.0),
    ("heading", {"heading": -math.pi / 4}, -45.0),
    ("heading", {"heading": math.pi}, 180.0),
    ("heading", {"heading": -math.pi}, -180.0),
    ("heading", {"heading": math.radians(190)}, pytest.approx(-170.0)),
    ("heading", {"heading": math.radians(-200)}, pytest.approx(160.0)),
    ("heading", {"heading": math.radians(725)}, pytest.approx(5.0)),
    ("distance_from_center", {"offset": 0.25}, 0.25),
    ("distance_from_center", {"offset": -0.25}, 0.25),
    ("projection_distance", {"projection_distance": 7.5}, 7.5),
    ("progress", {"progress": 0.5}, 50.0),
    ("progress", {"progress": -0.001}, -0.1),
    ("progress", {"progress": math.nextafter(1.0, 0.0)}, math.nextafter(100.0, 0.0)),
    ("progress", {"progress": 1.0}, 100.0),
    ("progress", {"progress": 1.00567}, 100.0),
    ("steps", {"steps": 2.0}, 2.0),
    ("speed", {"speed": 3.5, "actual_speed": 1.0}, 3.5),
    ("speed", {"speed": float(np.float32(1.3))}, 1.3),
    ("steering_angle", {"steering_angle": math.radians(-30), "actual_steering_angle": 0.0}, -30.0),
    ("steering_angle", {"steering_angle": float(np.float32(math.radians(-15)))}, -15.0),
    ("track_width", {"track_width": 0.762}, 0.762),
    ("track_length", {"track_length": 17.7}, 17.7),
    ("waypoints", {"track_index": 0.0}, WAYPOINTS[0]),
    ("waypoints", {"track_index": 1.0}, WAYPOINTS[1]),
    ("closest_waypoints", {"closest_prev": 7.0, "closest_next": 8.0}, [7, 8]),
    ("is_left_of_center", {"offset": 0.01}, True),
    ("is_left_of_center", {"offset": -0.01}, False),
    ("is_left_of_center", {"offset": 0.0}, False),
    ("is_reversed", {"is_reversed": 1.0}, True),
    ("is_reversed", {"is_reversed": 0.0}, False),
    ("closest_objects", {}, [0, 0]),
    ("objects_location", {}, []),
    ("objects_left_of_center", {}, []),
    ("object_in_camera", {}, False),
    ("objects_speed", {}, []),
    ("objects_heading", {}, []),
    ("objects_distance_from_center", {}, []),
    ("objects_distance", {}, []),
    ("is_crashed", {"is_crashed": 1.0}, True),
    ("is_crashed", {"is_crashed": 0.0}, False),
    ("is_offtrack", {"is_offtrack": 1.0}, True),
    ("is_offtrack", {"is_offtrack": 0.0}, False),
    ("sim_time", {"time": 1.5}, 1.5),
]


@pytest.mark.parametrize(("key", "columns", "expected"), CASES)
def test_value_of_every_key(make_row, key, columns, expected):
    value = make_params(make_row(**columns).tolist(), WAYPOINTS)[key]
    assert value == expected
    assert type(value) is type(TEMPLATE[key])


angles = st.integers(-450, 450).map(lambda tenths: tenths / 10)
speeds = st.integers(10, 400).map(lambda hundredths: hundredths / 100)


@given(table=st.lists(st.tuples(angles, speeds), min_size=2, max_size=30))
def test_commands_are_the_numbers_of_the_action_space(cars, table):
    """To the bit, so that `speed >= 1.3` and `abs(steering_angle) > 15` mean what they say."""
    space = DiscreteActionSpace.from_aws([{"steering_angle": angle, "speed": speed} for angle, speed in table])
    assert commands_seen(cars, space) == table


@pytest.mark.parametrize("name", [name for name in PRESETS if name not in ("continuous", "fast")])
def test_commands_are_the_numbers_of_the_preset(cars, name):
    space = action_space(name)
    assert commands_seen(cars, space) == space.to_degrees()


def test_commands_that_no_decimal_says_are_close(cars):
    """A third of 4 m/s, and what a continuous policy likes."""
    space = action_space("fast")
    np.testing.assert_allclose(commands_seen(cars, space), space.to_degrees(), rtol=0.0, atol=6e-7)
    rng = np.random.default_rng(1)
    actions = action_space("continuous").to_commands(rng.uniform(-1.0, 1.0, (cars.num_envs, 2)))
    cars.reset()
    cars.step(actions)
    seen = [(params["steering_angle"], params["speed"]) for params in params_of(cars)]
    error = np.abs(seen - np.column_stack([np.degrees(actions[:, 0].astype(float)), actions[:, 1]]))
    assert (error.max(axis=0) <= (5.1e-6, 5.1e-7)).all()


def test_every_speed_and_angle_of_three_decimals_is_exact(make_row):
    row = make_row().tolist()
    at_angle, at_speed = ROW_COLUMNS.index("steering_angle"), ROW_COLUMNS.index("speed")
    for thousandths in range(-45_000, 45_001):
        angle, speed = thousandths / 1000, abs(thousandths) % 4001 / 1000
        row[at_angle], row[at_speed] = float(np.float32(math.radians(angle))), float(np.float32(speed))
        params = make_params(row, WAYPOINTS)
        assert (params["steering_angle"], params["speed"]) == (angle, speed)


@pytest.mark.parametrize("name", ["reinvent_2018", "hairpin"])
def test_progress_ends_at_100_exactly(name):
    track = load_track(name)
    start = Start(mode="fixed", offset=0.37)
    cars = Simulation(track, num_envs=1, camera=None, start=start, num_threads=1)
    autopilot, waypoints = Autopilot(speed=3.0, lateral_acceleration=2.0), waypoints_of([track])
    seen = []
    while not (cars.terminated[0] or cars.truncated[0]):
        cars.step(autopilot(cars.state))
        seen.append(make_params(cars.rows[0].tolist(), waypoints)["progress"])
    assert STATUS_NAMES[int(cars.column("status")[0])] == "lap_complete"
    assert cars.column("progress")[0] > 1.0  # the row knows how far the step led
    assert seen[-1] == 100.0
    assert max(seen[:-1]) < 100.0


@pytest.fixture(scope="module")
def cars():
    return Simulation(load_track("oval"), num_envs=30, camera=None, num_threads=1)


def commands_seen(cars, space):
    """What a reward function is told of every action, degrees and m/s."""
    cars.reset()
    cars.step(space.to_commands(np.arange(cars.num_envs) % space.size))
    return [(params["steering_angle"], params["speed"]) for params in params_of(cars)][: space.size]


def params_of(cars):
    waypoints = waypoints_of(cars.tracks)
    return [make_params(row, waypoints) for row in cars.rows.tolist()]


def test_every_key_has_a_case_and_no_other_key_exists(make_row):
    params = make_params(make_row().tolist(), WAYPOINTS)
    assert list(params) == list(TEMPLATE)
    assert {key for key, _, _ in CASES} == set(params)


def test_inner_types_are_plain_python(make_row):
    params = make_params(make_row(closest_prev=3.0, closest_next=4.0).tolist(), WAYPOINTS)
    assert [type(index) for index in params["closest_waypoints"]] == [int, int]
    assert all(type(point) is tuple and type(point[0]) is float for point in params["waypoints"])


def test_mutable_values_are_fresh_in_every_call(make_row):
    row = make_row().tolist()
    first = make_params(row, WAYPOINTS)
    for value in first.values():
        if isinstance(value, list):
            value.append("mine")
    first["speed"] = "mine"
    second = make_params(row, WAYPOINTS)
    assert "mine" not in second.values()
    assert not any("mine" in value for value in second.values() if isinstance(value, list))
    assert "mine" not in TEMPLATE["waypoints"] + TEMPLATE["objects_location"]


def test_every_column_is_read_at_its_place(make_row):
    """Each column that a key needs changes that key alone."""
    base = make_params(make_row().tolist(), WAYPOINTS)
    unseen = {"episode", "status", "actual_speed", "actual_steering_angle", "lap"}
    for column in ROW_COLUMNS:
        values = dict(zip(ROW_COLUMNS, make_row().tolist(), strict=True))
        changed = make_params(make_row(**{column: 1.0 - values[column] % 1.0 - values[column] // 1.0}), WAYPOINTS)
        differing = [key for key in base if base[key] != changed[key]]
        assert bool(differing) == (column not in unseen), column


def test_status_names_are_those_of_aws():
    assert STATUS_NAMES[:3] == ("prepare", "in_progress", "lap_complete")
    assert len(set(STATUS_NAMES)) == len(STATUS_NAMES) == 10


def test_format_is_one_compact_line(make_row):
    params = make_params(make_row(x=1.23456789, heading=1e-9).tolist(), WAYPOINTS)
    text = format_params(params)
    assert "'x': 1.23457" in text
    assert "'speed': 1.0" in text
    assert "<3 points from (0.0, 0.0)>" in text
    assert "objects" not in text
    assert "\n" not in text
    assert len(text) < 700
    params |= {"objects_location": [(1.0, 2.0)], "x": math.nan, "waypoints": np.zeros(3)}
    assert "'objects_location': [(1.0, 2.0)]" in format_params(params)
