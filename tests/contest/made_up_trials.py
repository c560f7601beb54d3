"""Results of races that nobody drove."""

from __future__ import annotations

import numpy as np

from racecraft.race import Lap, Recording, Trial
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track import load_track

NOTHING = Recording(load_track("oval"), np.zeros((1, len(ROW_COLUMNS))), np.zeros(1), np.zeros((1, 2), np.float32))


def trial(*times: float, laps: int = 3, resets: int = 0, driven: float = 0.0) -> Trial:
    """A race of three laps: the times of those completed, and how much of the next one was driven."""
    began = np.concatenate(([0.0], np.cumsum(times)))
    done = [
        Lap(number=n + 1, status="lap_complete", start_time=float(began[n]), time=time, completion=1.0)
        for n, time in enumerate(times)
    ]
    if len(times) < laps:
        start = float(began[-1])
        done.append(Lap(number=len(done) + 1, status="off_track", start_time=start, time=3.0, completion=driven))
    done[0] = Lap(**{**vars(done[0]), "resets": resets})
    status = done[-1].status
    completion = (len(times) + driven) / laps
    return Trial(index=0, laps=tuple(done), status=status, completion=completion, recording=NOTHING)
