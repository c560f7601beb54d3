"""A world league on paper: what a deadline does to a league of a thousand, a hundred thousand and ten million racers.

python benchmarks/scale.py [--racers 1000,100000,10000000] [--entry-seconds 1.2] [--json]

Entries are simulated one by one, from a day before the deadline until the last is judged: they come ever faster, wait
for a free core and hold it. Of more than `SAMPLE` entries a part is simulated with as small a part of the cores, whose
entries wait a little longer than all of them would. All else follows from rates. docs/scale.md says what it means.
"""

from __future__ import annotations

import argparse
import heapq
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

SAMPLE = 40_000  # entries that are simulated
MONTH = 30 * 24 * 3600.0  # s
DAY = 24 * 3600.0  # s
PATIENCE = 60.0  # s that 95 % of the entries may wait


@dataclass(frozen=True)
class Costs:
    """Measured on one core of the machine in benchmarks/results, by benchmarks/league.py."""

    entry_seconds: float = 1.2  # of CPU, to judge an entry and drive it again
    replay_bytes: float = 29e3
    event_bytes: float = 3e3  # of a training or a race that is watched
    spectator_share: float = 0.15 / 100  # of a core, for each who watches
    board_seconds: float = 0.025  # to read a board of 10,000 entries from PostgreSQL
    login_seconds: float = 0.09  # a password costs that much on purpose
    row_bytes: float = 1e3  # of an entry, its job and their indices


@dataclass(frozen=True)
class Habits:
    """What people do: assumptions, not measurements."""

    entries: float = 8.0  # a month and racer
    last_day: float = 0.3  # of a month's entries
    haste: float = 3.0 * 3600  # s in which the last day's rate grows e-fold
    present: float = 0.05  # of the racers, in the last hour
    reload: float = 30.0  # s between two looks at the board
    watching: float = 0.01  # of the racers, the final, for an hour
    events: float = 12.0  # a second, to each who watches


@dataclass(frozen=True)
class Prices:
    """US dollars; orders of magnitude of large clouds, none's list."""

    core_hour: float = 0.04
    stored: float = 0.023  # a GB and month
    sent: float = 0.08  # a GB to the world


@dataclass(frozen=True)
class Size:
    """A league of one size."""

    racers: int
    entries: float  # a month
    peak: float  # entries a second, at the deadline
    mean_cores: float  # that judge, over the month
    minute_cores: int  # for 95 % to wait a minute at most
    night_cores: int  # for all to be judged eight hours after the deadline
    wait_two: float  # s, 95 % of the last day's entries, with the two cores of one machine
    board_cores: float  # that read the board for everybody, in the last hour
    cached_cores: float  # the same, read once a second for all
    live_cores: float
    live_rate: float  # bytes a second, sent to who watches
    login_cores: float
    stored: float  # bytes a month
    cost_judging: float  # dollars a month: by need through the last day, else the mean
    cost_stored: float
    cost_sent: float


def arrivals(count: int, habits: Habits, rng: np.random.Generator) -> NDArray[np.float64]:
    """Moments of the last day's entries in s, sorted; the deadline is at `DAY`."""
    share = rng.random(count)
    return np.sort(DAY + habits.haste * np.log(share + (1.0 - share) * math.exp(-DAY / habits.haste)))


def waits(moments: Sequence[float] | NDArray[np.float64], cores: int, service: float) -> NDArray[np.float64]:
    """How long each entry waits in s, first come first served."""
    free = [0.0] * cores
    found = np.empty(len(moments))
    for number, moment in enumerate(moments):
        begun = max(float(moment), free[0])
        found[number] = begun - moment
        heapq.heapreplace(free, begun + service)
    return found


def fewest(is_enough: Callable[[int], bool], most: int) -> int:
    """The smallest number of cores that is enough, up to `most`."""
    low, high = 1, most
    while low < high:
        middle = (low + high) // 2
        if is_enough(middle):
            high = middle
        else:
            low = middle + 1
    return low


def size_of(racers: int, costs: Costs, habits: Habits, prices: Prices) -> Size:
    """All that a number of racers means."""
    entries = racers * habits.entries
    last = entries * habits.last_day
    part = max(1.0, last / SAMPLE)
    moments = arrivals(round(last / part), habits, np.random.default_rng(20))
    peak = last / habits.haste / (1.0 - math.exp(-DAY / habits.haste))
    most = math.ceil(2 * peak / part * costs.entry_seconds) + 2

    def waits_a_minute(cores: int) -> bool:
        return bool(np.quantile(waits(moments, cores, costs.entry_seconds), 0.95) <= PATIENCE)

    def done_by_morning(cores: int) -> bool:
        return bool((moments + waits(moments, cores, costs.entry_seconds)).max() <= DAY + 8 * 3600)

    minute, night = fewest(waits_a_minute, most), fewest(done_by_morning, most)
    mean = entries * costs.entry_seconds / MONTH
    readers = racers * habits.present / habits.reload
    board = costs.board_seconds * max(1.0, entries / 10_000)
    watching = racers * habits.watching
    live = watching * habits.events * costs.event_bytes
    stored = entries * (costs.replay_bytes + costs.row_bytes)
    hours = mean * (MONTH - DAY) / 3600 + minute * part * 24
    two = waits(moments, 2, costs.entry_seconds * part)  # all of them for two cores: a part, that much dearer
    return Size(
        racers=racers,
        entries=entries,
        peak=peak,
        mean_cores=mean,
        minute_cores=math.ceil(minute * part),
        night_cores=math.ceil(night * part),
        wait_two=float(np.quantile(two, 0.95)),
        board_cores=readers * board,
        cached_cores=board,
        live_cores=watching * costs.spectator_share,
        live_rate=live,
        login_cores=racers * habits.present * costs.login_seconds / 3600,
        stored=stored,
        cost_judging=hours * prices.core_hour,
        cost_stored=stored / 1e9 * prices.stored,
        cost_sent=live * 3600 / 1e9 * prices.sent,
    )


def markdown(sizes: Sequence[Size]) -> list[str]:
    """The table of docs/scale.md, line by line."""
    rows = [
        ("entries a month", [f"{one.entries:,.0f}" for one in sizes]),
        ("entries a second at the deadline", [_few(one.peak) for one in sizes]),
        ("with one machine of two cores 95 % wait", [_time(one.wait_two) for one in sizes]),
        ("cores that judge, over the month", [_few(one.mean_cores) for one in sizes]),
        ("cores for a wait of a minute on the last day", [f"{one.minute_cores:,}" for one in sizes]),
        ("cores for results the next morning", [f"{one.night_cores:,}" for one in sizes]),
        ("cores that read the board in the last hour", [_few(one.board_cores) for one in sizes]),
        ("the same, read once a second for all", [_few(one.cached_cores) for one in sizes]),
        ("cores that show the final live", [_few(one.live_cores) for one in sizes]),
        ("sent a second to who watches it", [_bytes(one.live_rate) for one in sizes]),
        ("cores that check passwords", [_few(one.login_cores) for one in sizes]),
        ("replays and rows a month", [_bytes(one.stored) for one in sizes]),
        ("dollars a month: judging", [_few(one.cost_judging) for one in sizes]),
        ("keeping what a month brings", [_few(one.cost_stored) for one in sizes]),
        ("sending an hour's final live", [_few(one.cost_sent) for one in sizes]),
    ]
    head = [f"{one.racers:,} racers" for one in sizes]
    lines = [f"| | {' | '.join(head)} |", f"|---|{'---|' * len(sizes)}"]
    return [*lines, *(f"| {name} | {' | '.join(values)} |" for name, values in rows)]


def _few(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def _time(seconds: float) -> str:
    for unit, length in (("days", DAY), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:,.0f} {unit}"
    return f"{seconds:.1f} s"


def _bytes(count: float) -> str:
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if count >= size:
            return f"{_few(count / size)} {unit}"
    return f"{_few(count / 1e3)} KB"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--racers", default="1000,100000,10000000")
    parser.add_argument("--entry-seconds", type=float, default=Costs.entry_seconds)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    costs = Costs(entry_seconds=options.entry_seconds)
    sizes = [size_of(int(racers), costs, Habits(), Prices()) for racers in options.racers.split(",")]
    if options.json:
        print(json.dumps([asdict(one) for one in sizes]))
    else:
        print("\n".join(markdown(sizes)))


if __name__ == "__main__":
    main()
