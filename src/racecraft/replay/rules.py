"""Judges logged poses with the core's own rules, the ones that judge a training."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError
from racecraft.replay.logs import Log
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.logged import LogJudge
from racecraft.track.track import Track

PROGRESS_TOLERANCE: Final = 1e-5
"""Fraction of a lap: 0.001 %."""
_COLUMN: Final = {name: index for index, name in enumerate(ROW_COLUMNS)}


class TrackRules:
    """The rules on one track, driven forward or in reverse."""

    def __init__(self, track: Track, *, reversed: bool = False) -> None:
        self.track = track.reversed() if reversed else track
        self.reversed = reversed
        self._judge = LogJudge(track, reversed=reversed)

    def judge(self, log: Log) -> NDArray[np.float64]:
        """What the simulation would have logged of these poses   (R, len(ROW_COLUMNS)).

        Where each lap began is read from the progress of its episode's first row.
        """
        rows = self._judge(
            np.column_stack([log.x, log.y, log.heading]),
            np.column_stack([log.steering_angle, log.speed]),
            progress=log.progress,
            is_first=log.is_first,
        )
        rows[:, _COLUMN["steps"]] = log.steps
        first = log.starts[:-1]
        began = np.repeat(log.time[first], np.diff(log.starts))
        rows[:, _COLUMN["time"]] = log.time - began
        rows[:, _COLUMN["track_index"]] = float(self.reversed)
        return rows


@dataclass
class RulesAgreement:
    """How many rows and episodes come out as the log has them."""

    rows: int = 0
    progress: int = 0
    all_wheels: int = 0
    closest_waypoint: int = 0
    ends: int = 0
    episodes: int = 0  # that ended in the log
    ended_as: Counter[str] = field(default_factory=Counter)
    differences: list[str] = field(default_factory=list)

    def add(self, rules: TrackRules, log: Log, rows: NDArray[np.float64]) -> None:
        """Compare some episodes with what `TrackRules.judge` made of them."""
        progress = rows[:, _COLUMN["progress"]]
        # a lap's end prints 100 for whatever lies beyond
        logged = np.where(log.progress >= 1.0, np.maximum(log.progress, progress), log.progress)
        good_progress = np.abs(progress - logged) <= PROGRESS_TOLERANCE
        good_wheels = (rows[:, _COLUMN["all_wheels_on_track"]] > 0) == log.all_wheels_on_track
        good_closest = closest_waypoints(rules.track, rows) == log.closest_waypoint
        self.rows += len(log)
        self.progress += int(good_progress.sum())
        self.all_wheels += int(good_wheels.sum())
        self.closest_waypoint += int(good_closest.sum())
        for name, good in (("progress", good_progress), ("wheels", good_wheels), ("waypoint", good_closest)):
            for row in np.flatnonzero(~good)[: 10 - len(self.differences)]:
                self.differences.append(f"{log.source}, line {log.lines[row]}: {name}")
        self._add_ends(log, rows)

    def _add_ends(self, log: Log, rows: NDArray[np.float64]) -> None:
        codes = rows[:, _COLUMN["status"]].astype(int)
        for begin, end in zip(log.starts[:-1], log.starts[1:], strict=True):
            last = end - 1
            logged = log.status[last]
            if not log.done[last] and logged in ("", "in_progress", "prepare", "pause"):
                continue  # cut short
            ours = STATUS_NAMES[codes[last]]
            early = np.isin(codes[begin:last], _OVER).any()
            self.episodes += 1
            self.ended_as[logged or "?"] += 1
            agrees = not early and (ours == logged if logged else codes[last] in _OVER)
            self.ends += int(agrees)
            if not agrees and len(self.differences) < 20:
                self.differences.append(f"{log.source}, line {log.lines[last]}: ends as {logged}, here {ours}")


_OVER: Final = [STATUS_NAMES.index(name) for name in ("lap_complete", "off_track", "immobilized", "reversed")]


def closest_waypoints(track: Track, rows: NDArray[np.float64]) -> NDArray[np.int64]:
    """The nearer of the waypoint behind and the one ahead   (R,)."""
    behind = rows[:, _COLUMN["closest_prev"]].astype(np.int64)
    ahead = rows[:, _COLUMN["closest_next"]].astype(np.int64)
    points = rows[:, [_COLUMN["x"], _COLUMN["y"]]]
    to_behind = np.hypot(*(track.waypoints[behind] - points).T)
    to_ahead = np.hypot(*(track.waypoints[ahead] - points).T)
    return np.asarray(np.where(to_ahead < to_behind, ahead, behind))


def require_track(track: Track, log: Log) -> None:
    """Refuse a log whose track has another length.

    Raises:
        RunError: It has.
    """
    length = float(np.median(log.track_length))
    if abs(length - track.length) > 0.005 * length + 0.01:
        raise RunError(
            f"{log.source} was driven on a track of {length:.2f} m; {track.name} has {track.length:.2f} m.",
            hint="Give the log's own track with --track: a name of 'racecraft tracks', or a .npy file.",
        )
