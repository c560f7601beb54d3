"""Several cars on one track: the same bits whatever the batch, and nobody is preferred."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from several_cars import MESSY, MIXED, OVAL, SMALL, duel, octagon

from racecraft import _native
from racecraft.errors import ShapeError
from racecraft.sim import CameraSpec, Simulation, Start, Vehicle
from racecraft.sim.columns import ROW_COLUMNS, row_width
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track import Track

CARS = 24  # in all, whatever the batch
STEPS = 60

# Judged rows, states, scans and vehicles of six races of four cars. Only a change on purpose changes it.
GOLDEN = "551306e0226e2b25fa05d79c44b31a1425979630342a210a4af6234e9e8ffe98"


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


@pytest.mark.costly
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
