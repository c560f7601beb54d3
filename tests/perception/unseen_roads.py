"""Roads that perception never learned from, under strong conditions."""

from __future__ import annotations

from racecraft.sim import Simulation, Start
from racecraft.track import load_tracks


def unseen_roads() -> Simulation:
    """96 cars that begin anywhere on six roads, both ways; the same every time."""
    return Simulation(
        load_tracks(["kidney", "bowtie", "lakeside", "trefoil", "serpent", "boomerang"]),
        num_envs=96,
        seed=5,
        start=Start(mode="random", lateral_jitter=0.1, heading_jitter=0.15),
        direction="alternate",
        track_order="random",
        randomize="strong",
        max_steps=60,
        num_threads=2,
    )
