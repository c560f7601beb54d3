"""The LIDAR against rays walked step by step, its noise, and the forms AWS's sensors have."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft import _native
from racecraft.sim import Bots, Objects, Obstacles, Simulation, Start
from racecraft.track import load_track

OVAL = load_track("oval")
MIXED = Objects(
    obstacles=Obstacles(count=4, placement="random", min_distance=1.0),
    bots=Bots(count=3, placement="random", speed=0.0),
)
SIZES = {0: (0.4, 0.3), 1: (0.3235, 0.1961), 2: (0.3235, 0.1961)}  # m, by kind: as they are, without a buffer
ANGLES = math.pi - 2.61799 + np.arange(64) * (2 * 2.61799 / 63)


def walk(simulation: Simulation, env: int) -> np.ndarray:
    """Distances of all rays in steps of 5 mm."""
    x, y, heading = (float(value) for value in simulation.vehicles[:3, env])
    x, y = x + 0.02913 * math.cos(heading), y + 0.02913 * math.sin(heading)
    lines = np.concatenate([OVAL.inner, OVAL.outer])
    low, high = lines.min(axis=0) - 0.86, lines.max(axis=0) + 0.86
    steps = np.arange(0.0, 12.0, 0.005)
    points = (
        np.array([x, y])
        + steps[None, :, None] * np.stack([np.cos(heading + ANGLES), np.sin(heading + ANGLES)], axis=1)[:, None, :]
    )
    is_hit = ((points < low) | (points > high)).any(axis=2)
    for kind, ox, oy, turn in zip(
        *(simulation.object_column(f"object_{name}")[env].tolist() for name in ("kind", "x", "y", "heading")),
        strict=True,
    ):
        dx, dy = points[..., 0] - ox, points[..., 1] - oy
        along, across = dx * math.cos(turn) + dy * math.sin(turn), dy * math.cos(turn) - dx * math.sin(turn)
        length, width = SIZES[int(kind)]
        is_hit |= (np.abs(along) <= length / 2) & (np.abs(across) <= width / 2)
    return np.where(is_hit.any(axis=1), steps[is_hit.argmax(axis=1)], 12.0)


def test_rays_end_at_boxes_cars_and_walls():
    simulation = Simulation(OVAL, num_envs=30, camera=None, objects=MIXED, lidar=True, start=Start(mode="random"))
    rng = np.random.default_rng(1)
    for env in range(30):
        offset = float(rng.uniform(-0.3, 0.3))
        simulation.place(env, float(rng.uniform(0.0, OVAL.length)), offset=offset)
    simulation.step(np.zeros((30, 2)))
    errors = []
    for env in range(30):
        expected = walk(simulation, env)
        is_edge = np.abs(np.diff(expected, prepend=expected[0])) > 0.2  # a ray that grazes an edge may pass it
        is_edge |= np.roll(is_edge, -1)
        errors += (simulation.lidar[env] - np.clip(expected, 0.15, 12.0))[~is_edge & (expected > 0.2)].tolist()
    errors = np.array(errors)
    assert len(errors) > 800
    assert np.abs(errors).max() < 0.06
    assert abs(errors.mean()) < 0.005  # half a step of the reference included
    assert errors.std() == pytest.approx(0.01, rel=0.15)


def test_the_gap_is_in_front_and_rays_go_over_the_left():
    """A box 1 m to the left, one behind: seen by the rays that look there; one straight ahead is not seen."""
    for turn, expected in ((-math.pi / 2, range(10, 16)), (math.pi, range(28, 36)), (0.0, ())):
        places = ((0.25, 1),)
        box = Objects(obstacles=Obstacles(count=1, placement="fixed", positions=places))
        simulation = Simulation(OVAL, camera=None, lidar=True, objects=box)
        x, y, heading = (float(simulation.object_column(f"object_{name}")[0, 0]) for name in ("x", "y", "heading"))
        simulation.set_pose(0, x - math.cos(heading), y - math.sin(heading), heading + turn)
        seen = np.flatnonzero(simulation.lidar[0] < 0.95)
        assert set(seen.tolist()) <= set(expected)
        assert len(seen) >= min(3, len(tuple(expected)))


def test_noise_is_normal_and_new_in_every_step_and_car():
    simulation = Simulation(OVAL, num_envs=200, camera=None, lidar=True, start=Start(mode="fixed"))
    assert len(np.unique(simulation.lidar, axis=0)) == 200
    first = simulation.lidar.copy()
    deviation = first - np.median(first, axis=0)
    assert deviation.std() == pytest.approx(0.01, rel=0.03)
    assert (np.abs(deviation) > 0.02).mean() == pytest.approx(0.0455, abs=0.01)
    assert np.abs(deviation).max() > 0.033
    simulation.step(np.zeros((200, 2)))
    assert (first != simulation.lidar).mean() > 0.99
    assert first.min() >= 0.15
    assert first.max() <= 12.0


def test_the_same_bits_for_any_batch_threads_and_instruction_set():
    def drive(batch: int, num_threads: int) -> list[bytes]:
        seen = []
        for begin in range(0, 8, batch):
            cars = np.arange(begin, begin + batch, dtype=np.uint64)
            settings = {"objects": MIXED, "num_threads": num_threads, "camera": None, "lidar": True}
            simulation = Simulation(OVAL, num_envs=batch, **settings)
            simulation.reset(seeds=cars)
            scans = []
            for _ in range(10):
                simulation.step(np.tile(np.float32([0.1, 1.0]), (batch, 1)))
                scans.append(simulation.lidar.copy())
            seen += [scan.tobytes() for scan in np.stack(scans, axis=1)]
        return seen

    best = _native.isa()
    expected = drive(8, 1)
    try:
        for isa in _native.available_isas():
            _native.set_isa(isa)
            assert drive(4, 2) == expected
            assert drive(1, 1) == expected
    finally:
        _native.set_isa(best)


@pytest.mark.parametrize("steps", [0, 1, 5])
def test_a_loaded_simulation_scans_what_the_saved_one_did(steps):
    saved, other = (Simulation(OVAL, num_envs=3, camera=None, lidar=True, seed=seed) for seed in (1, 2))
    for _ in range(steps):
        saved.step(np.tile(np.float32([0.1, 1.0]), (3, 1)))
    other.load(saved.save())
    np.testing.assert_array_equal(other.lidar, saved.lidar)


def test_without_a_lidar_there_are_no_rays():
    assert Simulation(OVAL, num_envs=3, camera=None).lidar.shape == (3, 0)


def test_a_car_outside_the_room_or_in_a_wall_gets_numbers():
    simulation = Simulation(OVAL, num_envs=3, camera=None, lidar=True)
    for env, x in enumerate((1e5, -1e5, OVAL.outer[:, 0].max() + 0.86)):
        simulation.set_pose(env, float(x), 0.0, 0.3)
    assert np.isfinite(simulation.lidar).all()
    assert simulation.lidar.min() >= 0.15
