"""What the walls around reward code cost: the same function with them and without, in turns, on the same machine."""

from __future__ import annotations

import time
from statistics import median
from typing import Any, Final

from racecraft.reward import RewardWorker
from racecraft.reward.sandbox import UNCONFINED, Confinement, find_confinement
from racecraft.track import Track

STARTS: Final = 9


def measure_walls(source: str, track: Track, batches: list[Any], seconds: float) -> dict[str, Any]:
    """Time to start, and processor time of calls, confined and not.

    Args:
        source: A reward function.
        track: That of the rows.
        batches: Rows, asked for in turn  (N, columns) each.
        seconds: How long calls are measured.

    Returns:
        For JSON; the cost in percent is the median over pairs of turns, of processor time in both processes, which a
        busy machine disturbs less than it disturbs a clock.
    """
    walls = find_confinement()
    starts = [(_start_ms(source, track, UNCONFINED), _start_ms(source, track, walls)) for _ in range(STARTS)]
    with (
        RewardWorker(source, track, confinement=UNCONFINED) as bare,
        RewardWorker(source, track, confinement=walls) as confined,
    ):
        for worker in (bare, confined):  # warm
            _processor_seconds(worker, batches)
        pairs: list[tuple[float, float]] = []
        begun = time.perf_counter()
        while not pairs or time.perf_counter() - begun < seconds:
            pairs.append((_processor_seconds(bare, batches), _processor_seconds(confined, batches)))
    calls = sum(map(len, batches))
    return {
        "walls": str(walls),
        "calls_per_processor_second": round(calls / median(pair[1] for pair in pairs)),
        "unconfined_calls_per_processor_second": round(calls / median(pair[0] for pair in pairs)),
        "cost_percent": round(100 * (median(pair[1] / pair[0] for pair in pairs) - 1), 1),
        "start_ms": round(median(start[1] for start in starts), 1),
        "unconfined_start_ms": round(median(start[0] for start in starts), 1),
    }


def _start_ms(source: str, track: Track, walls: Confinement) -> float:
    begun = time.perf_counter()
    with RewardWorker(source, track, confinement=walls):
        return 1e3 * (time.perf_counter() - begun)


def _processor_seconds(worker: RewardWorker, batches: list[Any]) -> float:
    """Of this process and the worker's, for all batches once."""
    clock = (~worker.process_id << 3) | 2  # CPUCLOCK_SCHED of a process, as clock_getcpuclockid makes it
    before = time.process_time() + time.clock_gettime(clock)
    for batch in batches:
        worker(batch)
    return time.process_time() + time.clock_gettime(clock) - before
