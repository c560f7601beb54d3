"""The smallest table that drives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from racecraft.course.tables import table_driver
from racecraft.course.verdict import Verdict, right, wrong

NAMES: Final = ("offset", "sin_heading_error", "curvature_2")
MOST_CELLS: Final = 60
SEEDS: Final = (1, 3)
LAPS: Final = 19
"""Of 20, with each seed."""


def check_cuts(cuts: Any) -> Verdict:
    """Edges for three numbers: few cells, and it drives."""
    if not isinstance(cuts, dict) or set(cuts) != set(NAMES):
        return wrong(f"It must be a dictionary with the keys {', '.join(NAMES)}; () for a number that is left out.")
    for name, row in cuts.items():
        if not isinstance(row, Iterable):
            return wrong(f"{name} is {row!r}; edges stand in brackets, a single one with a comma behind it: (0.0,).")
    edges: dict[str, Sequence[float]] = {name: [float(edge) for edge in cuts[name]] for name in NAMES}
    for name, row in edges.items():
        if not all(np.isfinite(row)) or list(row) != sorted(set(row)):
            return wrong(f"The edges of {name} are {row}; write each once, from low to high.")
    cells = int(np.prod([len(row) + 1 for row in edges.values()]))
    if cells > MOST_CELLS:
        return wrong(
            f"That makes {cells} cells; {MOST_CELLS} are allowed. k edges make k + 1 intervals, and those multiply."
        )
    laps = [table_driver(edges, seed=seed).laps for seed in SEEDS]
    told = f"{cells} cells, and it drives {laps[0]} and {laps[1]} of 20 laps. "
    if min(laps) >= LAPS:
        return right(told + "The original has 147.")
    if not edges["offset"]:
        return wrong(told + "It does not know where across the road it is, so it cannot come back to the middle.")
    if not edges["sin_heading_error"]:
        return wrong(
            told + "It does not know at what angle to the road it stands, so it notices too late that it leaves."
        )
    if max(map(abs, edges["offset"])) > 1.0 or max(map(abs, edges["sin_heading_error"])) > 0.8:
        return wrong(
            told
            + "Some edges lie where the car hardly ever is: the offset is -1 to 1 on the road, and the sine of the "
            "heading stays below 0.5. What is cut there tells nothing apart."
        )
    return wrong(told + "Edges close to 0 tell a little left from a little right, and that is what steering needs.")


CHECKS = {"cuts": check_cuts}
