"""Races of several cars for tests: on a straight road or an oval, and what can be read off them."""

from __future__ import annotations

import numpy as np
import objects_reference as reference

from racecraft.sim import STATUS_NAMES, Bots, CameraSpec, Objects, Obstacles, Simulation, Start
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track import Track, load_track

OVAL = load_track("oval")
SMALL = CameraSpec(width=32, height=24)
MIXED = Objects(
    obstacles=Obstacles(count=3, placement="random", min_distance=1.0),
    bots=Bots(count=2, placement="random", speed=0.8, changes_lane=True),
)
MESSY = Start(mode="random", lateral_jitter=0.05, heading_jitter=0.2, shuffle=True)


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
