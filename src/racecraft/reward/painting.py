"""What a reward function pays along a track, as a grid to be painted over its picture.

The car drives laps at a usual speed, each at its own distance from the centre line and step after step, so that
functions that remember something, or pay for progress between two calls, answer as they do in a training. Some of the
steps are painted. Objects and other cars stand where an episode has them at its beginning.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RewardError
from racecraft.reward.dry_run import HALF_CAR, STEP_SECONDS, TYPICAL_SPEED, among, moment, place_objects
from racecraft.reward.params import make_params
from racecraft.reward.source import load_preset, preset_names
from racecraft.reward.worker import RewardWorker, waypoints_of
from racecraft.sim import NO_OBJECTS, Objects
from racecraft.sim.columns import OBJECT_COLUMNS, ROW_COLUMNS, STATUS_NAMES
from racecraft.track.track import Track

PLACES: Final = 96
_X, _Y, _HEADING = (ROW_COLUMNS.index(name) for name in ("x", "y", "heading"))
OFFSETS: Final = (-1.15, -0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9, 1.15)


@dataclass(frozen=True, kw_only=True)
class Painting:
    """Rewards on a grid of P places along a track and O places across it."""

    places: NDArray[np.float64]
    """m along the centre line  (P,)."""
    offsets: NDArray[np.float64]
    """Share of half the road's width, left positive; beyond 1 is beside the road  (O,)."""
    points: NDArray[np.float64]
    """x, y in m  (P, O, 2)."""
    rewards: NDArray[np.float64]
    """NaN where the function failed  (P, O)."""
    objects: NDArray[np.float64]
    """x, y in m of what stands on the road besides  (K, 2)."""


def paint_reward(
    source: str,
    track: Track,
    *,
    objects: Objects = NO_OBJECTS,
    cars_per_race: int = 1,
    timeout_s: float = 0.5,
    foreign: bool = False,
) -> Painting:
    """Ask a reward function what it pays everywhere on a track.

    Args:
        source: Text of a ``reward_function.py`` that has been checked.
        track: Where.
        objects: What stands and drives there: the run's own, as a function may rely on them.
        cars_per_race: Cars that share the track; the others are objects, too.
        timeout_s: How long one call may take, s; after a failure the rest stays NaN.
        foreign: The source is somebody else's; see `RewardWorker`.

    Raises:
        RewardError: The source cannot be loaded at all, or is foreign and cannot be locked in.
    """
    rows, between = _laps(track)
    painted = slice(1, None, between)
    placed = np.empty((0, len(OBJECT_COLUMNS)))
    if num_objects := objects.count + cars_per_race - 1:
        placed = place_objects(track, objects, cars_per_race, "forward")
        rows = among(rows, placed)
    rewards = np.full(rows.shape[:2], np.nan)
    options: dict[str, Any] = {"timeout_s": timeout_s, "foreign": foreign, "num_objects": num_objects}
    with RewardWorker(source, track, **options) as worker:
        for across in range(len(OFFSETS)):
            try:
                rewards[:, across] = worker(rows[:, across])
            except RewardError:
                break
    places = np.linspace(0.0, track.length, PLACES, endpoint=not track.is_closed)
    points = rows[painted][..., [_X, _Y]]
    return Painting(
        places=places,
        offsets=np.array(OFFSETS),
        points=points,
        rewards=rewards[painted],
        objects=placed[:, [OBJECT_COLUMNS.index("object_x"), OBJECT_COLUMNS.index("object_y")]],
    )


def paint_presets(track: Track) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """What every reward that ships with Racecraft pays, on a grid of its own: half the places, for small pictures.

    Our own code needs no walls, so it is called here and now: a lap, step after step, at each distance from the centre.

    Args:
        track: A closed one.

    Returns:
        Points, x and y in m  (P, O, 2), and by each preset's name its rewards  (P, O).
    """
    rows, between = _laps(track)
    shown = slice(1, None, 2 * between)
    waypoints = waypoints_of([track])
    painted = {name: np.empty(rows.shape[:2]) for name in preset_names()}
    for name, paid in painted.items():
        code = compile(load_preset(name), f"{name}.py", "exec")
        for across in range(len(OFFSETS)):  # a lap each, for those that remember the step before
            preset: dict[str, Any] = {}
            exec(code, preset)
            paid[:, across] = [
                preset["reward_function"](make_params(row.tolist(), waypoints)) for row in rows[:, across]
            ]
    return rows[shown][..., [_X, _Y]], {name: paid[shown] for name, paid in painted.items()}


def _laps(track: Track) -> tuple[NDArray[np.float64], int]:
    """A lap at each of the offsets, step after step.

    Returns:
        Rows, the first of a step before the lap, which an open track has at its first place  (N, O, columns), and how
        many steps it is from one of the grid's places to the next.
    """
    parts = PLACES if track.is_closed else PLACES - 1
    steps = max(1, round(track.length / parts / (TYPICAL_SPEED * STEP_SECONDS)))  # from one place to the next
    ahead = np.arange(-1, steps * parts if track.is_closed else steps * parts + 1) / (steps * parts)
    places = track.length * (ahead if track.is_closed else ahead.clip(0.0))
    middle = np.array(  # the first step of an episode is not paid for
        [moment(track, float(place), steps=step + 2) for step, place in enumerate(places)]
    )
    half = 0.5 * track.width_at(places)[:, None]
    offset = half * np.array(OFFSETS)
    is_off = np.abs(offset) > half + HALF_CAR
    rows = np.repeat(middle[:, None], len(OFFSETS), axis=1)
    rows[..., _X] -= offset * np.sin(rows[..., _HEADING])
    rows[..., _Y] += offset * np.cos(rows[..., _HEADING])
    for column, values in (
        ("offset", offset),
        ("all_wheels_on_track", np.abs(offset) + HALF_CAR <= half),
        ("is_offtrack", is_off),
        ("status", np.where(is_off, STATUS_NAMES.index("off_track"), STATUS_NAMES.index("in_progress"))),
    ):
        rows[..., ROW_COLUMNS.index(column)] = values
    return rows, steps
