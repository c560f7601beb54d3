"""How perception learns: cars drive badly through randomised worlds, and the network is told what was there.

worlds ──frames, truth──▶ a shuffled store ──minibatches──▶ loss's slopes ──▶ network ──answers──▶ `recalling`
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import NUM_TARGETS
from racecraft.perception.lessons import Lessons
from racecraft.perception.losses import slopes_of
from racecraft.perception.mirror import mirrored_answers, mirrored_observations
from racecraft.perception.network import Perceiver
from racecraft.perception.recalling import STRETCH, Drives, taught
from racecraft.perception.truth import Truth
from racecraft.sim import STATE_COLUMNS, Objects, Obstacles, Simulation, Start
from racecraft.track import load_tracks

Floats = NDArray[np.float32]

USUAL: Final = Lessons()


class World:
    """Cars that drive badly: near the middle or not, straight or not, fast or slow, and now and then away.

    Args:
        tracks: Names, as of `load_tracks`.
        num_envs: Cars, N.
        seed: Decides everything.
        randomize: Preset of the conditions.
        objects: Boxes on each track.
        lateral: m to either side of the middle where episodes start.
        turned: rad to either side of the road's direction in which they start.
        sway: Of the driver: m, standard deviation of where it aims.
        steps: Of an episode.
        fastest: m/s that it drives at most.
    """

    begins: NDArray[np.bool_]
    """Cars that were put somewhere else by the last look  (N,)."""

    def __init__(
        self,
        tracks: list[str],
        *,
        num_envs: int,
        seed: int,
        randomize: str,
        objects: int = 0,
        lateral: float = 0.3,
        turned: float = 0.4,
        sway: float = 0.15,
        steps: int = 30,
        fastest: float = 3.0,
    ) -> None:
        self.simulation = Simulation(
            load_tracks(tracks),
            num_envs=num_envs,
            seed=seed,
            start=Start(mode="random", lateral_jitter=lateral, heading_jitter=turned),
            direction="alternate",
            track_order="random",
            randomize=randomize,
            max_steps=steps,
            num_threads=1,
            objects=Objects(obstacles=Obstacles(count=objects, placement="random")) if objects else Objects(),
        )
        self._truth = Truth(self.simulation)
        self._rng = np.random.default_rng([seed, 0x70657263])
        self._sway, self._fastest = sway, fastest
        self.begins = np.ones(num_envs, bool)
        self._aim = self._rng.normal(0.0, sway, num_envs)
        self._pace = self._rng.uniform(0.6, 2.5, num_envs)

    def look(self) -> tuple[NDArray[np.uint8], Floats]:
        """Drive a step; the pictures there, to be copied (N, 120, 160), and the targets (N, NUM_TARGETS)."""
        simulation, rng = self.simulation, self._rng
        count = simulation.num_envs
        self._aim += rng.normal(0.0, 0.45 * self._sway, count) - 0.1 * self._aim
        self._pace = np.where(rng.random(count) < 0.05, rng.uniform(0.5, self._fastest, count), self._pace)
        state = dict(zip(STATE_COLUMNS, simulation.state.T.astype(np.float64), strict=False))
        aside = state["offset"] * state["half_width"] - self._aim
        steering = np.arctan(0.165 * state["curvature_1"]) - 1.2 * aside - 0.6 * state["sin_heading_error"]
        steering += rng.normal(0.0, 0.1, count)
        simulation.step(np.stack([steering.clip(-0.5, 0.5), self._pace], axis=1))
        self.begins = simulation.terminated | simulation.truncated
        simulation.reset(self.begins)
        return simulation.frames, self._truth.targets()


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
    return [
        World(roads, num_envs=72, seed=seed, randomize="real"),
        World(roads, num_envs=96, seed=seed + 1, randomize="strong"),
        World(roads[::2], num_envs=96, seed=seed + 2, randomize="real", objects=10),
        World(roads[1::2], num_envs=24, seed=seed + 3, randomize="real", lateral=0.9, turned=1.5, steps=8),
    ]


def drives_of(perceiver: Perceiver, lessons: Lessons) -> list[Drives]:
    """Those that memory learns from, over the network's roads: bad and good ones, fast and slow ones."""
    roads, seed = roads_of(lessons.seed, lessons.roads), lessons.seed + 500
    far: dict[str, Any] = {"lateral": 0.2, "turned": 0.3, "sway": 0.12, "steps": 45, "fastest": 4.0}
    near: dict[str, Any] = far | {"lateral": 0.05, "turned": 0.1, "sway": 0.04}
    places = [
        World(roads, num_envs=96, seed=seed, randomize="strong", **far),
        World(roads, num_envs=48, seed=seed + 1, randomize="strong", **near),
        World(roads, num_envs=64, seed=seed + 2, randomize="real", **far),
        World(roads[::2], num_envs=32, seed=seed + 3, randomize="real", objects=10, **far),
    ]
    length = max(STRETCH, lessons.remembered // sum(place.simulation.num_envs for place in places))
    drives = []
    for place in places:
        outputs, targets, begins = [], [], []
        for _ in range(length):
            frames, truth = place.look()
            outputs.append(perceiver.outputs(frames))
            targets.append(truth)
            begins.append(place.begins)
        drives.append(Drives(np.stack(outputs), np.stack(targets), np.stack(begins)))
    return drives


def train(lessons: Lessons = USUAL, *, tell: Callable[[int, float], None] = lambda *_: None) -> Perceiver:
    """A perceiver that has had its lessons; the same bits for the same lessons.

    Args:
        lessons: How much, and how.
        tell: Called with the number of updates, of the network and then of its memory, and the loss, now and then.
    """
    perceiver = Perceiver(None, seed=lessons.seed, num_threads=1)
    _teach_network(perceiver, lessons, tell)
    perceiver.settle()  # memory learns of the answers that it will be told
    drives = drives_of(perceiver, lessons)
    perceiver.memory = taught(drives, lessons, tell=lambda update, loss: tell(lessons.updates + update, loss))
    return perceiver


def _teach_network(perceiver: Perceiver, lessons: Lessons, tell: Callable[[int, float], None]) -> None:
    network = perceiver.network
    observations = np.zeros((lessons.store, *network.observation_shape), np.uint8)
    targets = np.zeros((lessons.store, NUM_TARGETS), np.float32)
    rng = np.random.default_rng([lessons.seed, 0x6C657373])
    places, known, seen = worlds(lessons.seed, num_roads=lessons.roads), 0, 0
    losses: list[float] = []
    said = time.monotonic()
    for update in range(lessons.updates):
        wanted = lessons.store // 2 + round(update * lessons.fresh * lessons.minibatch_size)
        while seen < wanted:
            for place in places:
                frames, truth = place.look()
                # each new picture takes a random one's place, once there is no other
                free = np.arange(known, min(known + len(frames), lessons.store))
                rows = np.concatenate([free, rng.integers(0, max(known, 1), len(frames) - len(free))])
                observations[rows], targets[rows] = perceiver.observe(frames), truth
                known += len(free)
                seen += len(frames)
        rows = rng.integers(0, known, lessons.minibatch_size)
        seen_now, wanted_now = observations[rows], targets[rows]
        turned = lessons.minibatch_size // 2  # so many are looked at in a mirror
        seen_now[:turned] = mirrored_observations(seen_now[:turned])
        wanted_now[:turned] = mirrored_answers(wanted_now[:turned])
        slopes, loss = slopes_of(network.policy(seen_now), wanted_now)
        share = update / lessons.updates
        rate = lessons.learning_rate * min(1.0, (update + 1) / 300) * (0.5 + 0.5 * np.cos(np.pi * share))
        network.descend(seen_now, slopes, learning_rate=float(rate), max_grad_norm=5.0)
        losses.append(loss)
        if time.monotonic() - said > 5.0 or update == lessons.updates - 1:
            tell(update + 1, float(np.mean(losses)))
            losses.clear()
            said = time.monotonic()
