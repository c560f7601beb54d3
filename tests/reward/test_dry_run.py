"""The dry run shows what a reward function does with the moments of a real track."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft.errors import RewardError, RewardTimeout
from racecraft.reward import rehearsal
from racecraft.reward.dry_run import dry_run, moment, situations
from racecraft.reward.params import make_params
from racecraft.reward.rehearsal import drive_to
from racecraft.reward.source import load_preset, preset_names
from racecraft.reward.worker import waypoints_of
from racecraft.sim import NO_OBJECTS, Bots, Objects, Obstacles, Simulation, Start
from racecraft.sim.columns import OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES, row_width
from racecraft.track import load_track


def column(situation, name):
    return situation.row[ROW_COLUMNS.index(name)]


def test_the_layout_of_a_drive_is_the_simulations():
    columns = (*ROW_COLUMNS, *OBJECT_HEADER)
    names = (
        *("steps", "x", "y", "heading", "steering_angle", "progress", "offset", "projection_distance"),
        *("track_length", "closest_prev", "closest_next", "all_wheels_on_track", "is_offtrack", "is_crashed"),
        *("status", "time", "track_index", "actual_steering_angle", "lap", "crashed_object"),
    )
    constants = (
        *("STEPS", "X", "Y", "HEADING", "STEERING", "PROGRESS", "OFFSET", "PROJECTION"),
        *("LENGTH", "PREV", "NEXT", "ON_TRACK", "OFFTRACK", "CRASHED"),
        *("STATUS", "TIME", "TRACK", "STEERED", "LAP", "CRASHED_INTO"),
    )
    for name, constant in zip(names, constants, strict=True):
        assert columns[getattr(rehearsal, constant)] == name
    assert STATUS_NAMES[int(rehearsal.IN_PROGRESS)] == "in_progress"


def test_situations_cover_what_training_meets(track):
    by_name = {situation.name: situation for situation in situations(track)}
    assert {
        "start",
        "straight",
        "bend left",
        "bend right",
        "left edge",
        "off track",
        "other way",
        "finish",
    } <= set(by_name)
    assert len(by_name) == len(situations(track))
    assert column(by_name["start"], "steps") == 2.0
    assert column(by_name["finish"], "progress") == 1.0
    assert column(by_name["off track"], "is_offtrack") == 1.0
    assert column(by_name["left edge"], "offset") > 0.0 > column(by_name["right edge"], "offset")
    assert column(by_name["other way"], "track_index") == 1.0
    speeds = [column(by_name[name], "speed") for name in ("slow", "straight", "fast")]
    assert speeds == [0.5, 1.5, 4.0]
    pace = by_name["on pace"]
    assert (column(pace, "steps"), column(pace, "progress")) == (100, 2 / 3)
    assert column(pace, "projection_distance") == pytest.approx(track.length * 2 / 3)
    for situation in by_name.values():
        assert situation.row.shape == (len(ROW_COLUMNS),)
        assert np.isfinite(situation.row).all()
        assert situation.description.endswith(".")


def test_rows_agree_with_the_track(track):
    for situation in situations(track):
        road = track.reversed() if column(situation, "track_index") else track
        s, offset = road.project([column(situation, "x"), column(situation, "y")])
        assert offset == pytest.approx(column(situation, "offset"), abs=1e-9)
        assert s % track.length == pytest.approx(column(situation, "projection_distance"), abs=1e-9)
        behind, ahead = int(column(situation, "closest_prev")), int(column(situation, "closest_next"))
        assert ahead == behind + 1
        assert (
            road.arc_length[behind] - 1e-9 <= column(situation, "projection_distance") <= road.arc_length[ahead] + 1e-9
        )


def test_every_place_lies_between_its_two_waypoints(track):
    last = len(track.arc_length) - 1
    for place in np.linspace(0.0, track.length, 200, endpoint=False):
        row = dict(zip(ROW_COLUMNS, moment(track, float(place)), strict=True))
        before, after = int(row["closest_prev"]), int(row["closest_next"])
        assert 0 <= before < after <= last
        assert track.arc_length[before] - 1e-9 <= place <= track.arc_length[after] + 1e-9


@pytest.mark.parametrize("name", preset_names())
def test_presets_manage_every_situation(track, name):
    for outcome in dry_run(load_preset(name), track):
        assert outcome.error is None
        assert isinstance(outcome.reward, float)
        assert outcome.printed == ""


def test_racing_prefers_what_is_right(track):
    reward = {outcome.situation.name: outcome.reward for outcome in dry_run(load_preset("racing"), track)}
    assert reward["fast"] > reward["straight"] > reward["slow"] > 0.0 > reward["backwards"]
    assert reward["straight"] > reward["left edge"] > reward["sideways"] > reward["off track"] == -1.0
    assert reward["other way"] == pytest.approx(reward["straight"])


@pytest.mark.parametrize("name", ["reinvent_2018", "oval", "bowtie", "straight"])
def test_only_a_start_is_near_the_start(name):
    first, *others = situations(load_track(name))
    assert 0.0 < column(first, "progress") < 0.02
    for situation in others:
        assert 0.1 <= column(situation, "progress") <= 1.0, situation.name
        is_done = column(situation, "progress") == 1.0
        assert is_done == (column(situation, "lap") == 1.0) == (situation.name == "finish")


@pytest.mark.parametrize("name", ["reinvent_2018", "oval", "straight", "generated:3"])
def test_before_the_line_the_next_waypoint_is_the_last_one(name):
    track = load_track(name)
    (row,) = [situation.row for situation in situations(track) if situation.name == "before the line"]
    values = dict(zip(ROW_COLUMNS, row, strict=True))
    assert values["closest_next"] == len(track.waypoints) - 1
    assert 0.0 < track.length - values["projection_distance"] < 0.051
    assert values["progress"] < 1.0
    assert STATUS_NAMES[int(values["status"])] == "in_progress"


@pytest.mark.parametrize("ahead", [1, 2])
def test_looking_beyond_the_last_waypoint_is_found(ahead):
    source = f"""
def reward_function(params):
    x, y = params["waypoints"][params["closest_waypoints"][1] + {ahead}]
    return 1.0
"""
    failed = [outcome for outcome in dry_run(source, load_track("reinvent_2018")) if outcome.error is not None]
    assert [outcome.situation.name for outcome in failed] == ["before the line"]
    assert "IndexError" in str(failed[0].error)


@pytest.mark.parametrize("reward", ["1.0 / params['progress']", "math.log(params['progress'])"])
def test_progress_may_be_divided_by(reward):
    source = f"import math\ndef reward_function(params):\n    return {reward}\n"
    assert all(outcome.error is None for outcome in dry_run(source, load_track("oval")))


REMEMBERING = {
    "between steps": """
p = s = 0.0
def reward_function(params):
    global p, s
    if params['steps'] <= 2:
        p = s = 0.0
    r = (params['progress'] - p) / (params['steps'] - s)
    p, s = params['progress'], params['steps']
    return r
""",
    "since the start": """
import math
def reward_function(params):
    global before
    if params['steps'] <= 2:
        before = params['progress']
    r = math.sqrt(params['progress'] - before + 1)
    before = params['progress']
    return r
""",
    "every step": """
last = {}
def reward_function(params):
    if params['steps'] == 2.0:
        last.clear()
    assert params['steps'] - last.get('steps', 1.0) == 1.0, 'a step is missing'
    x, y = last.get('place', (params['x'], params['y']))
    assert abs(params['x'] - x) + abs(params['y'] - y) < 1.0, 'a jump'
    print(params['steps'])
    last.update(steps=params['steps'], place=(params['x'], params['y']))
    return params['progress']
""",
}


@pytest.mark.costly
@pytest.mark.parametrize("source", REMEMBERING.values(), ids=REMEMBERING)
@pytest.mark.parametrize("name", ["reinvent_2018", "oval", "straight"])
def test_what_a_function_remembers_of_another_situation_is_no_mistake_of_its_own(name, source):
    outcomes = dry_run(source, load_track(name))
    assert [str(outcome.error) for outcome in outcomes if outcome.error is not None] == []
    if "print" in source:
        assert [outcome.printed for outcome in outcomes] == [f"{outcome.params['steps']}\n" for outcome in outcomes]


@pytest.mark.costly
def test_a_mistake_is_found_in_a_function_that_remembers(track):
    mistake = "    last['n'] = last.get('n', 0) + 1\n    1 / (last['n'] - 2)\n    return"
    broken = REMEMBERING["every step"].replace("    return", mistake)
    outcomes = dry_run(broken, track)
    assert outcomes[0].error is None
    assert all("ZeroDivisionError" in str(outcome.error) for outcome in outcomes[1:])


@pytest.mark.parametrize("name", ["oval", "straight"])
def test_a_drive_leads_to_a_situation_step_by_step(name):
    track = load_track(name)
    for situation in situations(track):
        drive = np.array(drive_to(situation.row.tolist(), waypoints_of([track])))
        assert len(drive) == column(situation, "steps") - 2
        if not len(drive):
            continue
        values = dict(zip(ROW_COLUMNS, drive.T, strict=True))
        assert values["steps"].tolist() == list(range(2, 2 + len(drive)))
        road = track.reversed() if column(situation, "track_index") else track
        step = column(situation, "progress") * track.length / len(drive)
        assert np.hypot(np.diff(values["x"]), np.diff(values["y"])) == pytest.approx(step, rel=0.1)
        assert values["progress"][0] == pytest.approx(0.14 / track.length)
        assert np.diff(values["progress"]).min() > 0.0
        assert column(situation, "progress") - values["progress"][-1] < 0.05
        for name in ("is_offtrack", "is_crashed", "lap", "offset"):
            assert not values[name].any()
        assert set(values["status"]) == {STATUS_NAMES.index("in_progress")}
        for x, y, place, before, after in zip(
            *(values[name] for name in ("x", "y", "projection_distance", "closest_prev", "closest_next")), strict=True
        ):
            assert road.project([x, y])[0] == pytest.approx(place, abs=0.01)
            assert road.arc_length[int(before)] <= place <= road.arc_length[int(after)]


AMONG = {
    "boxes": {"objects": Objects(obstacles=Obstacles(count=6))},
    "bots": {"objects": Objects(bots=Bots(count=2, placement="random"))},
    "both": {"objects": Objects(obstacles=Obstacles(count=1, kind="car"), bots=Bots(count=1)), "cars_per_race": 2},
    "another car": {"cars_per_race": 2},
}


@pytest.mark.parametrize("name", ["reinvent_2018", "straight"])
@pytest.mark.parametrize("among", AMONG)
def test_objects_are_told_as_the_simulation_tells_them(name, among):
    track, settings = load_track(name), AMONG[among]
    cars = settings.get("cars_per_race", 1)
    count = settings.get("objects", NO_OBJECTS).count + cars - 1
    found = situations(track, **settings)
    assert [one.name for one in found if one.name not in {plain.name for plain in situations(track)}] == [
        "near an object",
        "crash",
    ]
    for direction in ("forward", "reverse"):
        start = Start(mode="fixed")
        simulation = Simulation(
            track, num_envs=cars, camera=None, direction=direction, start=start, num_threads=1, **settings
        )
        for situation in found:
            if column(situation, "track_index") != (direction == "reverse"):
                continue
            assert situation.row.shape == (row_width(count),)
            params = make_params(situation.row.tolist(), waypoints_of([track]))
            if "objects" in settings or situation.name not in ("near an object", "crash"):
                assert params["objects_distance"] == simulation.object_column("object_distance")[0].tolist()
                assert params["objects_location"][0] == tuple(simulation.judged[0, [29, 30]])
            behind, ahead = params["closest_objects"]
            place, distances = params["projection_distance"], params["objects_distance"]
            later = [distance for distance in distances if distance > place] or distances
            assert distances[ahead] == min(later)
            sooner = [distance for distance in distances if distance <= place] or distances
            assert distances[behind] == max(sooner)
    near, crash = (one for one in found if one.name in ("near an object", "crash"))
    crashed = crash.row[len(ROW_COLUMNS) + OBJECT_HEADER.index("crashed_object")]
    assert 0 <= crashed < count
    assert near.row[len(ROW_COLUMNS) + OBJECT_HEADER.index("crashed_object")] == -1.0
    assert near.row[len(ROW_COLUMNS) + OBJECT_HEADER.index("object_in_camera")] == 1.0
    crash_params = make_params(crash.row.tolist(), waypoints_of([track]))
    assert crash_params["is_crashed"]
    x, y = crash_params["objects_location"][int(crashed)]
    assert math.dist((x, y), (crash_params["x"], crash_params["y"])) < 0.5


RELIES_ON_OBJECTS = (
    "def reward_function(params):\n    return params['objects_location'][params['closest_objects'][1]][0]\n"
)


@pytest.mark.costly
@pytest.mark.parametrize("among", AMONG)
def test_a_function_may_rely_on_objects(track, among):
    assert all(outcome.error is None for outcome in dry_run(RELIES_ON_OBJECTS, track, **AMONG[among]))
    remembering = REMEMBERING["every step"] + "    params['objects_location'][0]\n"
    outcomes = dry_run(RELIES_ON_OBJECTS + remembering, track, **AMONG[among])
    assert [str(outcome.error) for outcome in outcomes if outcome.error is not None] == []


@pytest.mark.costly
def test_where_nothing_stands_it_may_not(track):
    assert all("IndexError" in str(outcome.error) for outcome in dry_run(RELIES_ON_OBJECTS, track))


def test_one_failing_situation_does_not_hide_the_others(track):
    source = (
        "def reward_function(params):\n    print(params['steps'])\n"
        "    assert not params['is_offtrack'], 'off'\n    return params['progress']\n"
    )
    outcomes = dry_run(source, track)
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    assert [outcome.situation.name for outcome in failed] == ["off track"]
    assert failed[0].reward is None
    assert failed[0].error.line == 3
    assert failed[0].error.params == failed[0].params
    assert all(outcome.printed == f"{outcome.params['steps']}\n" for outcome in outcomes)


def test_a_call_that_does_not_return_is_waited_for_once(track):
    outcomes = dry_run("def reward_function(params):\n    while True:\n        pass\n", track, timeout_s=0.2)
    assert [type(outcome.error) for outcome in outcomes] == [RewardTimeout]
    assert outcomes[0].error.line in (2, 3)


def test_a_source_that_does_not_load(track):
    with pytest.raises(RewardError):
        dry_run("x = 1", track)
