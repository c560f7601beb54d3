"""The example rewards mean what AWS's documentation says, at and around every threshold."""

from __future__ import annotations

import math

import pytest

from racecraft.reward.params import TEMPLATE
from racecraft.reward.source import load_preset, preset_names

EAST = {"waypoints": [(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)], "closest_waypoints": [0, 1]}
WEST = {"waypoints": [(0.0, 0.0), (-1.0, -1e-9), (0.0, 0.0)], "closest_waypoints": [0, 1]}
ROAD = {"track_width": 1.0, "all_wheels_on_track": True, "speed": 1.5} | EAST
BOX = {
    "objects_location": [(9.0, 9.0), (0.0, 0.0)],
    "objects_left_of_center": [True, False],
    "closest_objects": [0, 1],
}


def reward(name: str, **params) -> float:
    namespace: dict = {}
    exec(compile(load_preset(name), name, "exec"), namespace)
    return namespace["reward_function"](TEMPLATE | ROAD | params)


@pytest.mark.parametrize("name", ["centerline", "anti_zigzag"])
@pytest.mark.parametrize(
    ("distance", "expected"),
    [(0, 1), (0.1, 1), (0.11, 0.5), (0.25, 0.5), (0.26, 0.1), (0.5, 0.1), (0.51, 1e-3)],
)
def test_bands(name, distance, expected):
    assert reward(name, distance_from_center=distance) == expected


@pytest.mark.parametrize(("angle", "factor"), [(0, 1), (15, 1), (-15, 1), (15.1, 0.8), (-30, 0.8)])
def test_anti_zigzag(angle, factor):
    assert reward("anti_zigzag", steering_angle=angle) == factor


@pytest.mark.parametrize(
    ("distance", "wheels", "expected"),
    [(0.44, True, 1), (0.46, True, 1e-3), (0.1, False, 1e-3), (0.6, True, 1e-3)],
)
def test_stay_inside(distance, wheels, expected):
    assert reward("stay_inside", distance_from_center=distance, all_wheels_on_track=wheels) == expected


@pytest.mark.parametrize(
    ("road", "heading", "expected"),
    [
        (EAST, 0, 1),
        (EAST, 10, 1),
        (EAST, -11, 0.5),
        (EAST, 180, 0.5),
        (WEST, 175, 1),
        (WEST, -175, 1),
        (WEST, 0, 0.5),
    ],
)
def test_heading(road, heading, expected):
    assert reward("heading", heading=heading, **road) == expected


@pytest.mark.parametrize(
    ("steps", "progress", "expected"),
    [(100.0, 33.4, 11), (100.0, 33.3, 1), (101.0, 99.0, 1), (200.0, 70.0, 11), (300.0, 100.0, 1)],
)
def test_progress_pace(steps, progress, expected):
    assert reward("progress_pace", steps=steps, progress=progress) == expected


@pytest.mark.parametrize(
    ("x", "left", "avoidance"),
    [
        *((-0.9, False, 1), (-0.8, False, 1), (-0.6, False, 0.5), (-0.5, False, 0.5), (-0.4, False, 0.2)),
        *((-0.3, False, 0.2), (-0.2, False, 1e-3), (-0.2, True, 1)),
    ],
)
def test_object_avoidance(x, left, avoidance):
    assert reward("object_avoidance", x=x, is_left_of_center=left, **BOX) == pytest.approx(1e-3 + 1 + 4 * avoidance)


def test_object_avoidance_without_objects_or_lane():
    assert reward("object_avoidance") == pytest.approx(5.001)
    assert reward("object_avoidance", distance_from_center=0.6) == pytest.approx(4.002)


@pytest.mark.parametrize(("speed", "wheels", "expected"), [(0.9, True, 0.5), (1.0, True, 1), (4.0, False, 1e-3)])
def test_speed_gate(speed, wheels, expected):
    assert reward("speed_gate", speed=speed, all_wheels_on_track=wheels) == expected


def test_racing_pays_for_metres_along_the_track():
    full = reward("racing", speed=3.0)
    assert full == pytest.approx(3.0 / 15)
    assert reward("racing", speed=1.5) == pytest.approx(full / 2)
    assert reward("racing", speed=3.0, heading=60.0) == pytest.approx(full / 2)
    assert reward("racing", speed=3.0, heading=180.0) == pytest.approx(-full)
    assert reward("racing", speed=3.0, distance_from_center=0.25) == pytest.approx(full * 0.875)
    assert reward("racing", speed=3.0, distance_from_center=0.9) == pytest.approx(full / 2)
    assert reward("racing", speed=3.0, is_offtrack=True) == -1.0
    assert reward("racing", speed=3.0, is_crashed=True) == -1.0


def test_lap_time_pays_for_the_metres_gained_since_the_last_step_of_the_same_episode():
    namespace: dict = {}
    exec(compile(load_preset("lap_time"), "lap_time", "exec"), namespace)
    rewards = [
        namespace["reward_function"](
            TEMPLATE | ROAD | {"steps": steps, "progress": progress, "track_length": 20.0, "is_offtrack": off}
        )
        for steps, progress, off in [
            *((2.0, 0.5, False), (3.0, 1.5, False), (4.0, 1.0, False)),
            *((5.0, 3.0, True), (2.0, 0.0, False), (3.0, 0.0, False), (90.0, 50.0, False)),
        ]
    ]
    assert rewards == pytest.approx([0, 0.2, -0.1, -1, 0, 0, 0])


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_is_small_and_finite(name):
    for speed in (0.1, 4.0):
        for heading in (-180.0, 0.0, 90.0):
            assert math.isfinite(reward(name, speed=speed, heading=heading, distance_from_center=0.3))
            assert abs(reward(name, speed=speed, heading=heading)) <= 11.0
