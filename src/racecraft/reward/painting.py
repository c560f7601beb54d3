"""What a reward function pays along a track, as a grid to be painted over its picture.

The car drives ahead at a usual speed at every place, once per place: functions that remember something, or that pay
for progress between two calls, are painted as they answer to that, place after place along the lap.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RewardError
from racecraft.reward.dry_run import HALF_CAR, TYPICAL_SPEED, moment
from racecraft.reward.params import make_params
from racecraft.reward.source import load_preset, preset_names
from racecraft.reward.worker import RewardWorker, waypoints_of
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track.track import Track

PLACES: Final = 96
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


def paint_reward(source: str, track: Track, *, timeout_s: float = 0.5, foreign: bool = False) -> Painting:
    """Ask a reward function what it pays everywhere on a track.

    Args:
        source: Text of a ``reward_function.py`` that has been checked.
        track: Where.
        timeout_s: How long one call may take, s; after a failure the rest stays NaN.
        foreign: The source is somebody else's; see `RewardWorker`.

    Raises:
        RewardError: The source cannot be loaded at all, or is foreign and cannot be locked in.
    """
    places = np.linspace(0.0, track.length, PLACES, endpoint=not track.is_closed)
    offsets = np.array(OFFSETS)
    shape = (len(places), len(offsets))
    points, rewards = np.empty((*shape, 2)), np.full(shape, np.nan)
    with RewardWorker(source, track, timeout_s=timeout_s, foreign=foreign) as worker:
        for column, offset in enumerate(offsets):
            half = 0.5 * track.width_at(places)
            rows = np.stack([_row(track, place, offset * width) for place, width in zip(places, half, strict=True)])
            points[:, column] = rows[:, 2:4]
            try:
                rewards[:, column] = worker(rows)
            except RewardError:
                break
    return Painting(places=places, offsets=offsets, points=points, rewards=rewards)


def paint_presets(track: Track) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """What every reward that ships with Racecraft pays, on a grid of its own: half the places, for small pictures.

    Our own code needs no walls, so it is called here and now: a lap, step after step, at each distance from the centre.

    Args:
        track: A closed one.

    Returns:
        Points, x and y in m  (P, O, 2), and by each preset's name its rewards  (P, O).
    """
    count = PLACES // 2
    places = track.length * np.arange(-1, count) / count  # the first is only the step before the lap
    half = 0.5 * track.width_at(places)
    rows = np.array([[_row(track, s, o * w) for o in OFFSETS] for s, w in zip(places, half, strict=True)])
    rows[:, :, ROW_COLUMNS.index("steps")] = np.arange(1, count + 2)[:, None]
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
    return rows[1:, :, 2:4], {name: paid[1:] for name, paid in painted.items()}


def _row(track: Track, place: float, offset: float) -> NDArray[np.float64]:
    half = 0.5 * float(track.width_at(place))
    is_off = abs(offset) > half + HALF_CAR
    return moment(
        track,
        float(place),
        offset=float(offset),
        speed=TYPICAL_SPEED,
        steps=2 + int(place / track.length * 150),
        wheels_on_track=abs(offset) + HALF_CAR <= half,
        status="off_track" if is_off else "in_progress",
    )
