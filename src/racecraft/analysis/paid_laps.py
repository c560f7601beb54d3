"""What another reward function would have paid for laps that were driven."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.fidelity.logs import Faults, Log, read_logs
from racecraft.fidelity.rules import TrackRules
from racecraft.reward.worker import RewardWorker
from racecraft.track import Track

MAX_LAPS: Final = 6


@dataclass(frozen=True, kw_only=True)
class PaidLap:
    """One lap, paid anew: R of its rows, those in which a reward function is called."""

    number: int
    """As in the trace, from 1."""
    status: str
    points: NDArray[np.float64]
    """x, y in m  (R, 2)."""
    rewards: NDArray[np.float64]
    """(R,)"""
    rows: NDArray[np.int64]
    """Which ones of the lap's, from 0  (R,)."""


def pay_laps(
    source: str,
    track: Track,
    trace: Path,
    *,
    timeout_s: float = 0.5,
    foreign: bool = False,
    most: int = MAX_LAPS,
) -> list[PaidLap]:
    """Ask a reward function what it pays for the laps of a sim-trace, the last few of them, in the order driven.

    Objects on the track are left out: a trace does not say where they were.

    Args:
        source: Text of a ``reward_function.py`` that has been checked.
        track: That of the trace.
        trace: An evaluation's or a training's sim-trace.
        timeout_s: How long one call may take, s.
        foreign: The source is somebody else's; see `RewardWorker`.
        most: Laps, at most.

    Raises:
        RewardError: The function fails.
        RunError: The trace cannot be read.
    """
    rules = TrackRules(track)
    found: list[PaidLap] = []
    with RewardWorker(source, track, timeout_s=timeout_s, foreign=foreign) as worker:
        for log in read_logs([trace], Faults()):
            judged = rules.judge(log)
            starts = log.starts.tolist()
            for begin, end in list(pairwise(starts))[-most:]:
                rows = _driven(log, begin, end)
                if len(rows) > 1:
                    found.append(
                        PaidLap(
                            number=int(log.episode[begin]) + 1,
                            status=log.status[end - 1],
                            points=np.column_stack([log.x[rows], log.y[rows]]),
                            rewards=worker(judged[rows]),
                            rows=rows - begin,
                        )
                    )
    return found[-most:]


def _driven(log: Log, begin: int, end: int) -> NDArray[np.int64]:
    """Rows of a lap in which a reward function is called."""
    rows = np.arange(begin, end)
    return rows[~log.is_prepare[rows] & ~log.is_paused[rows]]
