"""Races that no sane person would hold end by the rules all the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from several_cars import OVAL, SMALL, STRAIGHT, status

from racecraft.sim import Bots, Objects, Obstacles, Simulation, Start
from racecraft.track import Track


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
