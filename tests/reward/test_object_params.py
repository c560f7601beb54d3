"""The params dict tells of objects with AWS's keys, types and units."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.errors import ShapeError
from racecraft.reward import RewardWorker, load_reward
from racecraft.reward import params as layout
from racecraft.reward.params import format_params, make_params
from racecraft.reward.worker import waypoints_of
from racecraft.sim import OBJECT_COLUMNS, OBJECT_HEADER, Bots, Objects, Obstacles, Simulation, Start
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track import load_track

OVAL = load_track("oval")
OBJECTS = Objects(
    obstacles=Obstacles(count=2, placement="fixed", positions=((0.2, 1), (0.9, -1))),
    bots=Bots(count=1, placement="fixed", positions=((0.4, -1),), speed=0.5),
)


@pytest.fixture
def simulation() -> Simulation:
    cars = Simulation(OVAL, num_envs=3, camera=None, objects=OBJECTS, start=Start(mode="fixed", offset=0.1))
    cars.place(1, 0.5 * OVAL.length)
    cars.place(2, 0.2 * OVAL.length - 0.4, offset=float(cars.object_column("object_offset")[0, 0]))
    cars.step(np.tile(np.float32([0.0, 1.0]), (3, 1)))
    return cars


def test_the_layout_is_the_simulations():
    assert len(ROW_COLUMNS) == layout.ROW_SIZE
    assert len(OBJECT_HEADER) == layout.OBJECT_HEADER_SIZE
    assert len(OBJECT_COLUMNS) == layout.OBJECT_SIZE
    assert OBJECT_KINDS.index("bot_car") == layout.FIRST_MOVING_KIND


def test_every_key_has_its_value(simulation):
    waypoints = waypoints_of([OVAL])
    params = [make_params(row, waypoints) for row in simulation.judged.tolist()]
    column = simulation.object_column
    for car, seen in enumerate(params):
        assert seen["objects_location"] == list(
            zip(column("object_x")[car].tolist(), column("object_y")[car].tolist(), strict=True)
        )
        assert seen["objects_left_of_center"] == (column("object_offset")[car] > 0).tolist()
        assert seen["objects_speed"] == [0.0, 0.0, 0.5]
        assert seen["objects_heading"] == [0.0, 0.0, column("object_heading")[car, 2]]
        assert seen["objects_distance"] == column("object_distance")[car].tolist()
        assert seen["objects_distance_from_center"] == np.abs(column("object_offset")[car]).tolist()
        assert type(seen["objects_left_of_center"][0]) is bool
        assert all(type(value) is float for value in seen["objects_speed"])
    assert [seen["closest_objects"] for seen in params] == [[1, 0], [2, 1], [1, 0]]
    assert all(type(index) is int for index in params[0]["closest_objects"])
    assert [seen["object_in_camera"] for seen in params][2] is True
    assert [seen["is_crashed"] for seen in params] == [False, False, True]
    assert "objects_location" in format_params(params[0])


def test_the_dict_has_the_same_keys_with_and_without_objects(simulation):
    waypoints = waypoints_of([OVAL])
    bare = Simulation(OVAL, camera=None)
    with_objects = make_params(simulation.judged[0].tolist(), waypoints)
    assert list(with_objects) == list(make_params(bare.judged[0].tolist(), waypoints)) == list(layout.TEMPLATE)


def test_the_worker_pays_the_object_avoidance_preset(simulation):
    with RewardWorker(load_reward("object_avoidance"), OVAL, num_objects=3) as worker:
        free, passed, crashed = worker(simulation.judged)
        assert free == pytest.approx(5.001)
        assert crashed < free
        assert passed == pytest.approx(5.001)
        with pytest.raises(ShapeError, match=r"expected \(N, 49\)"):
            worker(simulation.rows)
    with RewardWorker(load_reward("centerline"), OVAL) as worker, pytest.raises(ShapeError, match=r"\(N, 24\)"):
        worker(simulation.judged)
