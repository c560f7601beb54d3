"""The number of a cell, for any count of numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from racecraft.course.verdict import Verdict, right, wrong


def check_cell(cell: Callable[..., Any]) -> Verdict:
    """Every place its own cell, and none outside of the table."""
    low, high, bins = np.array([-1.2, -0.07]), np.array([0.6, 0.07]), 10
    middles = (np.indices((bins, bins)).reshape(2, -1).T + 0.5) / bins * (high - low) + low
    found = [cell(middle.copy(), low.copy(), high.copy(), bins) for middle in middles]
    if not all(isinstance(one, int | np.integer) and not isinstance(one, bool) for one in found):
        return wrong(f"It returned {found[0]!r}; the number of a cell is a whole number, as int(…) makes it.")
    numbers = [int(one) for one in found]
    if min(numbers) < 0:
        return wrong(f"Cells are counted from 0, and it returned {min(numbers)}: begin at low, by (value - low).")
    if len(set(numbers)) < len(numbers):
        return wrong(
            f"{len(numbers)} places share {len(set(numbers))} cells, so some get mixed up: one number must count in "
            "ones and the other in tens, as digits do, cell = cell * bins + index."
        )
    if max(numbers) >= bins**2:
        return wrong(
            f"With {bins} bins for each of two numbers the last cell is {bins**2 - 1}; it returned {max(numbers)}."
        )
    half = 0.5 * (high - low) / bins
    for place in ([0.6, 0.07], [0.6, -0.063], [0.7, 0.007]):
        edge = cell(np.array(place), low.copy(), high.copy(), bins)
        if int(edge) != int(cell(np.clip(place, low + half, high - half), low.copy(), high.copy(), bins)):
            return wrong(
                f"At {place} it returned {edge}: a value on the upper bound of 0.6 and 0.07, or beyond it, belongs to "
                "the last interval. min(index, bins - 1) sees to that."
            )
    three = {
        int(cell(np.array([a, b, c]) + 0.5, np.zeros(3), np.full(3, 4.0), 4))
        for a in range(4) for b in range(4) for c in range(4)
    }  # fmt: skip
    if three != set(range(64)):
        return wrong(
            f"For two numbers it is right, but for three it uses {len(three)} cells instead of 64: loop over all."
        )
    return right("Every place has a cell of its own, in any number of dimensions.")


CHECKS = {"cell": check_cell}
