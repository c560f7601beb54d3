"""Laps of models that nobody trained: what an evaluation leaves of them, driven along the centre line."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from racecraft.race.recording import REFERENCE_AHEAD
from racecraft.track import load_track

STAMP = "20260101000000"
HEADER = (
    "episode,steps,X,Y,yaw,steer,throttle,action,reward,done,all_wheels_on_track,progress,closest_waypoint,track_len,"
    "tstamp,episode_status,pause_duration,obstacle_crash_counter"
)


def write_raced(run: Path, *laps: float, track: str = "oval", direction: str = "forward", **about: Any) -> Path:
    """An evaluation of some laps of so many seconds; its folder."""
    driven = load_track(track).reversed() if direction == "reverse" else load_track(track)
    evaluation = run / f"evaluation-{STAMP}"
    (evaluation / "evaluation-simtrace").mkdir(parents=True)
    told = {"track": track, "best_lap_seconds": min(laps), **about}
    (evaluation / "evaluation.json").write_text(json.dumps(told))
    rows = [HEADER]
    for episode, seconds in enumerate(laps):
        count = round(15 * seconds)
        for step in range(count + 1):
            s = driven.length * step / count
            (x, y), heading = driven.point_at(s), float(driven.heading_at(s))
            x, y = x + REFERENCE_AHEAD * math.cos(heading), y + REFERENCE_AHEAD * math.sin(heading)
            status = "lap_complete" if step == count else "in_progress"
            yaw, progress, now = math.degrees(heading), 100 * step / count, 100 + step / 15
            place = f"{episode},{step},{x:.4f},{y:.4f},{yaw:.4f}"
            rows.append(
                f"{place},0,1,0,1,{step == count},True,{progress:.4f},0,{driven.length:.2f},{now:.3f},{status},0,0"
            )
    (evaluation / "evaluation-simtrace" / "0-iteration.csv").write_text("\n".join(rows))
    return evaluation
