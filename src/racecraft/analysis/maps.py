"""What a training did where: rewards, speeds, actions and exits on a grid along and across the track."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import MAX_ACTIONS
from racecraft.analysis.laps import MAX_ROWS
from racecraft.errors import RunError
from racecraft.run.simtrace import read_simtrace
from racecraft.track import Track

Floats = NDArray[np.float64]

CELL: Final = 0.25
"""m along the track, about."""
MAX_PLACES: Final = 160
EDGES: Final = np.array([-1.3, -1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.3])
"""Across: share of half the road's width, left positive; beyond 1 is beside the road  (O + 1,)."""
EXITS: Final = ("off_track", "crashed", "immobilized", "reversed")
LARGEST: Final = 1e12
"""Of any number that is shown; a stranger's trace may say more, and sums of such ones are infinite."""
SAME_LENGTH: Final = 0.05
"""m by which the track length of a row may differ: rows of a run's other tracks are left out."""


@dataclass(frozen=True, kw_only=True)
class TrackMaps:
    """Means over all visits of a cell; P places, O offsets, A actions. NaN where no car was."""

    grid: Floats
    """Corners of the cells  (P + 1, O + 1, 2)."""
    visits: NDArray[np.int64]
    """(P, O)"""
    reward: Floats
    speed: Floats
    """Commanded, m/s."""
    steering_angle: Floats
    """Commanded, rad, left positive."""
    action: NDArray[np.int64]
    """The action taken most; -1 where none was, or where actions are continuous  (P, O)."""
    usage: Floats
    """Share of every action over all rows  (A,); empty where actions are continuous."""
    exits: Floats
    """x, y where episodes ended by a mistake  (E, 2)."""
    episodes: int
    rows: int


def iterations_of(folder: Path) -> list[int]:
    """Numbers of the iterations whose sim-traces a training kept, in order."""
    try:
        names = [path.name for path in folder.iterdir()]
    except OSError:
        return []
    return sorted(int(match[1]) for name in names if (match := re.fullmatch(r"(\d{1,9})-iteration\.csv", name)))


def draw_maps(track: Track, folder: Path, iterations: Sequence[int]) -> TrackMaps:
    """The maps of some iterations of a training.

    Args:
        track: In the direction in which waypoints are listed; driving it the other way is no matter.
        folder: ``training-simtrace`` of a run.
        iterations: Which, as `iterations_of` gives them; damaged ones are passed over.
    """
    places = min(MAX_PLACES, max(24, round(track.length / CELL)))
    shape = (places, len(EDGES) - 1)
    visits, rewards, speeds, steering = (np.zeros(shape) for _ in range(4))
    counts: dict[int, NDArray[np.float64]] = {}
    exits: list[Floats] = []
    episodes = rows = 0
    for iteration in iterations:
        try:
            columns = read_simtrace(folder / f"{iteration}-iteration.csv", max_rows=MAX_ROWS)
        except RunError:
            continue
        is_ours = np.abs(columns["track_len"] - track.length) < SAME_LENGTH
        statuses = columns.get("episode_status")
        if statuses is not None:
            is_ours &= statuses != "prepare"
        points = np.column_stack([columns["X"], columns["Y"]])[is_ours]
        if not len(points):
            continue
        along, offset = track.project(points)
        share = offset / (0.5 * track.width_at(along))
        row = np.minimum((along / track.length * places).astype(int), places - 1)
        column = np.clip(np.searchsorted(EDGES, share, side="right") - 1, 0, shape[1] - 1)
        cell = (row, column)
        np.add.at(visits, cell, 1.0)
        for name, total in (("reward", rewards), ("throttle", speeds), ("steer", steering)):
            np.add.at(total, cell, columns[name][is_ours].clip(-LARGEST, LARGEST))
        actions = columns["action"]
        if actions.ndim == 1:
            for action in np.unique(actions[is_ours]).tolist():
                if 0 <= action < MAX_ACTIONS:  # a stranger's trace may say any number
                    counted = counts.setdefault(int(action), np.zeros(shape))
                    which = actions[is_ours] == action
                    np.add.at(counted, (row[which], column[which]), 1.0)
        if statuses is not None:
            exits.append(points[np.isin(statuses[is_ours], EXITS)])
        episodes += len(np.unique(columns["episode"][is_ours]))
        rows += len(points)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = [total / visits for total in (rewards, speeds, np.radians(steering))]
    action, usage = _most_used(counts, shape)
    return TrackMaps(
        grid=_grid(track, places),
        visits=visits.astype(np.int64),
        reward=means[0],
        speed=means[1],
        steering_angle=means[2],
        action=action,
        usage=usage,
        exits=np.concatenate(exits) if exits else np.zeros((0, 2)),
        episodes=episodes,
        rows=rows,
    )


def _most_used(counts: dict[int, NDArray[np.float64]], shape: tuple[int, int]) -> tuple[NDArray[np.int64], Floats]:
    if not counts:
        return np.full(shape, -1, np.int64), np.zeros(0)
    table = np.stack([counts.get(action, np.zeros(shape)) for action in range(max(counts) + 1)])
    totals = table.sum(axis=(1, 2))
    return np.where(table.sum(axis=0) > 0, table.argmax(axis=0), -1), totals / totals.sum()


def _grid(track: Track, places: int) -> Floats:
    along = np.linspace(0.0, track.length, places + 1)
    heading = track.heading_at(along)
    left = np.stack([-np.sin(heading), np.cos(heading)], axis=-1)
    half = 0.5 * track.width_at(along)
    return np.asarray(track.point_at(along)[:, None] + (half[:, None] * EDGES)[..., None] * left[:, None])
