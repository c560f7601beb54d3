"""Where cars are put: at the start, a little off it, and back on the track after a mistake."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecraft.race.rules import RaceRules
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.simulation import Simulation
from racecraft.track.polyline import interpolate, wrap_angle
from racecraft.track.track import Track

_OFFSET, _DISTANCE = ROW_COLUMNS.index("offset"), ROW_COLUMNS.index("projection_distance")


class Pose(NamedTuple):
    """Place and heading of a car's origin."""

    x: float
    """m"""
    y: float
    """m"""
    heading: float
    """rad"""


def driven_track(track: Track, rules: RaceRules) -> Track:
    """The track in the direction that the rules ask for."""
    return track.reversed() if rules.direction == "reverse" else track


def start_distance(track: Track, rules: RaceRules) -> float:
    """Where laps start, m along the driven track."""
    return rules.start_offset * track.length if track.is_closed else 0.0


def start_pose(track: Track, rules: RaceRules, *, seed: int, trial: int, lap: int = 0) -> Pose:
    """Where a trial starts: on the centre line, exactly for trial 0, else off by the rules' jitter.

    Args:
        track: In driving direction.
        rules: With the start's offset and jitter.
        seed: Of the evaluation.
        trial: From 0; with `seed` and `lap` it decides the jitter.
        lap: Laps completed before this start, each standing start has its own jitter.
    """
    s = start_distance(track, rules)
    heading = float(track.heading_at(s))
    x, y = track.point_at(s).tolist()
    if trial == 0:
        return Pose(x, y, heading)
    across, turn = np.random.default_rng([seed, trial, lap]).uniform(-1.0, 1.0, 2).tolist()
    left = rules.lateral_jitter * across
    turned = float(wrap_angle(heading + rules.heading_jitter * turn))
    return Pose(x - left * np.sin(heading), y + left * np.cos(heading), turned)


def reset_pose(track: Track, previous: NDArray[np.float64]) -> Pose:
    """Where a car is put back: in the lane it was nearest to in the step before its mistake, along the track.

    A lane is the line midway between the centre line and a border.

    Args:
        track: In driving direction.
        previous: Judged row of the step before  (len(ROW_COLUMNS),).
    """
    s = previous[_DISTANCE]
    border = track.left if previous[_OFFSET] >= 0.0 else track.right
    x, y = interpolate(0.5 * (track.centerline + border), track.arc_length, s).tolist()
    return Pose(x, y, float(track.heading_at(s)))


def line_up(simulation: Simulation, rules: RaceRules, *, seed: int) -> None:
    """Put every car of a simulation at the start of its trial; equal seeds mean equal starts and conditions."""
    if simulation.randomize.is_off:
        simulation.reset()
    else:
        trials = np.arange(simulation.num_envs, dtype=np.uint64)
        simulation.reset(seeds=trials + np.uint64((seed % 2**32) << 20))
    tracks = [track.reversed() if rules.direction == "reverse" else track for track in simulation.tracks]
    for trial in range(1, simulation.num_envs):  # trial 0 already stands where it should
        simulation.set_pose(trial, *start_pose(tracks[trial % len(tracks)], rules, seed=seed, trial=trial))
