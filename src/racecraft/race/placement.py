"""Where cars are put: at the start, a little off it, and back on the track after a mistake."""

from __future__ import annotations

import hashlib
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecraft.race.rules import RaceRules
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.sim.simulation import Simulation
from racecraft.track.polyline import interpolate, wrap_angle
from racecraft.track.track import Track

CLEARANCE: Final = 1.0
"""m that are kept between an object and a car that is put back on the track."""
LEAST_ROOM: Final = 0.6
"""m to the next object in a lane below which a car is not put there if the other lane has more."""

ROOM: Final = 0.5
"""m from the middle of a car that is put back to the middle of any other: a car is 0.32 m long, a box 0.5."""
SEARCH_STEP, SEARCHED = 0.25, 40  # m from one place to the next that is tried, and how many

_OBJECT_KIND, _GONE = OBJECT_COLUMNS.index("object_kind"), OBJECT_KINDS.index("gone_racer")
_OBJECT_DISTANCE, _OBJECT_OFFSET = OBJECT_COLUMNS.index("object_distance"), OBJECT_COLUMNS.index("object_offset")
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
    """Where laps from the line start, m along the driven track."""
    return rules.start_offset * track.length if track.is_closed else 0.0


def start_pose(track: Track, rules: RaceRules, *, seed: int, trial: int, lap: int = 0, offset: float = 0.0) -> Pose:
    """Where a trial starts from the line: on the centre line, exactly for trial 0, else off by the rules' jitter.

    Args:
        track: In driving direction.
        rules: With the start's offset and jitter.
        seed: Of the evaluation.
        trial: From 0; with `seed` and `lap` it decides the jitter.
        lap: Laps completed before this start, each standing start has its own jitter.
        offset: m to the left of the centre line, where an object near the start asks for the other lane.
    """
    s = start_distance(track, rules)
    heading = float(track.heading_at(s))
    x, y = track.point_at(s).tolist()
    x, y = x - offset * np.sin(heading), y + offset * np.cos(heading)
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


def avoiding_pose(track: Track, previous: NDArray[np.float64], *, crashed: int = -1, mercy: bool = False) -> Pose:
    """Where a car is put back on a track with objects: as `reset_pose`, but not where an object is near.

    With an object within `CLEARANCE` of that place, or when it has run into one, the car comes that far behind
    the object, in the other lane; with mercy that far ahead of it. Where another object stands in that lane,
    too, the lane with more room is taken.

    Args:
        track: In driving direction.
        previous: Judged row of the step before, objects included  (row_width(objects),).
        crashed: Index of the object it ran into, or -1.
        mercy: Whether to put it past the object.
    """
    objects = previous[len(ROW_COLUMNS) + len(OBJECT_HEADER) :].reshape(-1, len(OBJECT_COLUMNS))
    is_there = objects[:, _OBJECT_KIND] != _GONE
    if not is_there.any():
        return reset_pose(track, previous)
    if not is_there.all():  # cars that have left the race
        crashed = int(is_there[:crashed].sum()) if crashed >= 0 else -1
        objects = objects[is_there]
    places, offsets = objects[:, _OBJECT_DISTANCE], objects[:, _OBJECT_OFFSET]
    s = float(previous[_DISTANCE])
    nearest = crashed if crashed >= 0 else int(np.abs(_ahead(track, places, s)).argmin())
    if crashed < 0 and abs(_ahead(track, places[nearest], s)) >= CLEARANCE:
        return reset_pose(track, previous)
    s = float(places[nearest]) + (CLEARANCE if mercy else -CLEARANCE)
    s = s % track.length if track.is_closed else min(max(s, 0.0), track.length)
    room = {}
    for side in (1.0, -1.0):
        in_lane = places[np.sign(offsets) == side]
        room[side] = float(np.abs(_ahead(track, in_lane, s)).min(initial=CLEARANCE))
    other = -1.0 if offsets[nearest] > 0.0 else 1.0
    side = other if room[other] >= room[-other] or room[other] > LEAST_ROOM else -other
    row = previous.copy()
    row[_DISTANCE], row[_OFFSET] = s, side
    return reset_pose(track, row)


def clear_pose(track: Track, pose: Pose, others: NDArray[np.float64]) -> Pose:
    """A place on the road where nobody is: the given one, or the nearest behind it, in either lane.

    Two cars that are put back at once must not stand in each other, or one would run into the other as it starts.

    Args:
        track: In driving direction.
        pose: Where the car would be put; kept where there is room.
        others: Middles of everything around, x and y in m  (K, 2).
    """
    if _has_room(pose, others):
        return pose
    s, offset = (float(value) for value in track.project(np.array([pose.x, pose.y])))
    for number in range(1, SEARCHED + 1):
        behind = s - number * SEARCH_STEP
        behind = behind % track.length if track.is_closed else max(behind, 0.0)
        for side in (offset, -offset):
            row = np.zeros(len(ROW_COLUMNS))
            row[_DISTANCE], row[_OFFSET] = behind, side
            found = reset_pose(track, row)
            if _has_room(found, others):
                return found
    return pose


def _has_room(pose: Pose, others: NDArray[np.float64]) -> bool:
    return bool((np.hypot(others[:, 0] - pose.x, others[:, 1] - pose.y) >= ROOM).all())


def _ahead(track: Track, places: Any, s: float) -> Any:
    """M that places are ahead of s along the track, the shorter way round a closed one."""
    ahead = places - s
    return ahead - track.length * np.round(ahead / track.length) if track.is_closed else ahead


def line_up(simulation: Simulation, rules: RaceRules, *, seed: int, is_anew: bool = False) -> None:
    """Put every car of a simulation at the start of its trial; equal seeds mean equal starts and conditions.

    Starts all over the lap are the simulation's own, as are those of cars that share a road: on a grid, without jitter.

    Args:
        simulation: With a car for each trial.
        rules: Where laps begin.
        seed: Of starts and conditions.
        is_anew: Draw objects from it, too, whatever was driven before; a race has those of its simulation's own seed.
    """
    if rules.starts == "lap":
        simulation.reset(seeds=_keys(simulation, seed))
        return
    if simulation.randomize.is_off and not (is_anew and simulation.num_objects):
        simulation.reset()
    else:
        races = np.arange(simulation.num_envs, dtype=np.uint64) // np.uint64(simulation.cars_per_race)
        simulation.reset(seeds=races + np.uint64((seed % 2**32) << 20))
    if simulation.cars_per_race > 1:
        return
    tracks = [track.reversed() if rules.direction == "reverse" else track for track in simulation.tracks]
    for trial in range(1, simulation.num_envs):  # trial 0 already stands where it should
        offset = start_offset(simulation, trial)
        track = tracks[trial % len(tracks)]
        simulation.set_pose(trial, *start_pose(track, rules, seed=seed, trial=trial, offset=offset))


def _keys(simulation: Simulation, seed: int) -> NDArray[np.uint64]:
    """What each race of a simulation draws from, by its number alone: all 64 bits depend on all of the seed's  (N,)."""
    size = simulation.cars_per_race
    digests = [hashlib.sha256(f"{seed}/{race}".encode()).digest() for race in range(simulation.num_envs // size)]
    return np.repeat(np.array([int.from_bytes(digest[:8], "little") for digest in digests], np.uint64), size)


def start_offset(simulation: Simulation, trial: int) -> float:
    """M to the left of the centre line where the simulation started a car, because of an object near the start."""
    return float(simulation.column("offset")[trial]) if simulation.num_objects else 0.0
