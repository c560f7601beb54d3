"""How memory learns: cars drive, well and badly, and memory is told what was there in each picture of a drive.

worlds ──the network's answers, truth──▶ drives ──stretches of them──▶ loss's slopes, back through time ──▶ weights
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.lessons import Lessons
from racecraft.perception.losses import slopes_of
from racecraft.perception.memory import ANSWERS, NUM_SEEN, REACH, SHAPES, UNITS, Array, Memory, exact, seen_of
from racecraft.perception.mirror import mirrored_answers, mirrored_commands
from racecraft.perception.network import Perceiver
from racecraft.perception.worlds import Episodes, World, roads_of

STRETCH: Final = 32
"""Pictures of a drive that are learned from together: two seconds."""
TOGETHER: Final = 64
"""Stretches to a step of learning; half of them are looked at in a mirror."""
WITHHELD: Final = 0.5
"""Share of stretches whose commands are not told: memory is to do without them, too."""
LEARNING_RATE: Final = 4e-3
"""Adam's step size after its first steps; it falls to nothing along a line."""
SLOPE_PLACES: Final = 20
"""Binary places that are kept of slopes, so that their sums are exact as those of `memory` are."""


@dataclass(frozen=True)
class Drives:
    """T pictures of each of N cars, in order."""

    outputs: NDArray[np.float32]
    """Of the network that looks  (T, N, NUM_OUTPUTS)."""
    targets: NDArray[np.float32]
    """(T, N, NUM_TARGETS)."""
    commands: NDArray[np.float32]
    """That the cars were told since the picture before, as `Memory` takes them  (T, N, 2)."""
    begins: NDArray[np.bool_]
    """Whether a car was put somewhere else before the picture  (T, N)."""


def drives_of(perceiver: Perceiver, lessons: Lessons) -> list[Drives]:
    """Those that memory learns from, over the network's roads: bad and good ones, fast and slow ones."""
    roads, seed = roads_of(lessons.seed, lessons.roads), lessons.seed + 500
    bad = Episodes(lateral=0.2, turned=0.3, sway=0.12, steps=45, fastest=4.0)
    good = replace(bad, lateral=0.05, turned=0.1, sway=0.04)
    places = [
        World(roads, bad, num_envs=96, seed=seed, randomize="strong"),
        World(roads, good, num_envs=48, seed=seed + 1, randomize="strong"),
        World(roads, bad, num_envs=64, seed=seed + 2, randomize="real"),
        World(roads[::2], bad, num_envs=32, seed=seed + 3, randomize="real", objects=10),
    ]
    length = max(STRETCH, lessons.remembered // sum(place.simulation.num_envs for place in places))
    return [_driven(perceiver, place, length) for place in places]


def _driven(perceiver: Perceiver, place: World, length: int) -> Drives:
    outputs, targets, commands, begins = [], [], [], []
    for _ in range(length):
        frames, truth = place.look()
        outputs.append(perceiver.outputs(frames))
        targets.append(truth)
        commands.append(place.commands)
        begins.append(place.begins)
    return Drives(np.stack(outputs), np.stack(targets), np.stack(commands), np.stack(begins))


def taught(drives: list[Drives], lessons: Lessons, *, tell: Callable[[int, float], None] = lambda *_: None) -> Memory:
    """A memory that has learned from drives; the same bits for the same ones.

    Args:
        drives: Each of at least `STRETCH` pictures a car.
        lessons: How much, and its seed.
        tell: Called with the number of updates and the loss, now and then.
    """
    rng = np.random.default_rng([lessons.seed, 0x6D656D6F])
    weights = _first_weights(rng)
    adam = _Adam()
    for update in range(1, lessons.memory_updates + 1):
        some = _minibatch(drives, rng)
        slopes, loss = gradient(Memory(weights), some)
        rate = LEARNING_RATE * min(1.0, update / 100) * (1.0 - (update - 1) / lessons.memory_updates)
        adam.descend(weights, {name: slope / some.begins.size for name, slope in slopes.items()}, rate)
        if update % 50 == 0 or update == lessons.memory_updates:
            tell(update, loss)
    return Memory({name: array.astype(np.float16) for name, array in weights.items()})


def _first_weights(rng: np.random.Generator) -> dict[str, Array]:
    sizes = {"seen": 0.5 / NUM_SEEN**0.5, "state": 1.0 / UNITS**0.5, "answer": 0.0, "bias": 0.0, "answer_bias": 0.0}
    weights = {name: sizes[name] * rng.standard_normal(shape) for name, shape in SHAPES.items()}
    weights["bias"][:, UNITS:] = 1.0  # at first most of the old stays
    return weights


class _Adam:
    """The optimiser of Kingma and Ba (2014), with their constants."""

    def __init__(self) -> None:
        self._means = {name: np.zeros(shape) for name, shape in SHAPES.items()}
        self._squares = {name: np.zeros(shape) for name, shape in SHAPES.items()}
        self._updates = 0

    def descend(self, weights: dict[str, Array], slopes: Mapping[str, Array], rate: float) -> None:
        """One step of a size, in place."""
        self._updates += 1
        for name, slope in slopes.items():
            mean, square = self._means[name], self._squares[name]
            mean += 0.1 * (slope - mean)
            square += 0.001 * (slope * slope - square)
            unbiased = mean / (1.0 - 0.9**self._updates)
            weights[name] -= rate * unbiased / (np.sqrt(square / (1.0 - 0.999**self._updates)) + 1e-8)


def gradient(memory: Memory, stretches: Drives) -> tuple[dict[str, Array], float]:
    """Slopes of the loss, summed over pictures, at each weight, and the loss's mean."""
    begins = stretches.begins
    length, count = begins.shape
    outputs, targets, commands = (
        array.reshape(length * count, -1) for array in (stretches.outputs, stretches.targets, stretches.commands)
    )
    seen = seen_of(outputs, commands).reshape(length, count, -1)
    befores, steps, states = [], [], []
    state = np.zeros((count, UNITS))
    for here, is_new in zip(seen, begins, strict=True):
        befores.append(np.where(is_new[:, None], 0.0, state))
        state, step = memory.step(here, befores[-1])
        steps.append(step)
        states.append(state)
    flat = np.concatenate(states)
    better = outputs.copy()
    better[:, ANSWERS] += memory.answer(flat)
    all_slopes, loss = slopes_of(better, targets)
    told = exact(REACH * all_slopes[:, ANSWERS].astype(np.float64), SLOPE_PLACES)
    at_states = (told @ memory.weights["answer"].T).reshape(length, count, UNITS)
    sums = np.zeros((length, count, 2 * UNITS))
    later = np.zeros((count, UNITS))  # slopes at a state, of all that comes after it
    for place in reversed(range(length)):
        slope = later + at_states[place]
        before, (new, stays) = befores[place], steps[place]
        # what bends from -1 to 1 has the slope (1 - its square) to the power of 3/2
        gate = 2.0 * stays - 1.0
        falls = np.concatenate([1.0 - new * new, 1.0 - gate * gate], axis=1)
        at_bent = np.concatenate([slope * (1.0 - stays), 0.5 * slope * (before - new)], axis=1)
        sums[place] = exact(at_bent * falls * np.sqrt(falls), SLOPE_PLACES)
        back = slope * stays + sums[place] @ memory.weights["state"].T
        later = np.where(begins[place][:, None], 0.0, back)
    flat_sums = sums.reshape(length * count, -1)
    ones = np.ones((1, length * count))
    return {
        "seen": seen.reshape(length * count, -1).T @ flat_sums,
        "state": np.concatenate(befores).T @ flat_sums,
        "bias": ones @ flat_sums,
        "answer": flat.T @ told,
        "answer_bias": ones @ told,
    }, loss


def _minibatch(drives: list[Drives], rng: np.random.Generator) -> Drives:
    """`TOGETHER` stretches of them, longer drives in proportion."""
    shares = np.array([each.begins.size for each in drives], float)
    counts = rng.multinomial(TOGETHER, shares / shares.sum())
    parts = [_stretches(each, int(count), rng) for each, count in zip(drives, counts, strict=True)]
    names = [field.name for field in fields(Drives)]
    some = Drives(*(np.concatenate([getattr(part, name) for part in parts], axis=1) for name in names))
    for array, mirrored in (
        (some.outputs, mirrored_answers),
        (some.targets, mirrored_answers),
        (some.commands, mirrored_commands),
    ):
        turned = array[:, ::2]
        turned[:] = mirrored(turned.reshape(-1, turned.shape[2])).reshape(turned.shape)
    some.commands[:, rng.random(TOGETHER) < WITHHELD] = np.nan
    return some


def _stretches(drives: Drives, count: int, rng: np.random.Generator) -> Drives:
    """Copies of some stretches of them, each of `STRETCH` pictures."""
    length, cars = drives.begins.shape
    first, which = rng.integers(0, length - STRETCH + 1, count), rng.integers(0, cars, count)
    rows = first + np.arange(STRETCH)[:, None]
    return Drives(*(getattr(drives, field.name)[rows, which] for field in fields(drives)))
