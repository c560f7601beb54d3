"""Where perception learns: cars drive badly through randomised worlds, and what is on the road is known.

tracks, `Episodes` ──simulation, a bad driver──▶ frames, truth
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.truth import Truth
from racecraft.sim import STATE_COLUMNS, Objects, Obstacles, Simulation, Start
from racecraft.track import load_tracks

Floats = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Episodes:
    """Where cars begin, how badly they drive, and for how long."""

    lateral: float = 0.3
    """m to either side of the middle where they begin."""
    turned: float = 0.4
    """rad to either side of the road's direction in which they begin."""
    sway: float = 0.15
    """m, standard deviation of where the driver aims across the road."""
    fastest: float = 3.0
    """m/s that it drives at most."""
    steps: int = 30
    """Until they are put somewhere else."""


USUAL: Final = Episodes()


class World:
    """Cars that drive badly: near the middle or not, straight or not, fast or slow, and now and then away.

    Args:
        tracks: Names, as of `load_tracks`.
        episodes: How they drive.
        num_envs: Cars, N.
        seed: Decides everything.
        randomize: Preset of the conditions.
        objects: Boxes on each track.
    """

    begins: NDArray[np.bool_]
    """Cars that were put somewhere else by the last look  (N,)."""
    commands: Floats
    """What cars were told in it, steering angle in rad and speed in m/s; NaN of those that were put  (N, 2)."""

    def __init__(
        self,
        tracks: list[str],
        episodes: Episodes = USUAL,
        *,
        num_envs: int,
        seed: int,
        randomize: str,
        objects: int = 0,
    ) -> None:
        self.simulation = Simulation(
            load_tracks(tracks),
            num_envs=num_envs,
            seed=seed,
            start=Start(mode="random", lateral_jitter=episodes.lateral, heading_jitter=episodes.turned),
            direction="alternate",
            track_order="random",
            randomize=randomize,
            max_steps=episodes.steps,
            num_threads=1,
            objects=Objects(obstacles=Obstacles(count=objects, placement="random")) if objects else Objects(),
        )
        self._truth = Truth(self.simulation)
        self._rng = np.random.default_rng([seed, 0x70657263])
        self._sway, self._fastest = episodes.sway, episodes.fastest
        self.begins = np.ones(num_envs, bool)
        self.commands = np.full((num_envs, 2), np.nan, np.float32)
        self._aim = self._rng.normal(0.0, episodes.sway, num_envs)
        self._pace = self._rng.uniform(0.6, 2.5, num_envs)

    def look(self) -> tuple[NDArray[np.uint8], Floats]:
        """Drive a step; the pictures there, to be copied (N, 120, 160), and the targets (N, NUM_TARGETS)."""
        simulation, commands = self.simulation, self.drive()
        simulation.step(commands)
        self.begins = simulation.terminated | simulation.truncated
        self.commands = np.where(self.begins[:, None], np.float32(np.nan), commands)
        simulation.reset(self.begins)
        return simulation.frames, self._truth.targets()

    def drive(self) -> Floats:
        """What a bad driver does next, steering angle in rad and speed in m/s  (N, 2)."""
        simulation, rng = self.simulation, self._rng
        count = simulation.num_envs
        self._aim += rng.normal(0.0, 0.45 * self._sway, count) - 0.1 * self._aim
        self._pace = np.where(rng.random(count) < 0.05, rng.uniform(0.5, self._fastest, count), self._pace)
        state = dict(zip(STATE_COLUMNS, simulation.state.T.astype(np.float64), strict=False))
        aside = state["offset"] * state["half_width"] - self._aim
        steering = np.arctan(0.165 * state["curvature_1"]) - 1.2 * aside - 0.6 * state["sin_heading_error"]
        steering += rng.normal(0.0, 0.1, count)
        return np.stack([steering.clip(-0.5, 0.5), self._pace], axis=1).astype(np.float32)


def roads_of(seed: int, num_roads: int) -> list[str]:
    """Those that perception learns on; a seed's are no other's."""
    known = ["reinvent_2018", "oval", "hairpin"]
    num_tight = num_roads // 4
    wide = [f"generated:{1000 * seed + i}" for i in range(num_roads - num_tight)]
    tight = [f"generated:{1000 * seed + 100 + i},radius=0.45,difficulty=0.9" for i in range(num_tight)]
    return [*known, *wide, *tight]


def worlds(seed: int, *, num_roads: int) -> list[World]:
    """Those that the network learns in."""
    roads = roads_of(seed, num_roads)
    astray = Episodes(lateral=0.9, turned=1.5, steps=8)
    return [
        World(roads, num_envs=72, seed=seed, randomize="real"),
        World(roads, num_envs=96, seed=seed + 1, randomize="strong"),
        World(roads[::2], num_envs=96, seed=seed + 2, randomize="real", objects=10),
        World(roads[1::2], astray, num_envs=24, seed=seed + 3, randomize="real"),
    ]
