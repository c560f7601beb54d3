"""How a car came to a moment: the steps from its start, for a function that remembers what it was called with.

    row of a moment -> the rows of every step of a drive along the centre line before it

It needs Python alone, as a browser's tab rehearses, too.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate, pairwise

Line = Sequence[tuple[float, float]]

# Layout of a row, see racecraft.sim.columns; a test compares them.
STEPS, X, Y, HEADING, STEERING, PROGRESS, OFFSET, PROJECTION = 1, 2, 3, 4, 5, 7, 8, 9
LENGTH, PREV, NEXT, ON_TRACK, OFFTRACK, CRASHED, STATUS, TIME, TRACK = 11, 12, 13, 14, 15, 16, 18, 19, 20
STEERED, LAP, CRASHED_INTO = 22, 23, 27
IN_PROGRESS = 1.0  # status
FRONT = 0.14  # m from the car's origin to the point that x, y and progress mean
FIRST_STEP = 2  # that a reward function is called for


def drive_to(row: Sequence[float], waypoints: Sequence[Line]) -> list[list[float]]:
    """The rows of an episode from its first call to the one before a moment.

    Args:
        row: The moment.
        waypoints: For every track index, the centre line in the driving direction.
    """
    line = waypoints[int(row[TRACK])]
    arcs = list(accumulate((math.dist(*piece) for piece in pairwise(line)), initial=0.0))
    count = int(row[STEPS]) - FIRST_STEP
    return [_row_at(row, line, arcs, step, step / count) for step in range(count)]


def _row_at(moment: Sequence[float], line: Line, arcs: list[float], step: int, share: float) -> list[float]:
    """A step of the drive, when so large a share of it is done."""
    row = list(moment)
    begin = FRONT / moment[LENGTH]
    progress = begin + share * (moment[PROGRESS] - begin)
    is_closed = line[0] == line[-1]
    place = moment[PROJECTION] - (moment[PROGRESS] - progress) * moment[LENGTH]
    place = place % moment[LENGTH] if is_closed else max(place, 0.0)
    following = min(max(bisect_right(arcs, place), 1), len(line) - 1)
    (x, y), (ahead_x, ahead_y) = line[following - 1], line[following]
    heading = math.atan2(ahead_y - y, ahead_x - x)
    along = place - arcs[following - 1]
    for column, value in (
        (STEPS, float(step + FIRST_STEP)),
        (TIME, moment[TIME] * (step + FIRST_STEP) / moment[STEPS]),
        (X, x + along * math.cos(heading)),
        (Y, y + along * math.sin(heading)),
        (HEADING, heading),
        (PROGRESS, progress),
        (PROJECTION, place),
        (PREV, following - 1.0),
        (NEXT, float(following)),
        (ON_TRACK, 1.0),
        (STATUS, IN_PROGRESS),
    ):
        row[column] = value
    for column in (STEERING, STEERED, OFFSET, OFFTRACK, CRASHED, LAP):
        row[column] = 0.0
    if len(row) > CRASHED_INTO:
        row[CRASHED_INTO] = -1.0
    return row
