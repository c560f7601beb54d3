"""Several cars on one track: the grid, resets, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from several_cars import MIXED, OVAL, duel, octagon, stand, touching

from racecraft.errors import ConfigError
from racecraft.sim import Bots, Objects, Obstacles, Simulation, Start
from racecraft.track import load_track, track_names


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


def test_a_new_race_starts_together_wherever_it_starts():
    simulation = duel(8, 4, track=OVAL, start=Start(mode="random"))
    fronts = []
    for _ in range(3):
        places = simulation.column("projection_distance").reshape(2, 4) % OVAL.length
        behind = (places[:, :1] - places) % OVAL.length
        np.testing.assert_allclose(behind, np.broadcast_to(0.75 * np.arange(4), (2, 4)), atol=0.05)
        fronts += places[:, 0].tolist()
        simulation.reset()
    assert len({round(front, 3) for front in fronts}) == 6


def test_on_an_open_road_the_last_one_starts_at_its_beginning():
    simulation = duel(4, 4)
    assert simulation.vehicles[0].tolist() == pytest.approx([2.25, 1.5, 0.75, 0.0], abs=1e-5)
    assert simulation.column("progress").tolist() == pytest.approx(
        [(x + 0.14) / 20.0 for x in (2.25, 1.5, 0.75, 0.0)], abs=1e-5
    )


@pytest.mark.costly
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
        assert (simulation.track_choice.reshape(4, 3) == index).all()
        simulation.reset()
    assert len(np.unique(index)) == 2


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
