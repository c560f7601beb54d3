"""Judges logged poses with the core's own rules, the ones that judge a training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type
from racecraft.errors import RunError
from racecraft.fidelity.differences import why_end, why_wheels
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.logged import LogJudge
from racecraft.track.track import Track

if TYPE_CHECKING:
    from racecraft.fidelity.differences import Differences
    from racecraft.fidelity.logs import Log

PROGRESS_TOLERANCE: Final = 1e-5
"""Fraction of a lap: 0.001 %."""
FAR_OFF: Final = 0.5
"""m beyond the border; an episode ends before."""
_COLUMN: Final = {name: index for index, name in enumerate(ROW_COLUMNS)}
UNSEEN: Final = ("crashed", "time_up")
"""Ends by what a log does not show: boxes, other cars and the race's clock."""
_OVER: Final = [STATUS_NAMES.index(name) for name in ("lap_complete", "off_track", "immobilized", "reversed")]


class TrackRules:
    """The rules on one track. Each episode of a log may have been driven forward or in reverse.

    Raises:
        ConfigError: It is no track.
    """

    def __init__(self, track: Track) -> None:
        check_type("track", track, Track, "get one with load_track(name or path)")
        self.track = track
        self._judges = (LogJudge(track), LogJudge(track, reversed=True))
        self._waypoints = (track.waypoints, track.reversed().waypoints)

    def judge(self, log: Log) -> NDArray[np.float64]:
        """What the simulation would have logged of these poses   (R, len(ROW_COLUMNS)).

        Where each lap began is read from the progress of its episode's first row; ``track_index`` is 1 where the
        episode was driven in reverse, the direction that explains its progress and waypoints better.
        """
        forward, backward = (self._judge(judge, log) for judge in self._judges)
        better = np.zeros(len(log))
        for rows, sign in ((forward, -1.0), (backward, 1.0)):
            good = np.abs(rows[:, _COLUMN["progress"]] - log.progress) <= PROGRESS_TOLERANCE
            better += sign * (good.astype(float) + (self.closest_waypoints(rows) == log.closest_waypoint))
        first = log.starts[:-1]
        lengths = np.diff(log.starts)
        is_reversed = np.repeat(np.add.reduceat(better, first) > 0, lengths)
        rows = np.where(is_reversed[:, None], backward, forward)
        rows[:, _COLUMN["steps"]] = log.steps
        rows[:, _COLUMN["time"]] = log.time - np.repeat(log.time[first], lengths)
        return rows

    def _judge(self, judge: LogJudge, log: Log) -> NDArray[np.float64]:
        rows = judge(
            np.column_stack([log.x, log.y, log.heading]),
            np.column_stack([log.steering_angle, log.speed]),
            progress=log.progress,
            is_first=log.is_first,
            is_paused=log.is_paused,
        )
        rows[:, _COLUMN["track_index"]] = float(judge.reversed)
        progress = rows[:, _COLUMN["progress"]]
        np.minimum(progress, 1.0, out=progress)  # as logs and params say it, however far a lap's last step leads
        return rows

    def closest_waypoints(self, rows: NDArray[np.float64]) -> NDArray[np.int64]:
        """The nearer of the waypoint behind and the one ahead, of judged rows   (R,)."""
        behind = rows[:, _COLUMN["closest_prev"]].astype(np.int64)
        ahead = rows[:, _COLUMN["closest_next"]].astype(np.int64)
        to_behind, to_ahead = self._distances(rows, behind), self._distances(rows, ahead)
        return np.asarray(np.where(to_ahead < to_behind, ahead, behind))

    def closest_gaps(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """How much nearer than the other the nearer of the two is, m   (R,)."""
        behind, ahead = (rows[:, _COLUMN[name]].astype(np.int64) for name in ("closest_prev", "closest_next"))
        return np.asarray(np.abs(self._distances(rows, behind) - self._distances(rows, ahead)))

    def _distances(self, rows: NDArray[np.float64], waypoint: NDArray[np.int64]) -> NDArray[np.float64]:
        direction = rows[:, _COLUMN["track_index"]].astype(np.int64)
        points = rows[:, [_COLUMN["x"], _COLUMN["y"]]]
        places = np.where(direction[:, None] > 0, self._waypoints[1][waypoint], self._waypoints[0][waypoint])
        return np.asarray(np.hypot(*(places - points).T))


@dataclass
class RulesAgreement:
    """How many rows and episodes come out as the log has them."""

    rows: int = 0
    progress: int = 0
    all_wheels: int = 0
    closest_waypoint: int = 0
    far_off: int = 0  # farther than FAR_OFF from the road
    reversed: int = 0  # driven against the route's direction
    ends: int = 0
    episodes: int = 0  # that ended in the log
    unseen: int = 0  # of these, by what it does not show, with nothing before that would have ended them here

    def add(self, rules: TrackRules, log: Log, rows: NDArray[np.float64], differences: Differences) -> None:
        """Compare some episodes with what `TrackRules.judge` made of them."""
        progress = rows[:, _COLUMN["progress"]]
        good = np.abs(progress - log.progress) <= PROGRESS_TOLERANCE
        self.rows += len(log)
        self.progress += int(good.sum())
        if len(bad := np.flatnonzero(~good)):
            here, theirs = (100 * progress[bad]).tolist(), (100 * log.progress[bad]).tolist()
            differences.add(log, "progress", bad, theirs, here, [""] * len(bad))

        wheels = rows[:, _COLUMN["all_wheels_on_track"]] > 0
        good = wheels == log.all_wheels_on_track
        self.all_wheels += int(good.sum())
        if len(bad := np.flatnonzero(~good)):
            name = "all_wheels_on_track"
            wanted = differences.is_wanted(name)
            why = why_wheels(rules.track, log, bad, wheels[bad]) if wanted else [""] * len(bad)
            differences.add(log, name, bad, log.all_wheels_on_track[bad].tolist(), wheels[bad].tolist(), why)

        closest = rules.closest_waypoints(rows)
        good = closest == log.closest_waypoint
        self.closest_waypoint += int(good.sum())
        if len(bad := np.flatnonzero(~good)):
            here, theirs = closest[bad].tolist(), log.closest_waypoint[bad].tolist()
            gaps = rules.closest_gaps(rows[bad]).tolist()
            why = [f"both are equally near, to {1000 * gap:.2f} mm" if gap < 0.001 else "" for gap in gaps]
            differences.add(log, "closest_waypoint", bad, theirs, here, why)

        half_width = 0.5 * rows[:, _COLUMN["track_width"]]
        self.far_off += int((np.abs(rows[:, _COLUMN["offset"]]) > half_width + FAR_OFF).sum())
        self.reversed += int((rows[:, _COLUMN["track_index"]] > 0).sum())
        self._add_ends(rules, log, rows, differences)

    def _add_ends(self, rules: TrackRules, log: Log, rows: NDArray[np.float64], differences: Differences) -> None:
        codes = rows[:, _COLUMN["status"]].astype(int)
        is_over = np.isin(codes, _OVER)
        for begin, end in zip(log.starts[:-1].tolist(), log.starts[1:].tolist(), strict=True):
            last = end - 1
            logged = log.status[last]
            if logged == "in_progress" and log.progress[last] >= 1.0:
                logged = "lap_complete"  # laps that flow into the next print the word only after the last one
            if not log.done[last] and logged in ("", "in_progress", "prepare", "pause"):
                continue  # cut short
            self.episodes += 1
            # Where resets are allowed, a mistake in the middle is logged as such and the episode goes on.
            early = [
                row
                for row in np.flatnonzero(is_over[begin:last]) + begin
                if STATUS_NAMES[codes[row]] != log.status[row] and not log.is_paused[row]
            ]
            if logged in UNSEEN and not early:
                self.unseen += 1
                continue
            ours = STATUS_NAMES[codes[last]]
            if not early and (ours == logged if logged else is_over[last]):
                self.ends += 1
                continue
            row = int(early[0]) if early else last
            here = f"{STATUS_NAMES[codes[row]]} in line {log.lines[row]}" if early else ours
            why = why_end(rules.track, log, row) if "off_track" in here + logged else ""
            differences.add(log, "episode_end", np.array([last]), [logged or "done"], [here], [why])


def require_length(track: Track, log: Log) -> None:
    """Refuse a log whose track has another length.

    Raises:
        RunError: It has.
    """
    length = float(np.median(log.track_length))
    if abs(length - track.length) > 0.005 * length + 0.01:
        raise RunError(
            f"{log.source} was driven on a track of {length:.2f} m; {track.name} has {track.length:.2f} m.",
            hint=_OTHER_TRACK,
        )


def require_agreement(rules: TrackRules, log: Log, agreement: RulesAgreement) -> None:
    """Refuse a log whose poses are not on the track, or whose progress is not that of its poses.

    Raises:
        RunError: So it is.
    """
    far, good = agreement.far_off / agreement.rows, agreement.progress / agreement.rows
    if far > 0.2 or good < 0.5:
        raise RunError(
            f"{log.source} was not driven on {rules.track.name}: {100 * far:.0f} % of the first {agreement.rows:,} "
            f"poses lie more than {FAR_OFF:g} m off its road, and the progress of {100 * good:.0f} % fits its centre "
            "line.",
            hint=_OTHER_TRACK,
        )


_OTHER_TRACK: Final = "Give the log's own track with --track: a name of 'racecraft tracks', or a .npy file."
