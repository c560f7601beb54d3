"""Several cars on one track: the grid, who sees whom, who is at fault, resets, and the same bits whatever the batch."""

from __future__ import annotations

import hashlib
import math

import numpy as np
import objects_reference as reference
import pytest

from racecraft import _native
from racecraft.errors import ConfigError, ShapeError
from racecraft.sim import STATUS_NAMES, Bots, CameraSpec, Objects, Obstacles, Simulation, Start, Vehicle
from racecraft.sim.columns import ROW_COLUMNS, row_width, state_width
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.sim.views import RACER_COLORS, CarView, views_of_objects
from racecraft.track import Track, load_track, track_names

OVAL = load_track("oval")
SMALL = CameraSpec(width=32, height=24)
CARS = 24  # in all, whatever the batch
STEPS = 60
MIXED = Objects(
    obstacles=Obstacles(count=3, placement="random", min_distance=1.0),
    bots=Bots(count=2, placement="random", speed=0.8, changes_lane=True),
)
MESSY = Start(mode="random", lateral_jitter=0.05, heading_jitter=0.2, shuffle=True)

# Judged rows, states, scans and vehicles of six races of four cars. Only a change on purpose changes it.
GOLDEN = "2900a8bbdff34999117b7a43144e06aa983e3cc89d7dd96186b67384ff076bab"


def octagon() -> Track:
    """A track of literal numbers, so that the golden hash depends on no library."""
    corners = [[4, 0], [3, 2], [0, 3], [-3, 2], [-4, 0], [-3, -2], [0, -3], [3, -2], [4, 0]]
    return Track("octagon", *(scale * np.array(corners, dtype=float) for scale in (1.0, 0.875, 1.125)))


def straight() -> Track:
    x = np.linspace(0.0, 20.0, 81)
    return Track("straight", *(np.stack((x, np.full_like(x, y)), axis=1) for y in (0.0, 0.5, -0.5)))


STRAIGHT = straight()


def duel(num_envs: int = 2, cars_per_race: int = 2, **settings) -> Simulation:
    """Cars on a straight road, without a camera."""
    settings = {"camera": None, "start": Start(mode="fixed"), **settings}
    return Simulation(settings.pop("track", STRAIGHT), num_envs=num_envs, cars_per_race=cars_per_race, **settings)


def status(simulation: Simulation, env: int) -> str:
    return STATUS_NAMES[int(simulation.column("status")[env])]


def kinds(simulation: Simulation, env: int) -> list[str]:
    return [OBJECT_KINDS[int(code)] for code in simulation.object_column("object_kind")[env]]


def stand(simulation: Simulation) -> None:
    simulation.step(np.zeros((simulation.num_envs, 2)))


def poses(simulation: Simulation) -> list[tuple[float, float, float]]:
    return [tuple(simulation.vehicles[:3, env].astype(float).tolist()) for env in range(simulation.num_envs)]


def touching(simulation: Simulation) -> list[tuple[int, int]]:
    """Pairs of cars of one race of which one has a corner in the other."""
    where, size = poses(simulation), simulation.cars_per_race
    pairs = [(a, b) for a in range(simulation.num_envs) for b in range(a + 1, (a // size + 1) * size)]
    return [
        (a, b)
        for a, b in pairs
        if max(reference.overlap(where[a], where[b], "bot_car"), reference.overlap(where[b], where[a], "bot_car")) > 0
    ]


# --- the same bits


def drive(races: int, num_threads: int, choose, *, camera: CameraSpec | None = None) -> str:
    """One hash of all that 24 cars did, driven in simulations of so many races of four."""
    digests = []
    for first in range(0, CARS, 4 * races):
        cars = np.arange(first, min(first + 4 * races, CARS))
        simulation = Simulation(
            octagon(),
            num_envs=len(cars),
            cars_per_race=4,
            camera=camera,
            start=MESSY,
            objects=MIXED,
            direction="alternate",
            max_steps=40,
            lidar=True,
            num_threads=num_threads,
        )
        simulation.reset(seeds=(cars // 4).astype(np.uint64))
        hashes = [hashlib.sha256() for _ in cars]
        for step in range(STEPS):
            simulation.step(choose(step, cars))
            done = simulation.terminated | simulation.truncated
            for env, car_hash in enumerate(hashes):
                for array in (
                    simulation.judged,
                    simulation.state,
                    simulation.lidar,
                    simulation.vehicles.T,
                    simulation.frames,
                ):
                    car_hash.update(array[env].tobytes() if len(array) else b"")
                car_hash.update(done[env].tobytes())
            # every other race begins anew when all of it is over, the others take cars back one by one
            over = np.repeat(done.reshape(-1, 4).all(axis=1), 4)
            simulation.reset(np.where(cars // 4 % 2 == 0, over, done))
        digests += [car_hash.digest() for car_hash in hashes]
    return hashlib.sha256(b"".join(digests)).hexdigest()


@pytest.mark.parametrize(("races", "num_threads"), [(1, 1), (4, 1), (6, 1), (6, 2), (6, 7)])
def test_golden_hash(races, num_threads, choose):
    assert drive(races, num_threads, choose) == GOLDEN


def test_frames_do_not_depend_on_batch_threads_or_instruction_set(choose):
    best = _native.isa()
    expected = drive(6, 1, choose, camera=SMALL)
    assert drive(1, 2, choose, camera=SMALL) == expected
    try:
        for isa in _native.available_isas():
            _native.set_isa(isa)
            assert drive(4, 7, choose, camera=SMALL) == expected
            assert drive(6, 1, choose) == GOLDEN
    finally:
        _native.set_isa(best)


def test_one_car_to_a_race_is_as_before(choose):
    """The same as a simulation that knows nothing of races, and no wider."""
    one = Simulation(octagon(), num_envs=6, camera=SMALL, objects=MIXED, start=Start(mode="random"))
    other = Simulation(octagon(), num_envs=6, camera=SMALL, objects=MIXED, start=Start(mode="random"), cars_per_race=1)
    for step in range(20):
        for simulation in (one, other):
            simulation.step(choose(step, np.arange(6)))
    assert one.judged.tobytes() == other.judged.tobytes()
    assert (one.save() == other.save()).all()
    assert one.num_objects == 5
    assert Simulation(OVAL, camera=None).judged.shape == (1, row_width(0))


def test_the_order_of_the_cars_means_nothing():
    """Whoever sits in which car: the same poses and commands give the same world."""
    rng = np.random.default_rng(3)
    order = np.array([2, 0, 3, 1])
    one, other = (duel(4, 4, track=OVAL, camera=SMALL, objects=MIXED, vehicle=Vehicle()) for _ in range(2))
    for env in range(4):
        place = 1.0 + 0.45 * env, 0.1 * (-1) ** env
        one.place(env, place[0], offset=place[1])
        other.place(int(order[env]), place[0], offset=place[1])
    for _ in range(60):
        actions = np.column_stack([rng.uniform(-0.3, 0.3, 4), rng.uniform(0.5, 2.0, 4)]).astype(np.float32)
        moved = np.empty_like(actions)
        moved[order] = actions
        one.step(actions)
        other.step(moved)
        np.testing.assert_array_equal(one.vehicles, other.vehicles[:, order])
        columns = [i for i, name in enumerate(ROW_COLUMNS) if name not in ("progress",)]  # from starts of their own
        np.testing.assert_array_equal(one.rows[:, columns], other.rows[order][:, columns])
        np.testing.assert_array_equal(one.state, other.state[order])
        np.testing.assert_array_equal(
            np.sort(one.object_column("object_x")), np.sort(other.object_column("object_x")[order])
        )


def test_mirrored_races_are_mirror_images():
    flip = np.array([1.0, -1.0])
    bend = [[0, 0], [4, 0], [8, 2], [12, 2], [16, 5], [20, 5]]
    line = np.array(bend, dtype=float)
    left, right = line + np.array([0.0, 0.45]), line - np.array([0.0, 0.45])
    track, twin = Track("bend", line, left, right), Track("bend", line * flip, left * flip, right * flip)
    rng = np.random.default_rng(4)
    one, other = (duel(80, 4, track=each, vehicle=Vehicle(steering_bias=0.0)) for each in (track, twin))
    for env in range(80):
        x, y, turn = rng.uniform([1.0, -0.3, -0.3], [2.2, 0.3, 0.3])
        one.set_pose(env, x, y, turn)
        other.set_pose(env, x, -y, -turn)
    crashes = 0
    for _ in range(60):
        actions = np.column_stack([rng.uniform(-0.4, 0.4, 80), rng.uniform(0.3, 3.0, 80)]).astype(np.float32)
        one.step(actions)
        other.step(actions * np.float32([-1, 1]))
        for column in ("progress", "status", "steps", "all_wheels_on_track", "is_crashed"):
            np.testing.assert_array_equal(one.column(column), other.column(column))
        np.testing.assert_array_equal(one.object_column("crashed_object"), other.object_column("crashed_object"))
        np.testing.assert_array_equal(one.object_column("object_in_camera"), other.object_column("object_in_camera"))
        there = one.object_column("object_kind") != OBJECT_KINDS.index("gone_racer")
        np.testing.assert_array_equal(one.object_column("object_y")[there], -other.object_column("object_y")[there])
        crashes += int(one.column("is_crashed").sum())
    assert crashes > 10


def test_a_saved_race_goes_on_to_the_bit(choose):
    settings = {"cars_per_race": 3, "camera": SMALL, "objects": MIXED, "start": MESSY, "max_steps": 30}
    one, other = (Simulation(OVAL, num_envs=6, seed=seed, **settings) for seed in (1, 2))
    for step in range(60):
        one.step(choose(step, np.arange(6)))
        if step == 25:
            other.load(one.save())
        elif step > 25:
            other.step(choose(step, np.arange(6)))
            assert one.judged.tobytes() == other.judged.tobytes()
        if step >= 25:
            assert one.frames.tobytes() == other.frames.tobytes()
            assert one.state.tobytes() == other.state.tobytes()
            other.reset(other.terminated | other.truncated)
        one.reset(one.terminated | one.truncated)
    good = one.save()
    for bad in (good[:-1], np.full_like(good, 255), Simulation(OVAL, num_envs=6, camera=None).save()):
        with pytest.raises(ShapeError):
            one.load(bad)
    assert (one.save() == good).all()


# --- who is around


def test_the_others_are_objects_in_their_order_without_oneself():
    simulation = duel(8, 4, objects=Objects(obstacles=Obstacles(count=2)))
    assert simulation.judged.shape == (8, row_width(5))
    assert simulation.state.shape == (8, state_width(5))
    for env in range(8):
        simulation.set_pose(env, 1.0 + env, 0.0, 0.0)
    stand(simulation)
    for env in range(8):
        first = env // 4 * 4
        others = [car for car in range(first, first + 4) if car != env]
        assert kinds(simulation, env) == ["box"] * 2 + ["racer"] * 3
        assert simulation.object_column("object_x")[env, 2:].tolist() == [1.0 + car for car in others]
        assert simulation.object_column("object_distance")[env, 2:].tolist() == [1.0 + car for car in others]
    closest = [
        (int(p), int(n))
        for p, n in zip(
            simulation.object_column("closest_object_prev"),
            simulation.object_column("closest_object_next"),
            strict=True,
        )
    ]
    assert closest[1] == (2, 3)  # car 1 has car 0 behind it and car 2 ahead


def test_the_driver_and_the_lidar_see_another_car_as_a_parked_one():
    parked = Objects(obstacles=Obstacles(count=1, kind="car", placement="fixed", positions=((0.5, 1),)))
    one = Simulation(STRAIGHT, objects=parked, lidar=True, start=Start(mode="fixed"))
    other = Simulation(STRAIGHT, num_envs=2, cars_per_race=2, lidar=True, start=Start(mode="fixed"))
    empty = Simulation(STRAIGHT, lidar=True, start=Start(mode="fixed"))
    place = [float(one.object_column(f"object_{name}")[0, 0]) for name in ("x", "y", "heading")]
    other.set_pose(1, *place)
    for distance, turn in ((0.6, 0.0), (1.5, 0.1), (3.0, -0.05), (-1.0, 0.0), (-0.5, 0.3)):
        for simulation in (one, other, empty):
            simulation.set_pose(0, place[0] - distance, 0.1, turn)
        np.testing.assert_array_equal(one.lidar[0], other.lidar[0])
        changed = [each.frames[0] != empty.frames[0] for each in (one, other)]
        assert (changed[0] != changed[1]).sum() <= 0.02 * changed[0].sum()  # a shade may be that of the road by chance
        assert (other.frames[0] != empty.frames[0]).any() == (distance > 0)


def test_a_car_whose_episode_is_over_is_neither_seen_nor_hit():
    simulation = duel(2, camera=CameraSpec())
    alone = Simulation(STRAIGHT, start=Start(mode="fixed"))
    simulation.set_pose(1, 6.0, 0.62, 0.0)  # off the track
    simulation.set_pose(0, 5.0, 0.0, 0.0)
    stand(simulation)
    assert status(simulation, 1) == "off_track"
    assert kinds(simulation, 0) == ["racer"]  # when this step was judged
    alone.set_pose(0, 5.0, 0.0, 0.0)
    np.testing.assert_array_equal(simulation.frames[0], alone.frames[0])
    simulation.set_pose(0, 5.8, 0.55, 0.0)
    stand(simulation)
    assert kinds(simulation, 0) == ["gone_racer"]
    assert status(simulation, 0) == "in_progress"
    assert simulation.object_column("object_in_camera")[0] == 0.0
    assert simulation.state[0, -6:].tolist() == [0.0] * 6
    assert simulation.object_column("object_x")[0, 0] < -50.0
    simulation.set_pose(1, 6.0, 0.55, 0.0)
    stand(simulation)
    assert kinds(simulation, 0) == ["racer"]
    assert status(simulation, 0) == "crashed"


def test_what_is_done_to_a_car_between_steps_is_seen_at_once():
    simulation = duel(2, camera=CameraSpec())
    simulation.set_pose(0, 5.0, 0.0, 0.0)
    before = simulation.frames[0].copy()
    simulation.set_pose(1, 6.0, 0.0, 0.0)
    assert (simulation.frames[0] != before).any()
    simulation.set_pose(1, 2.0, 0.0, 0.0)
    np.testing.assert_array_equal(simulation.frames[0], before)


# --- at fault


def test_only_the_one_behind_is_at_fault():
    rng = np.random.default_rng(5)
    simulation = duel(800)
    simulation.reset()
    crashed = 0
    placed = []
    for race in range(400):
        dx, dy, turn, other = rng.uniform(-1, 1, 4) * [0.5, 0.3, 3.1, 0.5]
        placed.append(((10.0 + dx, dy, turn), (10.0, 0.0, other)))
        for car in range(2):
            simulation.set_pose(2 * race + car, *placed[-1][car])
    stand(simulation)
    for race, pair in enumerate(placed):
        for car in range(2):
            me, other = pair[car], pair[1 - car]
            depth = reference.overlap(me, other, "bot_car")
            if abs(depth) < 1e-5 or abs(me[0] - other[0]) < 1e-3:
                continue
            expected = depth > 0.0 and me[0] < other[0]
            assert (status(simulation, 2 * race + car) == "crashed") == expected, pair
            assert simulation.object_column("crashed_object")[2 * race + car] == (0 if expected else -1)
            crashed += expected
        assert not simulation.column("is_crashed")[2 * race : 2 * race + 2].all()
    assert crashed > 60


def test_cars_of_different_races_pass_through_each_other():
    simulation = duel(4)
    for env in range(4):
        simulation.set_pose(env, 5.0 + 0.2 * (env // 2) + 2.0 * (env % 2), 0.0, 0.0)
    stand(simulation)
    assert [status(simulation, env) for env in range(4)] == ["in_progress"] * 4


def test_a_frozen_car_cannot_be_hit_and_is_solid_again_afterwards():
    simulation = duel(2)
    simulation.set_pose(0, 5.0, 0.0, 0.0)
    simulation.set_pose(1, 5.2, 0.0, 0.0)
    simulation.freeze(1, 3)
    for _ in range(3):
        stand(simulation)
        assert [status(simulation, env) for env in range(2)] == ["in_progress", "pause"]
        assert kinds(simulation, 0) == ["frozen_racer"]
    stand(simulation)
    assert kinds(simulation, 0) == ["racer"]
    assert [status(simulation, env) for env in range(2)] == ["crashed", "in_progress"]


def test_a_bot_waits_behind_any_car_of_the_race_and_passes_what_cannot_be_hit():
    simulation = duel(3, 3, objects=Objects(bots=Bots(count=1, placement="fixed", positions=((0.2, 1),), speed=0.6)))
    simulation.set_pose(0, 1.0, -0.3, 0.0)
    simulation.set_pose(1, 1.5, -0.3, 0.0)
    for _ in range(40):
        simulation.set_pose(2, 5.0, 0.25, 0.0)
        stand(simulation)
        simulation.set_pose(0, 1.0, -0.3, 0.0)  # or they would be immobilized
        simulation.set_pose(1, 1.5, -0.3, 0.0)
    assert 5.0 - simulation.object_column("object_x")[0, 0] == pytest.approx(0.35, abs=0.03)
    assert simulation.object_column("object_speed")[0, 0] == 0.0
    simulation.freeze(2, 60)
    for _ in range(60):
        stand(simulation)
        simulation.set_pose(0, 1.0, -0.3, 0.0)
        simulation.set_pose(1, 1.5, -0.3, 0.0)
    assert simulation.object_column("object_x")[0, 0] > 6.0
    x = simulation.object_column("object_x")
    assert x[0, 0] == x[1, 0] == x[2, 0]  # one bot for all


# --- starts


def test_the_grid_is_staggered_in_two_lanes():
    simulation = duel(8, 8, track=OVAL)
    track = simulation.driven_track(0)
    for env in range(8):
        x, y = simulation.vehicles[:2, env].astype(float)
        s, offset = track.project([x, y])
        behind = (0.0 - s) % track.length
        assert min(behind, track.length - behind) == pytest.approx(0.75 * env, abs=0.05)
        border = track.inner if env % 2 else track.outer
        middle = np.abs(track.project(0.5 * (track.centerline + border)[0])[1])
        side = np.sign(track.project(0.5 * (track.centerline + border)[0])[1])
        assert offset == pytest.approx(side * middle, abs=0.05)
        assert abs(simulation.column("progress")[env]) < 0.02  # each drives a lap from its own place
    assert touching(simulation) == []


def test_a_shuffled_grid_draws_who_starts_where():
    simulation = duel(300, 3, track=OVAL, start=Start(mode="fixed", shuffle=True))
    fronts = np.zeros(3)
    for race in range(100):
        x = simulation.column("projection_distance")[3 * race : 3 * race + 3]
        fronts[int(np.argmin((-x) % OVAL.length))] += 1
    assert fronts.min() > 15


def test_on_an_open_road_the_last_one_starts_at_its_beginning():
    simulation = duel(4, 4)
    assert simulation.vehicles[0].tolist() == pytest.approx([2.25, 1.5, 0.75, 0.0], abs=1e-5)
    assert simulation.column("progress").tolist() == pytest.approx(
        [(x + 0.14) / 20.0 for x in (2.25, 1.5, 0.75, 0.0)], abs=1e-5
    )


@pytest.mark.parametrize("name", track_names())
def test_nobody_starts_on_anything(name):
    track = load_track(name)
    cluttered = Objects(
        obstacles=Obstacles(count=3, placement="fixed", positions=((0.0, 1), (0.0, -1), (0.97, 1))),
        bots=Bots(count=2, placement="random"),
    )
    for objects in (Objects(), cluttered):
        for mode in ("fixed", "random"):
            simulation = duel(32, 8, track=track, objects=objects, start=Start(mode=mode), num_threads=1)
            assert touching(simulation) == []
            for part in (3, 2):
                simulation.reset(np.arange(32) % part == 1)
                assert touching(simulation) == []
            stand(simulation)
            assert (simulation.column("is_crashed") == 0.0).all()


def test_a_reset_of_some_leaves_the_others_where_they_are_and_the_objects_too():
    simulation = duel(8, 4, track=OVAL, objects=MIXED, start=Start(mode="random"))
    for step in range(10):
        simulation.step(np.tile(np.float32([0.0, 0.5 + 0.01 * step]), (8, 1)))
    before, boxes = simulation.vehicles.copy(), simulation.object_column("object_x")[:, :3].copy()
    steps = simulation.column("steps").copy()
    mask = np.array([False, True, False, False, True, True, True, True])
    simulation.reset(mask)
    assert (simulation.vehicles[:, ~mask] == before[:, ~mask]).all()
    assert (simulation.vehicles[:2, mask] != before[:2, mask]).any(axis=0).all()
    assert simulation.column("episode").tolist() == mask.astype(float).tolist()
    stand(simulation)
    assert (simulation.column("steps") == np.where(mask, 2.0, steps + 1.0)).all()
    after = simulation.object_column("object_x")[:, :3]
    assert (after[:4] == boxes[:4]).all()
    assert (after[4:] != boxes[4:]).all()


def test_races_of_many_tracks_share_theirs():
    simulation = Simulation([OVAL, octagon()], num_envs=12, cars_per_race=3, camera=None, track_order="random")
    for _ in range(10):
        index = simulation.column("track_index").reshape(4, 3)
        assert (index == index[:, :1]).all()
        simulation.reset()
    assert len(np.unique(index)) == 2


# --- hostile settings


@pytest.mark.parametrize(
    "settings",
    [
        {"cars_per_race": 0},
        {"cars_per_race": 9, "num_envs": 9},
        {"cars_per_race": 2.0, "num_envs": 2},
        {"cars_per_race": True},
        {"cars_per_race": 2, "num_envs": 3},
    ],
)
def test_impossible_races_are_refused(settings):
    with pytest.raises(ConfigError, match="cars_per_race"):
        Simulation(OVAL, camera=None, **settings)


def test_seeds_are_for_whole_races():
    simulation = duel(4)
    for mask, seeds in (([1, 0, 1, 1], [1, 1, 1, 1]), ([1, 1, 0, 0], [1, 2, 3, 3])):
        with pytest.raises(ConfigError, match="whole races"):
            simulation.reset(np.array(mask, dtype=bool), seeds=np.array(seeds, dtype=np.uint64))
    simulation.reset(np.array([1, 1, 0, 0], dtype=bool), seeds=np.array([5, 5, 6, 7], dtype=np.uint64))


def narrow(width: float) -> Track:
    angle = np.linspace(0.0, 2.0 * math.pi, 61)[:, None]
    ring = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1] = ring[0]
    return Track("ring", 1.5 * ring, (1.5 - width / 2) * ring, (1.5 + width / 2) * ring)


@pytest.mark.parametrize("seed", range(20))
def test_hostile_races_end_by_the_rules(seed):
    """Ten races each: overlapping boxes, boxes on the start line, fast bots, eight cars where there is room for two."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 9))
    positions = tuple((float(rng.choice([0.0, 0.001, rng.random()])), int(rng.choice([-1, 1]))) for _ in range(8))
    objects = Objects(
        obstacles=Obstacles(count=8, placement="fixed", positions=positions) if seed % 3 else None,
        bots=Bots(count=6, placement="random", min_distance=0.0, speed=10.0, changes_lane=True, shortest_stay=0.1)
        if seed % 2
        else None,
    )
    simulation = Simulation(
        [narrow(float(rng.choice([0.25, 0.6]))), STRAIGHT, OVAL][seed % 3],
        num_envs=10 * size,
        cars_per_race=size,
        camera=SMALL,
        lidar=True,
        objects=objects,
        start=Start(mode=str(rng.choice(["fixed", "random"])), shuffle=True),
        time_limit=12.0,
        num_threads=1,
    )
    ended = []
    for step in range(200):
        actions = np.column_stack([rng.uniform(-0.6, 0.6, 10 * size), rng.uniform(0.0, 4.0, 10 * size)])
        simulation.step(actions)
        for array in (simulation.judged, simulation.state, simulation.lidar, simulation.vehicles):
            assert np.isfinite(array).all()
        done = simulation.terminated | simulation.truncated
        ended += [status(simulation, env) for env in np.flatnonzero(done)]
        if step < 100:
            simulation.reset(done & (rng.random(10 * size) < 0.5))
        elif done.all():
            break
    assert done.all()
    assert set(ended) <= {"lap_complete", "crashed", "off_track", "immobilized", "reversed", "time_up"}


# --- pictures


def test_the_cars_of_a_race_have_colours_of_their_own_and_frozen_ones_blink():
    simulation = duel(3, 3)
    for env in range(3):
        simulation.set_pose(env, 3.0 + env, 0.0, 0.0)
    simulation.freeze(2, 10)
    simulation.set_pose(1, 4.0, 0.9, 0.0)
    stand(simulation)
    stand(simulation)
    colors = {}
    for env in (0, 2):
        views = views_of_objects(simulation.judged[env, len(ROW_COLUMNS) :], car=env, alpha=0.4)
        assert len(views) == 1  # car 1 is off the track and gone
        assert isinstance(views[0], CarView)
        colors[2 - env] = views[0].color
        assert views[0].alpha == (0.4 if env == 0 else 1.0)
    assert colors == {0: RACER_COLORS[0], 2: RACER_COLORS[2]}
    assert len(set(RACER_COLORS)) == 8
