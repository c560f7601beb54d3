"""Several cars on one track: who sees whom, and who is at fault."""

from __future__ import annotations

import numpy as np
import objects_reference as reference
import pytest
from several_cars import STRAIGHT, duel, kinds, stand, status

from racecraft.sim import Bots, CameraSpec, Objects, Obstacles, Simulation, Start
from racecraft.sim.columns import ROW_COLUMNS, row_width, state_width
from racecraft.sim.views import RACER_COLORS, CarView, views_of_objects

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
    assert simulation.object_column("object_y")[0, 0] < -50.0
    assert simulation.object_column("object_offset")[0, 0] > 50.0
    for each in (simulation, alone):  # looks to where it is parked
        each.set_pose(0, 0.0, 0.0, -0.75 * np.pi)
    np.testing.assert_array_equal(simulation.frames[0], alone.frames[0])
    stand(simulation)
    assert simulation.object_column("object_in_camera")[0] == 0.0
    simulation.set_pose(0, 5.8, 0.55, 0.0)
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


def test_a_car_that_stands_as_a_penalty_sees_the_others_drive_on():
    simulation = duel(2, camera=CameraSpec())
    simulation.set_pose(0, 5.0, 0.0, 0.0)
    simulation.set_pose(1, 5.5, 0.0, 0.0, speed=2.0)
    simulation.freeze(0, 3)
    for _ in range(3):
        before = simulation.frames[0].copy()
        simulation.step([[0.0, 2.0]] * 2)
        assert status(simulation, 0) == "pause"
        assert (simulation.frames[0] != before).any()


def test_whose_episode_is_over_sees_nothing_more():
    simulation = duel(2, camera=CameraSpec())
    simulation.set_pose(0, 6.0, 0.0, 0.0)
    simulation.set_pose(1, 5.0, 0.7, 0.0)  # off the track
    stand(simulation)
    assert status(simulation, 1) == "off_track"
    last = simulation.frames[1].copy()
    simulation.set_pose(0, 5.5, 0.6, 0.0)
    np.testing.assert_array_equal(simulation.frames[1], last)


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
