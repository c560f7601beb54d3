"""How perception learns: cars drive badly through randomised worlds, and the network is told what was there.

worlds ──frames, truth──▶ a shuffled store ──minibatches──▶ loss's slopes ──▶ network
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import NUM_CONTINUOUS, NUM_TARGETS, NUMBERS, ROWS
from racecraft.perception.lessons import Lessons
from racecraft.perception.mirror import mirrored_answers, mirrored_observations
from racecraft.perception.network import LOG_LIMITS, Perceiver
from racecraft.perception.truth import Truth
from racecraft.sim import STATE_COLUMNS, Objects, Obstacles, Simulation, Start
from racecraft.track import load_tracks

Floats = NDArray[np.float32]

ROUND_OFF: Final = 0.02
"""In units of the network: errors below it count by their square, those above it as they are."""
ERROR_RATE: Final = 0.1
"""Weight of learning how far off answers are, beside the answers themselves."""
YES_OR_NO: Final = 0.15
"""Weight of each answer that is yes or no."""
WEIGHTS: Final = np.array([3.0, 3.0, 1.0, 1.0, 1.0, 1.0, 2.0, 3.0, *[1.0] * len(ROWS)], np.float32)
"""Of the continuous answers: offset and headings matter most."""
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
    """

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
        self._sway = sway
        self._aim = self._rng.normal(0.0, sway, num_envs)
        self._pace = self._rng.uniform(0.6, 2.5, num_envs)

    def look(self) -> tuple[NDArray[np.uint8], Floats]:
        """Drive a step; the pictures there, to be copied (N, 120, 160), and the targets (N, NUM_TARGETS)."""
        simulation, rng = self.simulation, self._rng
        count = simulation.num_envs
        self._aim += rng.normal(0.0, 0.45 * self._sway, count) - 0.1 * self._aim
        self._pace = np.where(rng.random(count) < 0.05, rng.uniform(0.5, 3.0, count), self._pace)
        state = dict(zip(STATE_COLUMNS, simulation.state.T.astype(np.float64), strict=False))
        aside = state["offset"] * state["half_width"] - self._aim
        steering = np.arctan(0.165 * state["curvature_1"]) - 1.2 * aside - 0.6 * state["sin_heading_error"]
        steering += rng.normal(0.0, 0.1, count)
        simulation.step(np.stack([steering.clip(-0.5, 0.5), self._pace], axis=1))
        simulation.reset(simulation.terminated | simulation.truncated)
        return simulation.frames, self._truth.targets()


def worlds(seed: int, *, num_roads: int) -> list[World]:
    """Those that perception learns in; a seed's tracks are no other's."""
    known = ["reinvent_2018", "oval", "hairpin"]
    num_tight = num_roads // 4
    wide = [f"generated:{1000 * seed + i}" for i in range(num_roads - num_tight)]
    tight = [f"generated:{1000 * seed + 100 + i},radius=0.45,difficulty=0.9" for i in range(num_tight)]
    roads = [*known, *wide, *tight]
    return [
        World(roads, num_envs=72, seed=seed, randomize="real"),
        World(roads, num_envs=96, seed=seed + 1, randomize="strong"),
        World(roads[::2], num_envs=96, seed=seed + 2, randomize="real", objects=10),
        World(roads[1::2], num_envs=24, seed=seed + 3, randomize="real", lateral=0.9, turned=1.5, steps=8),
    ]


def slopes_of(outputs: Floats, targets: Floats) -> tuple[Floats, float]:
    """The loss's derivative at each output (B, NUM_OUTPUTS), and its mean.

    Continuous answers have a rounded absolute error; what is expected of it has the likelihood of Laplace's
    distribution around the answer, which does not move the answer itself. Columns out of the picture do not count.
    """
    rows = len(ROWS)
    slopes = np.zeros_like(outputs)
    told, wanted = outputs[:, :NUM_CONTINUOUS], targets[:, :NUM_CONTINUOUS]
    weights = np.broadcast_to(WEIGHTS, told.shape).copy()
    weights[:, len(NUMBERS) :] *= targets[:, NUM_CONTINUOUS : NUM_CONTINUOUS + rows]
    error = told - wanted
    rounded = np.sqrt(error * error + np.float32(ROUND_OFF**2))
    slopes[:, :NUM_CONTINUOUS] = weights * error / rounded
    loss = float((weights * (rounded - np.float32(ROUND_OFF))).sum(axis=1).mean())

    logs = outputs[:, NUM_TARGETS:]
    sizes = np.abs(error) * np.exp(-logs.clip(*LOG_LIMITS))
    counts = np.float32(ERROR_RATE) * (weights > 0.0)
    # beyond the limits only the way back
    slope = counts * (1.0 - sizes)
    slope[(logs < LOG_LIMITS[0]) & (slope > 0.0) | (logs > LOG_LIMITS[1]) & (slope < 0.0)] = 0.0
    slopes[:, NUM_TARGETS:] = slope.clip(-1.0, 1.0)

    logits, is_so = outputs[:, NUM_CONTINUOUS:NUM_TARGETS], targets[:, NUM_CONTINUOUS:]
    yes = 1.0 / (1.0 + np.exp(-logits.clip(-30.0, 30.0)))
    slopes[:, NUM_CONTINUOUS:NUM_TARGETS] = YES_OR_NO * (yes - is_so)
    loss += YES_OR_NO * float(np.logaddexp(0.0, np.where(is_so > 0.5, -logits, logits)).sum(axis=1).mean())
    return slopes, loss


def train(lessons: Lessons = USUAL, *, tell: Callable[[int, float], None] = lambda *_: None) -> Perceiver:
    """A perceiver that has had its lessons; the same bits for the same lessons.

    Args:
        lessons: How much, and how.
        tell: Called with the number of updates and the loss, every few seconds.
    """
    perceiver = Perceiver(None, seed=lessons.seed, num_threads=1)
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
    return perceiver
