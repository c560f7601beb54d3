"""The params dict has AWS's keys, types and units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft.reward.params import TEMPLATE, format_params, make_params
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES

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
    ("steps", {"steps": 2.0}, 2.0),
    ("speed", {"speed": 3.5, "actual_speed": 1.0}, 3.5),
    (
        "steering_angle",
        {"steering_angle": math.radians(-30), "actual_steering_angle": 0.0},
        pytest.approx(-30.0),
    ),
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
