"""The example rewards mean what AWS's documentation says, at and around every threshold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft.reward.painting import OFFSETS, paint_presets, paint_reward
from racecraft.reward.params import TEMPLATE
from racecraft.reward.source import load_preset, preset_names
from racecraft.sim.objects import objects_for_race
from racecraft.track import load_track

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


@pytest.mark.parametrize(
    ("ahead", "across", "danger"),
    [
        *((2.0, 0.0, 0.0), (1.5, 0.0, 0.375), (1.0, 0.0, 0.75), (0.5, 0.0, 1.0), (-0.4, 0.0, 1.0), (-0.6, 0.0, 0.0)),
        *((0.5, 0.45, 0.0), (0.5, 0.225, 0.5), (0.5, -0.225, 0.5), (1.0, 0.225, 0.375)),
    ],
)
@pytest.mark.parametrize("side", [0.2, 0.0, -0.2])
@pytest.mark.parametrize("at", [5.0, 19.9])  # near the line the lap's two ends meet
def test_dodge_pays_less_the_nearer_and_the_more_squarely_an_object_is_ahead(ahead, across, danger, side, at):
    """A car 0.2 m to either side of the centre line, an object `ahead` metres further, `across` metres to its left."""
    there = side + across
    objects = {
        "objects_location": [(0.0, 0.0), (0.0, 0.0)],
        "objects_distance": [(at + ahead) % 20.0, (at + 8.0) % 20.0],
        "objects_distance_from_center": [abs(there), 0.0],
        "objects_left_of_center": [there > 0, True],
        "closest_objects": [1, 0],
        "projection_distance": at,
        "track_length": 20.0,
        "distance_from_center": abs(side),
        "is_left_of_center": side > 0,
    }
    free = reward("dodge", **{**objects, "objects_location": []})
    assert free == pytest.approx(reward("racing", distance_from_center=abs(side)))
    assert reward("dodge", **objects) == pytest.approx(free * (1.0 - danger), abs=1e-9)
    assert reward("dodge", **{**objects, "closest_objects": [0, 1]}) == pytest.approx(free * (1.0 - danger), abs=1e-9)
    assert reward("dodge", **{**objects, "is_crashed": True}) == -1.0
    assert reward("slalom", **objects) == reward("dodge", **objects)
    assert reward("slalom", **{**objects, "is_crashed": True}) == -15.0
    assert reward("slalom", **{**objects, "is_offtrack": True}) == -15.0


@pytest.mark.parametrize(("name", "mistake"), [("lap_time", -1.0), ("duel", -8.0)])
def test_the_metres_gained_since_the_last_step_of_the_same_episode_are_paid_for(name, mistake):
    namespace: dict = {}
    exec(compile(load_preset(name), name, "exec"), namespace)
    rewards = [
        namespace["reward_function"](
            TEMPLATE | ROAD | {"steps": steps, "progress": progress, "track_length": 20.0, "is_offtrack": off}
        )
        for steps, progress, off in [
            *((2.0, 0.5, False), (3.0, 1.5, False), (4.0, 1.0, False)),
            *((5.0, 3.0, True), (2.0, 0.0, False), (3.0, 0.0, False), (90.0, 50.0, False)),
        ]
    ]
    assert rewards == pytest.approx([0, 0.2, -0.1, mistake, 0, 0, 0])
    crash = TEMPLATE | ROAD | {"steps": 91.0, "progress": 50.5, "is_crashed": True}
    assert namespace["reward_function"](crash) == mistake


RIVALS = {"track_length": 20.0, "closest_objects": [1, 0], "is_crashed": False}


def duel(*steps: tuple[float, float, float, float], **params) -> list[float]:
    """What is paid for steps: progress in percent of 20 m, m from the start, and where two others are, in m."""
    namespace: dict = {}
    exec(compile(load_preset("duel"), "duel", "exec"), namespace)
    return [
        namespace["reward_function"](
            TEMPLATE
            | ROAD
            | RIVALS
            | {"steps": 2.0 + number, "progress": progress, "projection_distance": here, "objects_distance": [one, two]}
            | params
        )
        for number, (progress, here, one, two) in enumerate(steps)
    ]


@pytest.mark.parametrize(
    ("steps", "paid"),
    [
        (((1, 0.2, 1.2, 15), (2, 0.4, 1.3, 15)), 0.2 + 3 * 0.1),  # it gains on the car ahead
        (((1, 0.2, 1.2, 15), (2, 0.4, 1.5, 15)), 0.2 - 3 * 0.1),  # and loses on it
        (((1, 0.2, 6.0, 18.9), (2, 0.4, 6.1, 19.2)), 0.2 - 3 * 0.1),  # the one behind is nearer, across the line
        (((1, 19.9, 0.9, 10), (2, 0.1, 1.0, 10)), 0.2 + 3 * 0.1),  # the line is between them
        (((1, 0.2, 3.0, 15), (2, 0.4, 3.1, 15)), 0.2),  # too far ahead
        (((1, 0.2, 1.2, 15), (2, 0.4, 2.0, 15)), 0.2),  # put somewhere else
        (((1, 0.2, 1.2, 15), (2, 0.4, 0.9, 15)), 0.2),  # back, for a mistake
        (((1, 0.2, 1.2, 19.1), (2, 0.4, 1.7, 19.2)), 0.2),  # the other one is nearest now
    ],
)
def test_a_duel_pays_for_metres_three_times_more_where_they_are_won_from_somebody_near(steps, paid):
    first, second = duel(*steps)
    assert first == 0.0
    assert second == pytest.approx(paid)
    assert duel(*steps, is_crashed=True) == [-8.0, -8.0]


def test_a_duels_new_episode_wins_nothing_from_where_the_others_were():
    first, again = duel((1, 0.2, 1.2, 15), (2, 0.4, 1.0, 15), steps=2.0)
    assert (first, again) == (0.0, 0.0)


def test_touring_pays_for_metres_and_not_for_haste_in_a_bend():
    namespace: dict = {}
    exec(compile(load_preset("touring"), "touring", "exec"), namespace)

    def paid(**params) -> float:
        """For a metre, gained between two steps."""
        for steps, progress in ((2.0, 10.0), (3.0, 15.0)):
            state = {"steps": steps, "progress": progress, "track_length": 20.0, "speed": 2.0, "steering_angle": 0.0}
            last = namespace["reward_function"](TEMPLATE | ROAD | state | params)
        return last

    assert paid() == pytest.approx(1.0)
    assert paid(distance_from_center=0.25) == pytest.approx(1.0 - 0.5 * 0.25)
    assert paid(distance_from_center=0.7) == pytest.approx(0.5)
    at_the_limit = math.degrees(math.atan(0.165 * 2.5 / 2.0**2))  # 2.5 m/s2 across at 2 m/s
    assert paid(steering_angle=at_the_limit) == pytest.approx(1.0)
    assert paid(steering_angle=-at_the_limit, speed=2.0 * math.sqrt(2.0)) == pytest.approx(0.95)
    assert paid(steering_angle=at_the_limit, speed=4.0) == pytest.approx(1.0 - 0.05 * 3.0)
    assert paid(is_offtrack=True) == paid(is_crashed=True) == -1.0
    assert namespace["reward_function"](TEMPLATE | ROAD | {"steps": 90.0, "progress": 50.0}) == 0.0


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_is_small_and_finite(name):
    for speed in (0.1, 4.0):
        for heading in (-180.0, 0.0, 90.0):
            assert math.isfinite(reward(name, speed=speed, heading=heading, distance_from_center=0.3))
            assert abs(reward(name, speed=speed, heading=heading)) <= 11.0


AHEAD = {
    "closest_objects": [0, 0],
    "objects_location": [(0.0, 0.0)],
    "objects_left_of_center": [True],
    "objects_speed": [1.0],
    "objects_distance": [11.0],
    "objects_distance_from_center": [0.1],
    "projection_distance": 10.0,
    "track_length": 20.0,
    "distance_from_center": 0.1,
}


def overtake(gained: float, **params) -> float:
    """Its reward for a step in which the car gained so many metres."""
    namespace: dict = {}
    exec(compile(load_preset("overtake"), "overtake", "exec"), namespace)
    length = params.setdefault("track_length", 20.0)
    for steps, progress in ((2.0, 10.0), (3.0, 10.0 + 100.0 * gained / length)):
        paid = namespace["reward_function"](TEMPLATE | ROAD | {"steps": steps, "progress": progress} | params)
    return paid


def test_overtake_is_lap_time_with_something_for_passing():
    alone = {key: AHEAD[key] for key in ("projection_distance", "distance_from_center")}
    assert overtake(0.2, **alone) == pytest.approx(0.2)
    assert overtake(0.2, **{**AHEAD, "objects_distance": [12.5]}) == pytest.approx(0.2)
    assert overtake(0.2, **{**AHEAD, "objects_distance": [9.0]}) == pytest.approx(0.2)  # behind
    # 1 m behind a car, half of the way into its reach: straight behind it, and with room to pass
    assert overtake(0.2, is_left_of_center=True, **AHEAD) == pytest.approx(0.2 * 0.6)
    beside = {**AHEAD, "objects_distance_from_center": [0.2]}
    passed = 0.2 - 1.0 / 15  # metres gained on it
    assert overtake(0.2, is_left_of_center=False, **beside) == pytest.approx(0.2 + 0.5 * passed)
    mirrored = {**beside, "objects_left_of_center": [False], "is_left_of_center": True}
    assert overtake(0.2, **mirrored) == pytest.approx(0.2 + 0.5 * passed)
    assert overtake(0.05, **mirrored) == pytest.approx(0.05)  # the other one drives away
    # around the end of the lap
    wrapped = {**AHEAD, "projection_distance": 19.5, "objects_distance": [0.5], "is_left_of_center": True}
    assert overtake(0.2, **wrapped) == pytest.approx(0.2 * 0.6)
    assert overtake(0.2, is_offtrack=True, **AHEAD) == -1.0
    assert overtake(0.2, is_crashed=True, is_offtrack=True, **AHEAD) == -2.0
    assert reward("overtake", steps=7.0, progress=50.0, **AHEAD) == 0.0  # the first step it sees


@pytest.mark.costly
def test_a_reward_is_painted_among_the_objects_that_it_asks_for():
    """Most where the nearest is close, and the nearest of them by the grid is where it stands."""
    closeness = "def reward_function(params):\n    return 1 / (0.1 + min(params['objects_distance']))\n"
    away = "def reward_function(params):\n    return -min(abs(x) + abs(y) for x, y in AWAY(params))\n"
    away = away.replace("AWAY(params)", "[(a - params['x'], b - params['y']) for a, b in params['objects_location']]")
    track = load_track("oval")
    assert np.isnan(paint_reward(closeness, track).rewards).all()  # nothing is there
    for road in ({"objects": objects_for_race("object-avoidance", settings={})}, {"cars_per_race": 3}):
        assert np.isfinite(paint_reward(closeness, track, **road).rewards).all()
        painting = paint_reward(away, track, **road)
        for place in painting.objects:
            nearest = np.abs(painting.points - place).sum(axis=-1)
            assert painting.rewards[nearest < 0.2].min() > painting.rewards.mean()
        most = painting.points[np.unravel_index(painting.rewards.argmax(), painting.rewards.shape)]
        assert np.abs(painting.objects - most).sum(axis=-1).min() == pytest.approx(-painting.rewards.max(), abs=1e-6)


@pytest.mark.costly
def test_pictures_of_all_of_them_show_what_the_walled_worker_paints():
    track = load_track("oval")
    points, painted = paint_presets(track)
    assert set(painted) == set(preset_names())
    for name in ("centerline", "racing", "stay_inside", "lap_time"):
        whole = paint_reward(load_preset(name), track)
        assert whole.points[::2] == pytest.approx(points)
        assert whole.rewards[::2] == pytest.approx(painted[name])
    driven = painted["lap_time"][:, len(OFFSETS) // 2]  # metres gained since the step before
    assert driven == pytest.approx(1.5 / 15, rel=0.15)
    assert driven == pytest.approx(driven[0])
    middle = len(OFFSETS) // 2
    assert (painted["centerline"][:, middle] > painted["centerline"][:, 0]).all()
