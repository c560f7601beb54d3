"""Objects: where they are placed, how bots drive, what is a crash, and what rows say about them."""

from __future__ import annotations

import math

import numpy as np
import objects_reference as reference
import pytest

from racecraft import _native
from racecraft.errors import ConfigError, ShapeError
from racecraft.sim import (
    OBJECT_COLUMNS,
    OBJECT_HEADER,
    STATUS_NAMES,
    Bots,
    CameraSpec,
    Objects,
    Obstacles,
    Simulation,
    Start,
)
from racecraft.sim.columns import OBJECT_STATE_COLUMNS, row_width, state_width
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track import Track, load_track

OVAL = load_track("oval")
STRAIGHT = Track(
    "straight",
    np.column_stack([np.linspace(0.0, 10.0, 41), np.zeros(41)]),
    np.column_stack([np.linspace(0.0, 10.0, 41), np.full(41, 0.5)]),
    np.column_stack([np.linspace(0.0, 10.0, 41), np.full(41, -0.5)]),
)
FIXED = Start(mode="fixed")
STAND = np.float32([[0.0, 0.0]])
GO = np.float32([[0.0, 1.0]])


def boxes(*positions: tuple[float, int], kind: str = "box") -> Objects:
    return Objects(obstacles=Obstacles(count=len(positions), placement="fixed", positions=positions, kind=kind))


def bots(*positions: tuple[float, int], **settings) -> Objects:
    return Objects(bots=Bots(count=len(positions), placement="fixed", positions=positions, **settings))


def world(objects: Objects, track: Track = OVAL, **settings) -> Simulation:
    settings = {"camera": None, "start": FIXED, **settings}
    return Simulation(track, objects=objects, **settings)


def status(simulation: Simulation, env: int = 0) -> str:
    return STATUS_NAMES[int(simulation.column("status")[env])]


# --- columns


def test_columns_have_the_cores_names_and_number():
    assert tuple(_native.OBJECT_HEADER) == OBJECT_HEADER
    assert tuple(_native.OBJECT_COLUMNS) == OBJECT_COLUMNS
    for count in (0, 1, 6):
        objects = Objects(obstacles=Obstacles(count=count)) if count else Objects()
        simulation = world(objects, num_envs=3)
        assert simulation.judged.shape == (3, row_width(count))
        assert simulation.state.shape == (3, state_width(count))
    assert len(OBJECT_STATE_COLUMNS) == state_width(1) - state_width(0)
    with pytest.raises(ConfigError, match="no object column 'object_z'"):
        simulation.object_column("object_z")
    with pytest.raises(ConfigError, match="none without objects"):
        world(Objects()).object_column("object_x")


# --- placement


@pytest.mark.parametrize("track", [OVAL, load_track("reinvent_2018"), STRAIGHT], ids=lambda track: track.name)
@pytest.mark.parametrize("direction", ["forward", "reverse"])
def test_fixed_objects_stand_in_the_middle_of_their_lane(track, direction):
    positions = ((0.23, -1), (0.46, 1), (0.99, -1))
    simulation = world(boxes(*positions), track, direction=direction)
    driven = simulation.driven_track(0)
    for i, (fraction, lane) in enumerate(positions):
        x, y, heading = reference.lane_pose(driven, fraction * driven.length, lane)
        if track.is_closed or fraction < 0.9:  # at the end of an open road the whole object stays on it
            assert simulation.object_column("object_x")[0, i] == pytest.approx(x, abs=1e-5)
            assert simulation.object_column("object_y")[0, i] == pytest.approx(y, abs=1e-5)
            assert simulation.object_column("object_heading")[0, i] == pytest.approx(heading, abs=1e-5)
        distance, offset = driven.project(np.array([x, y]))
        assert simulation.object_column("object_distance")[0, i] == pytest.approx(float(distance), abs=0.1)
        assert simulation.object_column("object_offset")[0, i] == pytest.approx(float(offset), abs=1e-4)
    assert (simulation.object_column("object_speed") == 0.0).all()


def test_even_placement_alternates_lanes_at_equal_distances():
    simulation = world(Objects(obstacles=Obstacles(count=5)))
    distances = simulation.object_column("object_distance")[0]
    np.testing.assert_allclose(np.diff(distances), OVAL.length / 6, atol=0.05)
    assert (np.diff(np.sign(simulation.object_column("object_offset")[0])) != 0).all()


@pytest.mark.parametrize(("count", "wanted"), [(6, 2.0), (3, 0.0), (20, 2.0)])
@pytest.mark.parametrize("track", [OVAL, STRAIGHT], ids=["closed", "open"])
def test_random_placement_keeps_its_distance_and_changes_with_episodes_and_seeds(track, count, wanted):
    objects = Objects(obstacles=Obstacles(count=count, placement="random", min_distance=wanted))
    simulation = world(objects, track, num_envs=50, seed=4)
    gaps_wanted = min(wanted, track.length / count if track.is_closed else (track.length - 1.0) / (count - 1))
    seen = []
    for _ in range(4):
        places = np.sort(simulation.object_column("object_distance"), axis=1)
        gaps = np.diff(places, axis=1)
        if track.is_closed:
            gaps = np.column_stack([gaps, places[:, 0] + track.length - places[:, -1]])
        assert gaps.min() >= gaps_wanted - 0.09  # the end of an open road and a bend's corners move a place a little
        seen.append(simulation.object_column("object_x").copy())
        simulation.reset()
    if track.is_closed or gaps_wanted == wanted:  # else the first one has no choice
        assert len(np.unique(np.concatenate(seen)[:, 0])) == 200
    lanes = np.sign(simulation.object_column("object_offset"))
    assert abs(lanes.mean()) < 0.35  # a coin for each


def test_a_start_near_an_object_takes_the_other_lane():
    for lane, offset in ((1, -1.0), (-1, 1.0)):
        start = Start(mode="fixed", offset=0.5)
        simulation = world(boxes((0.5 + 0.9 / OVAL.length, lane)), start=start)
        side = 1.0 if OVAL.left is OVAL.inner or np.allclose(OVAL.left, OVAL.inner) else -1.0
        assert np.sign(simulation.column("offset")[0]) == offset * side
        assert abs(simulation.column("offset")[0]) == pytest.approx(float(OVAL.width_at(0.0)) / 4, rel=0.1)
        simulation = world(boxes((0.5 + 1.1 / OVAL.length, lane)), start=start)
        assert simulation.column("offset")[0] == pytest.approx(0.0, abs=0.01)


# --- collisions


@pytest.mark.parametrize("kind", ["box", "parked_car", "bot_car"])
def test_a_crash_is_a_corner_of_the_car_in_the_others_rectangle(kind):
    place = ((0.5, 1),)
    objects = bots(*place, speed=0.0) if kind == "bot_car" else boxes(*place, kind="car" if kind != "box" else "box")
    simulation = world(objects, STRAIGHT, num_envs=500)
    assert OBJECT_KINDS[int(simulation.object_column("object_kind")[0, 0])] == kind
    other = tuple(float(simulation.object_column(f"object_{name}")[0, 0]) for name in ("x", "y", "heading"))
    rng = np.random.default_rng(5)
    poses = [(other[0] + dx, other[1] + dy, turn) for dx, dy, turn in rng.uniform(-1, 1, (500, 3)) * [0.6, 0.5, 3.1]]
    for env, pose in enumerate(poses):
        simulation.set_pose(env, *pose)
    simulation.step(np.zeros((500, 2)))
    crashed = 0
    for env, pose in enumerate(poses):
        depth = reference.overlap(pose, other, kind)
        if abs(depth) < 1e-5:
            continue
        is_behind = pose[0] < other[0]
        expected = depth > 0.0 and (kind != "bot_car" or is_behind)
        if kind == "bot_car" and abs(other[0] - pose[0]) < 1e-3:
            continue
        assert (status(simulation, env) == "crashed") == expected, (pose, depth)
        assert simulation.object_column("crashed_object")[env] == (0 if expected else -1)
        assert simulation.column("is_crashed")[env] == expected
        crashed += expected
    assert crashed > 30


def test_mirrored_situations_give_mirrored_results():
    one, other = (world(boxes((0.5, lane)), STRAIGHT, num_envs=200) for lane in (1, -1))
    rng = np.random.default_rng(6)
    for env, (dx, dy, turn) in enumerate(rng.uniform(-1, 1, (200, 3)) * [0.6, 0.5, 3.1]):
        one.set_pose(env, 5.0 + dx, 0.25 + dy, turn)
        other.set_pose(env, 5.0 + dx, -0.25 - dy, -turn)
    for simulation in (one, other):
        simulation.step(np.zeros((200, 2)))
    np.testing.assert_array_equal(one.column("status"), other.column("status"))
    np.testing.assert_array_equal(one.object_column("object_in_camera"), other.object_column("object_in_camera"))
    np.testing.assert_array_equal(one.object_column("object_y"), -other.object_column("object_y"))


def test_crashed_comes_before_off_track_and_after_a_completed_lap():
    simulation = world(boxes((0.5, 1)), STRAIGHT)
    simulation.set_pose(0, 5.0, 0.6, math.pi / 2)  # all wheels beyond the border, a rear corner in the buffer
    simulation.step(STAND)
    assert simulation.column("is_offtrack")[0] == 1.0
    assert status(simulation) == "crashed"
    simulation = world(boxes((1.0, 1)), STRAIGHT)
    simulation.set_pose(0, 9.9, 0.2, 0.0)
    simulation.step(STAND)
    assert status(simulation) == "lap_complete"
    assert simulation.column("is_crashed")[0] == 0.0


def test_a_car_that_stands_as_a_penalty_cannot_be_hit():
    simulation = world(boxes((0.5, 1)), STRAIGHT)
    simulation.set_pose(0, 5.0, 0.25, 0.0)
    simulation.freeze(0, 3)
    for _ in range(3):
        simulation.step(STAND)
        assert status(simulation) == "pause"
        assert simulation.object_column("crashed_object")[0] == -1
    simulation.step(STAND)
    assert status(simulation) == "crashed"
    assert simulation.object_column("crashed_object")[0] == 0
    assert simulation.terminated[0]


# --- bots


def test_a_bot_keeps_its_lane_and_speed():
    simulation = world(bots((0.1, 1), (0.6, -1), speed=0.7), load_track("reinvent_2018"), max_steps=10**6)
    track = simulation.driven_track(0)
    simulation.freeze(0, 10**6)
    before = None
    for _ in range(200):
        simulation.step(STAND)
        places = np.column_stack([simulation.object_column(f"object_{axis}")[0] for axis in "xy"])
        if before is not None:
            np.testing.assert_allclose(np.hypot(*(places - before).T), 0.7 / 15, rtol=0.06)
        before = places
        for i, lane in enumerate((1, -1)):
            nearest = min(
                np.hypot(*(reference.lane_line(track, s, lane) - places[i]))
                for s in simulation.object_column("object_distance")[0, i] + np.linspace(-0.1, 0.1, 21)
            )
            assert nearest < 0.02
    np.testing.assert_allclose(simulation.object_column("object_speed"), 0.7, atol=1e-6)


def test_lane_changes_take_their_time_and_way():
    settings = {"changes_lane": True, "shortest_stay": 3.0, "longest_stay": 5.0, "speed": 1.0}
    simulation = world(bots((0.0, 1), **settings), OVAL, num_envs=20, max_steps=10**6)
    for env in range(20):
        simulation.freeze(env, 10**6)
    offsets = []
    for _ in range(15 * 40):
        simulation.step(np.zeros((20, 2)))
        offsets.append(simulation.object_column("object_offset")[:, 0].copy())
    lane = float(OVAL.width_at(0.0)) / 4
    offsets = np.array(offsets) / lane
    assert np.abs(np.diff(offsets, axis=0)).max() < 1.1 * 2 * 1.5 / 15  # a smooth step over 1 m, however often
    in_lane = np.abs(offsets) > 0.97
    assert in_lane.mean() > 0.7
    for env in range(20):
        changes = np.flatnonzero(np.diff(np.sign(offsets[:, env])))
        assert 6 <= len(changes) <= 10  # every 3 to 5 s and 1 s for the change
        seconds = np.diff(changes) / 15
        assert seconds.min() > 3.5
        assert seconds.max() < 6.5
    assert len({tuple(np.flatnonzero(np.diff(np.sign(column)))) for column in offsets.T}) > 10


def test_a_bot_waits_behind_a_car_and_passes_one_that_cannot_be_hit():
    simulation = world(bots((0.3, 1), speed=0.5), STRAIGHT)
    simulation.set_pose(0, 4.0, 0.25, 0.0)
    for _ in range(40):
        simulation.step(STAND)
        simulation.set_pose(0, 4.0, 0.25, 0.0)  # or it would be immobilized
        gap = 4.0 - simulation.object_column("object_x")[0, 0]
        assert gap > 0.32
        assert status(simulation) != "crashed"
    assert gap < 0.37
    assert simulation.object_column("object_speed")[0, 0] == 0.0
    simulation.freeze(0, 60)
    for _ in range(60):
        simulation.step(STAND)
    assert simulation.object_column("object_x")[0, 0] > 4.5


def test_bots_stop_at_the_end_of_an_open_road():
    simulation = world(bots((0.95, 1), speed=2.0), STRAIGHT)
    for _ in range(10):
        simulation.step(STAND)
    assert simulation.object_column("object_speed")[0, 0] == 0.0
    assert simulation.object_column("object_x")[0, 0] < STRAIGHT.length


# --- what rows say


def test_closest_objects_are_the_neighbours_along_the_track():
    rng = np.random.default_rng(7)
    for count in (1, 2, 7):
        objects = Objects(obstacles=Obstacles(count=count, placement="random", min_distance=0.1))
        simulation = world(objects, num_envs=100)
        for env in range(100):
            simulation.place(env, float(rng.uniform(0, OVAL.length)))
        simulation.step(np.zeros((100, 2)))
        for env in range(100):
            here = simulation.column("projection_distance")[env]
            expected = reference.closest(simulation.object_column("object_distance")[env].tolist(), here)
            found = [int(simulation.object_column(f"closest_object_{name}")[env]) for name in ("prev", "next")]
            assert tuple(found) == expected


def test_an_object_is_in_camera_when_it_is_within_the_lens_opening():
    simulation = world(boxes((0.5, 1)), STRAIGHT, num_envs=4)
    for env, (x, heading) in enumerate([(3.0, 0.0), (7.0, 0.0), (7.0, math.pi), (3.0, 1.0)]):
        simulation.set_pose(env, x, 0.0, heading)
    simulation.step(np.zeros((4, 2)))
    assert simulation.object_column("object_in_camera").tolist() == [1.0, 0.0, 1.0, 0.0]


def test_the_lens_looks_from_where_the_car_carries_it_whichever_way_it_points():
    camera = CameraSpec(forward=0.3, left=0.1)
    simulation = world(boxes((0.5, 1)), STRAIGHT, num_envs=400, camera=camera)
    x, y = (float(simulation.object_column(f"object_{axis}")[0, 0]) for axis in "xy")
    rng = np.random.default_rng(8)
    poses = np.column_stack([x + rng.uniform(-2, 2, 400), y + rng.uniform(-2, 2, 400), rng.uniform(-3.1, 3.1, 400)])
    for env, pose in enumerate(poses):
        simulation.set_pose(env, *pose.tolist())
    simulation.step(np.zeros((400, 2)))
    seen = np.zeros((400, 2), dtype=bool)  # through an opening a little too narrow and a little too wide
    slope = math.tan(0.5 * camera.horizontal_fov)
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    lens = poses[:, :2] + np.column_stack([0.3 * cosine - 0.1 * sine, 0.3 * sine + 0.1 * cosine])
    for dx, dy in ((0, 0), (0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)):
        ahead = (x + dx - lens[:, 0]) * cosine + (y + dy - lens[:, 1]) * sine
        aside = np.abs((y + dy - lens[:, 1]) * cosine - (x + dx - lens[:, 0]) * sine)
        seen |= (ahead > 0)[:, None] & (aside[:, None] < slope * ahead[:, None] + [-1e-4, 1e-4])
    found = simulation.object_column("object_in_camera") == 1.0
    assert (found >= seen[:, 0]).all()
    assert (found <= seen[:, 1]).all()
    assert 40 < found.sum() < 360


def test_the_state_tells_of_the_next_two_objects():
    simulation = world(boxes((0.2, 1), (0.5, -1), (0.9, 1)), num_envs=1)
    simulation.place(0, 0.3 * OVAL.length)
    ahead = [(fraction - 0.3) * OVAL.length - 0.14 for fraction in (0.5, 0.9)]
    state = dict(zip(OBJECT_STATE_COLUMNS, simulation.state[0, -6:].tolist(), strict=True))
    for i in range(2):
        assert state[f"object_closeness_{i}"] == pytest.approx(1 / (1 + ahead[i]), rel=0.02)
        assert abs(state[f"object_offset_{i}"]) == pytest.approx(0.5, rel=0.05)
        assert state[f"object_speed_{i}"] == 0.0
    assert state["object_offset_0"] * state["object_offset_1"] < 0.0


# --- the same bits

MIXED = Objects(
    obstacles=Obstacles(count=4, placement="random", min_distance=1.0),
    bots=Bots(count=2, placement="random", speed=0.8, changes_lane=True),
)


def drive(batch: int, num_threads: int) -> list[bytes]:
    seen = []
    for first in range(0, 12, batch):
        cars = np.arange(first, min(first + batch, 12))
        settings = {"objects": MIXED, "num_threads": num_threads, "max_steps": 25, "direction": "alternate"}
        simulation = Simulation(OVAL, num_envs=len(cars), camera=None, start=Start(mode="random"), **settings)
        simulation.reset(seeds=cars.astype(np.uint64))
        log = [b""] * len(cars)
        for step in range(60):
            actions = np.column_stack([0.3 * np.sin(cars + 0.3 * step), 1.0 + 0.1 * cars])
            simulation.step(actions)
            for i in range(len(cars)):
                log[i] += simulation.judged[i].tobytes() + simulation.state[i].tobytes()
            simulation.reset(simulation.terminated | simulation.truncated)
        seen += log
    return seen


def test_batch_and_threads_change_no_bit():
    expected = drive(12, 1)
    assert drive(1, 1) == expected
    assert drive(5, 2) == expected
    assert drive(12, 7) == expected


def test_a_saved_world_goes_on_to_the_bit_and_a_broken_one_is_refused():
    one, other = (Simulation(OVAL, num_envs=5, camera=None, objects=MIXED, seed=seed) for seed in (1, 2))
    for step in range(60):
        one.step(np.tile(GO, (5, 1)))
        if step == 20:
            other.load(one.save())
        elif step > 20:
            other.step(np.tile(GO, (5, 1)))
            assert one.judged.tobytes() == other.judged.tobytes()
            assert one.state.tobytes() == other.state.tobytes()
    good = one.save()
    size = 2 * 5  # the flags come last, the objects before them
    for value in (0xFF, 0x7F):
        bad = good.copy()
        bad[-size - 64 : -size] = value
        with pytest.raises(ShapeError):
            one.load(bad)
    assert (one.save() == good).all()


# --- hostile worlds

NARROW = load_track("reinvent_2018")


@pytest.mark.parametrize(
    "objects",
    [
        boxes(*[(0.0, 1)] * 3, *[(0.0, -1)] * 3),
        boxes(*[(0.5, 1)] * 16, *[(0.5, -1)] * 16),
        Objects(obstacles=Obstacles(count=32, placement="random", min_distance=1000.0)),
        bots((0.0, 1), (0.0, 1), (0.97, -1), speed=10.0, changes_lane=True, shortest_stay=0.1, longest_stay=0.1),
        Objects(obstacles=Obstacles(count=16), bots=Bots(count=16, speed=4.0, placement="random", changes_lane=True)),
    ],
    ids=["on the start line", "all in one place", "no room", "faster than the car", "crowded"],
)
@pytest.mark.parametrize("track", [NARROW, STRAIGHT], ids=["closed", "open"])
def test_hostile_worlds_end_by_the_rules(objects, track):
    simulation = Simulation(track, num_envs=8, camera=None, objects=objects, max_steps=200, start=Start(spread=True))
    ends = 0
    rng = np.random.default_rng(0)
    for _ in range(300):
        simulation.step(rng.uniform([-0.5, 0.1], [0.5, 4.0], (8, 2)))
        assert np.isfinite(simulation.judged).all()
        assert np.isfinite(simulation.state).all()
        done = simulation.terminated | simulation.truncated
        ends += int(done.sum())
        simulation.reset(done)
    assert ends >= 8
