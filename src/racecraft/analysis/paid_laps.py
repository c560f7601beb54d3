"""What another reward function would have paid for laps that were driven."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.reward.worker import RewardWorker, Rows
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track import Track

if TYPE_CHECKING:
    from racecraft.fidelity.logs import Log

MAX_LAPS: Final = 6
FIRST: Final = 2
"""Number of an episode's first step that is paid."""
STEPS, PROGRESS = (ROW_COLUMNS.index(name) for name in ("steps", "progress"))


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

    As in a training every lap is an episode of its own, whose first paid step is the second. Where the car came over
    the line at speed, that is the step before it, which is called for functions that remember it and does not count.
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
    from racecraft.fidelity.logs import Faults, read_logs  # which a console's start does without
    from racecraft.fidelity.rules import TrackRules

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
                            rewards=_pay(worker, judged, rows),
                            rows=rows - begin,
                        )
                    )
    return found[-most:]


def _pay(worker: RewardWorker, judged: Rows, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """What is paid for some rows, a lap's."""
    first = rows[0]
    is_flying = first > 0 and judged[first, STEPS] > FIRST and judged[first, STEPS] == judged[first - 1, STEPS] + 1
    lap = judged[np.append(first - 1, rows) if is_flying else rows]
    if is_flying:
        lap[0, PROGRESS] -= 1.0  # of the lap that begins
        lap[:, STEPS] += FIRST - judged[first - 1, STEPS]
    return worker(lap)[-len(rows) :]


def _driven(log: Log, begin: int, end: int) -> NDArray[np.int64]:
    """Rows of a lap in which a reward function is called."""
    rows = np.arange(begin, end)
    return rows[~log.is_prepare[rows] & ~log.is_paused[rows]]
