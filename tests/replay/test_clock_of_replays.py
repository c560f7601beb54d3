"""The clock of a trial goes on over its standing starts, however many a file says there are."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from racecraft.replay.replay import _clock
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES

STATUS, TIME = ROW_COLUMNS.index("status"), ROW_COLUMNS.index("time")
PREPARE, DRIVES = STATUS_NAMES.index("prepare"), STATUS_NAMES.index("in_progress")


def slow_clock(rows: NDArray[np.float64]) -> list[float]:
    clock, began = [], 0.0
    for step, row in enumerate(rows):
        if row[STATUS] == PREPARE and step:
            began = clock[-1]
        clock.append(began + row[TIME])
    return clock


def test_it_is_that_of_a_slow_clock_to_the_bit() -> None:
    rng = np.random.default_rng(1)
    for share in (0.0, 0.02, 0.5, 1.0):
        rows = np.zeros((500, len(ROW_COLUMNS)))
        rows[:, STATUS] = np.where(rng.random(500) < share, PREPARE, DRIVES)
        rows[0, STATUS] = PREPARE
        rows[:, TIME] = rng.integers(0, 1000, 500) * (1.0 / 15.0)
        assert _clock(rows).tolist() == slow_clock(rows)


def test_a_start_at_every_step_takes_no_time() -> None:
    rows = np.zeros((400_000, len(ROW_COLUMNS)))
    rows[:, STATUS] = PREPARE
    began = time.process_time()
    assert not _clock(rows).any()
    assert time.process_time() - began < 0.3  # a loop over them takes half a second
