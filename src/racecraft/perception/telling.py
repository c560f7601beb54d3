"""A belief in plain numbers: what `racecraft perceive --json` prints of each picture."""

from __future__ import annotations

import math
from typing import Any, Final

from racecraft.perception.answers import CURVATURE_AT, ROWS
from racecraft.perception.belief import Belief

TOLD_ROWS: Final = (60, 75, 90, 105)
"""Rows of a picture of 160 x 120 whose middle is told."""
DISTANT: Final = 4.0
"""m; what is further away is as good as not there."""


def sees_middle(belief: Belief, index: int, place: int) -> bool:
    """Whether the road's middle is in the picture, in the row at `place` of `ROWS`."""
    return bool(belief.is_middle[index, place] > 0.5)


def distance_of(closeness: float) -> float:
    """How many metres it is to an object: of 1 / (1 + m); infinite where there is none."""
    return 1.0 / closeness - 1.0 if closeness > 1e-3 else math.inf


def tell(file: str, belief: Belief, index: int) -> dict[str, Any]:
    """One picture's belief.

    Returns:
        ``file``; ``on_road``; ``offset_m``, left of the middle positive, and ``heading_rad``, turned left positive
        against the road beside the lens, and ``heading_ahead_rad``, against where that road leads over the next 40 cm,
        all of the lens, with ``…_error``, the mean distance to the truth that is expected; ``middle``: columns of a
        picture of 160 x 120 in `TOLD_ROWS`, None where it is not in sight, with ``middle_error``; ``half_width_m``;
        ``curvature_per_m`` 0.5, 1 and 2 m ahead, to the left positive; ``distance_m`` to what is in the way, None where
        nothing is, with the two ends of where it is likely to be.
    """
    places = [ROWS.index(row) for row in TOLD_ROWS]
    seen = [sees_middle(belief, index, place) for place in places]
    closeness, off = float(belief.closeness[index]), float(belief.closeness_error[index])
    distance = distance_of(closeness)
    is_blocked = distance < DISTANT
    ends = [distance_of(min(closeness + off, 1.0)), min(distance_of(max(closeness - off, 0.0)), 2 * DISTANT)]
    return {
        "file": file,
        "on_road": bool(belief.on_road[index] > 0.5),
        "offset_m": _rounded(belief.offset[index]),
        "offset_error_m": _rounded(belief.offset_error[index]),
        "heading_rad": _rounded(belief.heading[index]),
        "heading_error_rad": _rounded(belief.heading_error[index]),
        "heading_ahead_rad": _rounded(belief.heading_ahead[index]),
        "heading_ahead_error_rad": _rounded(belief.heading_ahead_error[index]),
        "middle": [
            _rounded(belief.middle[index, place], 2) if there else None
            for place, there in zip(places, seen, strict=True)
        ],
        "middle_error": [
            _rounded(belief.middle_error[index, place], 2) if there else None
            for place, there in zip(places, seen, strict=True)
        ],
        "half_width_m": _rounded(belief.half_width[index]),
        "curvature_per_m": {f"{ahead:g}": _rounded(belief.curvature[index, i]) for i, ahead in enumerate(CURVATURE_AT)},
        "distance_m": _rounded(distance, 3) if is_blocked else None,
        "distance_between_m": [_rounded(end, 3) for end in ends] if is_blocked else None,
    }


def _rounded(number: float, digits: int = 4) -> float:
    return round(float(number), digits)
