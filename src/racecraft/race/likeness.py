"""Whether two drivers are one: what each chooses on frames that nobody has seen, and how alike their choices are.

    seed ──▶ poses on and beside a race's road ──▶ frames ──▶ driver ──▶ *hidden_choices* ──▶ *likeness*

Where a car is on the road and looks along it, good drivers steer alike; askew and beside it, where nobody trained,
each does something of its own, and a copy does what the original does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.conditions import Conditions
from racecraft.race.entry import Entry
from racecraft.race.evaluation import race_simulation
from racecraft.race.placement import driven_track

FRAMES: Final = 256
ASIDE: Final = 1.5
"""Half widths of the road that a car stands off its middle at most, to either side."""
TURNED: Final = 1.5
"""rad that it looks away from the road's direction at most."""
ALIKE: Final = 0.75
"""From this likeness on a person looks; measured by benchmarks/near_copies.py."""
RANGE: Final = (1047.0, 4000.0)
"""mrad and mm/s from one end of what may be chosen to the other."""
LEAST: Final = 0.03
"""Of the range, by which choices differ from frame to frame: who always does the same is like nobody."""


def hidden_choices(entry: Entry, conditions: Conditions, *, seed: int) -> NDArray[np.int16]:
    """What an entry chooses on hidden frames: steering angle in mrad and speed in mm/s  (FRAMES, 2).

    Args:
        entry: What drives; its own sensors see the frames.
        conditions: Of the race: track, direction, and what stands on it.
        seed: Of the frames; the same for all whose choices are compared.

    Raises:
        NonFiniteAction: Its network gives NaN.
    """
    seen = replace(conditions, seed=seed, camera=entry.sensors.camera(), cars_per_race=1)
    simulation = race_simulation(seen, num_cars=FRAMES, has_lidar=bool(entry.sensors.lidar_name), num_threads=1)
    simulation.reset()
    track, draw = driven_track(conditions.track, conditions.rules), np.random.default_rng([seed, FRAMES])
    along = (np.arange(FRAMES) + draw.random(FRAMES)) / FRAMES * track.length
    aside = ASIDE * draw.uniform(-0.5, 0.5, FRAMES) * track.width_at(along)
    heading = track.heading_at(along)
    x, y = track.point_at(along).T + aside * np.stack([-np.sin(heading), np.cos(heading)])
    heading = heading + draw.uniform(-TURNED, TURNED, FRAMES)
    for car in range(FRAMES):
        simulation.set_pose(car, float(x[car]), float(y[car]), float(heading[car]))
    bounds = np.iinfo(np.int16)
    commands = np.rint(1000.0 * entry(entry.sensors.read(simulation)))
    return np.asarray(commands.clip(bounds.min, bounds.max), np.int16)


def likeness(one: NDArray[np.int16], others: NDArray[np.int16]) -> NDArray[np.float64]:
    """How alike one's choices are to those of each of the others: 1 for the same, 0 for what chance would give.

    One minus how far choices are apart on the same frame, as a share of how far they are apart on any two frames.

    Args:
        one: Choices  (FRAMES, 2).
        others: (N, FRAMES, 2).
    """
    apart, by_chance = np.zeros(len(others)), np.zeros(len(others))
    for column, width in enumerate(RANGE):
        mine, theirs = one[:, column] / width, others[:, :, column] / width
        apart += np.abs(theirs - mine).mean(axis=1)
        by_chance += _mean_distance(mine, theirs)
    return np.where(by_chance >= LEAST, 1.0 - apart / np.maximum(by_chance, LEAST), 0.0)


def _mean_distance(mine: NDArray[np.float64], theirs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between any of mine and any of theirs, for each row of theirs  (N,)."""
    ordered = np.sort(mine)
    sums = np.concatenate(([0.0], np.cumsum(ordered)))
    below = np.searchsorted(ordered, theirs)
    distances = theirs * (2 * below - len(ordered)) + sums[-1] - 2 * sums[below]
    return np.asarray(distances.mean(axis=1) / len(ordered))
