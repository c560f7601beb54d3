"""The core against the slow reference simulator, on several tracks, in random episodes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reference import Judge, Pose, command, move, rates, wheel_points
from shapely import LinearRing, Point

from racecraft.sim import ROW_COLUMNS, STATUS_NAMES, Simulation, Start, load_vehicle
from racecraft.track import Track, generate_track, load_track

FLOAT32 = 3e-5  # what single precision may cost in one control step, in any unit that a pose has
EXACT = ("steps", "lap", "time", "status", "all_wheels_on_track", "is_offtrack", "closest_prev", "closest_next")
TOLERANCE = {"track_length": 1e-11}
PROJECTED = ("progress", "projection_distance", "offset", "closest_prev", "closest_next", "track_width")


def open_road() -> Track:
    x = np.linspace(0.0, 6.0, 25)
    lines = [np.stack((x, y + 0.1 * np.sin(x)), axis=1) for y in (0.0, 0.5, -0.5)]
    return Track("open road", *lines)


def wide_field() -> Track:
    """A ring road so wide that nothing can leave it in a few seconds."""
    angle = np.linspace(0.0, 2 * np.pi, 201)
    angle[-1] = 0.0
    around = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    return Track("wide field", 50.0 * around, 10.0 * around, 90.0 * around)


def pose_of(simulation: Simulation, env: int) -> Pose:
    return Pose(*simulation.vehicles[:, env].astype(float).tolist())


def wild(rng: np.random.Generator, previous: np.ndarray) -> np.ndarray:
    """Now and then another command for a car, sometimes beyond what is allowed, sometimes a stop."""
    new = np.stack((rng.uniform(-0.7, 0.7, len(previous)), rng.uniform(-0.5, 4.5, len(previous))), axis=1)
    new[rng.random(len(new)) < 0.1, 1] = 0.0
    return np.where(rng.random((len(new), 1)) < 0.2, new, previous)


def turn(a: float, b: float) -> float:
    return abs(math.remainder(a - b, 2 * math.pi))


class Thresholds:
    """Tells where float32 may fall on the other side of a decision than float64."""

    def __init__(self, track: Track) -> None:
        self.track = track
        ends = np.concatenate((track.outer, track.inner[::-1]))
        self.borders = [LinearRing(track.inner), LinearRing(track.outer)] if track.is_closed else [LinearRing(ends)]

    def wheels(self, pose: Pose) -> bool:
        return any(b.distance(Point(wheel)) < FLOAT32 for b in self.borders for wheel in wheel_points(pose))

    def projection(self, row: dict[str, float]) -> bool:
        """True near a waypoint, and where a place far along the track is as near as the nearest."""
        arc = self.track.arc_length
        if np.abs(arc - row["projection_distance"]).min() < FLOAT32:
            return True
        distance = np.hypot(*(self.track.centerline - (row["x"], row["y"])).T)
        apart = np.abs(arc - row["projection_distance"])
        apart = np.minimum(apart, self.track.length - apart) if self.track.is_closed else apart
        return bool(((distance < abs(row["offset"]) + 0.05) & (apart > 0.6)).any())


def row_of(simulation: Simulation, env: int) -> dict[str, float | str]:
    row = dict(zip(ROW_COLUMNS, simulation.rows[env].tolist(), strict=True))
    return row | {"status": STATUS_NAMES[int(row["status"])]}


def begin(simulation: Simulation, track: Track, env: int, *, laps: int) -> Judge:
    """A judge of the episode that a car has just begun."""
    row = row_of(simulation, env)
    assert row["status"] == "prepare"
    start = row["projection_distance"] / track.length - row["progress"]
    judge = Judge(track, start, pose_of(simulation, env), laps=laps)
    assert judge.progress == pytest.approx(row["progress"], abs=1e-6)
    return judge


def compare(row: dict, expected: dict, *, skip: set[str]) -> None:
    for column, value in expected.items():
        if column in skip:
            continue
        if column in EXACT:
            assert row[column] == value, column
        elif column == "heading":
            assert turn(row[column], value) < FLOAT32
        else:
            assert row[column] == pytest.approx(value, abs=TOLERANCE.get(column, FLOAT32)), column


MAKERS = {"generated": lambda: generate_track(5), "open": open_road}


@pytest.mark.costly
@pytest.mark.parametrize("name", ["oval", "reinvent_2018", "bowtie", "generated", "open"])
def test_every_step_of_random_episodes(name):
    """One step at a time from the core's own pose: errors cannot add up, so the tolerance is float32's."""
    track = MAKERS.get(name, lambda: load_track(name))()
    vehicle, num_envs, laps = load_vehicle("v5"), 6, 2 if track.is_closed else 1
    start = Start(mode="random", lateral_jitter=0.2, heading_jitter=0.5)
    simulation = Simulation(track, num_envs=num_envs, camera=None, seed=3, laps=laps, start=start)
    rng, near = np.random.default_rng(7), Thresholds(track)
    actions = np.zeros((num_envs, 2))
    judges = [begin(simulation, track, env, laps=laps) for env in range(num_envs)]
    num_skipped, seen = 0, set()
    for _ in range(150):
        actions = wild(rng, actions)
        before = [pose_of(simulation, env) for env in range(num_envs)]
        simulation.step(actions)
        for env in range(num_envs):
            expected, is_over = judges[env](before[env], tuple(actions[env]))
            row = row_of(simulation, env)
            skip = set(PROJECTED) if near.projection(expected) else set()
            if near.wheels(before[env]):
                skip |= {"status", "all_wheels_on_track", "is_offtrack"}
            compare(row, expected, skip=skip)
            num_skipped += bool(skip)
            assert skip or simulation.terminated[env] == is_over
            seen.add(row["status"])
            if not simulation.terminated[env]:
                moved, now = move(vehicle, before[env], tuple(actions[env])), pose_of(simulation, env)
                assert turn(moved.heading, now.heading) < FLOAT32
                moved.heading = now.heading
                np.testing.assert_allclose(now.array(), moved.array(), atol=FLOAT32)
        done = simulation.terminated | simulation.truncated
        simulation.reset(done)
        for env in np.flatnonzero(done):
            judges[env] = begin(simulation, track, env, laps=laps)
    assert {"in_progress", "off_track"} <= seen
    assert num_skipped < 150 * num_envs / 10


@pytest.mark.parametrize("preset", ["v4", "v5", "v6"])
def test_a_drive_without_correction_stays_within_a_millimetre(preset):
    """Four seconds from the same start with the same commands, nothing copied in between."""
    vehicle = load_vehicle(preset)
    simulation = Simulation(wide_field(), num_envs=8, camera=None, vehicle=vehicle, start=Start(spread=True))
    poses = [pose_of(simulation, env) for env in range(8)]
    rng = np.random.default_rng(1)
    for step in range(60):
        if step % 5 == 0:
            actions = np.stack((rng.uniform(-0.4, 0.4, 8), rng.uniform(0.8, 2.0, 8)), axis=1)
        simulation.step(actions)
        assert not simulation.terminated.any()
        for env in range(8):
            poses[env] = move(vehicle, poses[env], tuple(actions[env]))
            now = pose_of(simulation, env)
            assert math.hypot(poses[env].x - now.x, poses[env].y - now.y) < 1e-3


@pytest.mark.costly
@pytest.mark.parametrize("preset", ["v4", "v5", "v6"])
def test_randomised_cars_move_as_the_reference_says(preset):
    """Every parameter of every car different, extreme commands, slides and spins; step by step."""
    rng = np.random.default_rng(3)
    simulation = Simulation(wide_field(), num_envs=20, camera=None, vehicle=preset, start=Start(spread=True))
    simulation.parameters *= rng.uniform(0.8, 1.2, simulation.parameters.shape).astype(np.float32)
    names = type(simulation.vehicle).__dataclass_fields__
    cars = [
        type(simulation.vehicle)(**dict(zip(names, column.tolist(), strict=True))) for column in simulation.parameters.T
    ]
    actions = np.tile([0.5, 4.0], (20, 1))
    for _ in range(40):
        actions = wild(rng, actions)
        before = [pose_of(simulation, env) for env in range(20)]
        simulation.step(actions)
        for env in np.flatnonzero(~simulation.terminated):
            moved = move(cars[env], before[env], tuple(actions[env]))
            now = pose_of(simulation, env)
            assert turn(moved.heading, now.heading) < 3 * FLOAT32
            moved.heading = now.heading
            np.testing.assert_allclose(now.array(), moved.array(), atol=3 * FLOAT32, rtol=1e-4)
        simulation.reset(simulation.terminated)  # who turned round


def test_commands_are_clipped():
    assert command((9.0, 9.0)) == (math.pi / 4, 9.0)
    assert command((0.1, 90.0)) == (0.1, 12.0)
    assert command((-9.0, -9.0)) == (-math.pi / 4, 0.1)
    assert command((0.1, 0.0)) == (0.1, 0.0)


def test_the_reference_itself_obeys_the_friction_limits():
    rng, car = np.random.default_rng(2), load_vehicle("v5")
    friction = car.front_load * car.front_friction + (1 - car.front_load) * car.rear_friction
    limit = math.hypot(friction * 9.8, max(car.drive_acceleration, car.brake_acceleration))
    for _ in range(500):
        state = rng.uniform([-3, -3, -3, 0, -2, -5, -0.5], [3, 3, 3, 4, 2, 5, 0.5])
        rate = rates(car, state, 0.3, 2.0)
        along, across = rate[3] - state[5] * state[4], rate[4] + state[5] * state[3]
        assert math.hypot(along, across) <= limit * (1 + 1e-9)
