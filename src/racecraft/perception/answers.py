"""What perception is asked of every picture, in the order of its network's outputs, and in which units.

    numbers    how much, and how far off that may be           offset, headings, width, curvature, what is in the way
    middles    which column, how far off, whether it is there  of the road's middle in some rows
    regions    whether there is road                           in a grid over the lower part of the picture
    on_road    whether there is road below the lens

Offset and heading are those of the lens, as a picture shows of how its camera is mounted on the car it shows of
nothing else.
"""

from __future__ import annotations

from typing import Final

NUMBERS: Final = {
    "offset": 0.25,
    "heading": 0.25,
    "half_width": 0.25,
    "curvature_near": 1.0,
    "curvature": 1.0,
    "curvature_far": 1.0,
    "closeness": 0.5,
    "heading_ahead": 0.25,
}
"""Names, and what 1 of the network is: m left of the road's middle, rad turned left against it, m, 1/m to the left
where `CURVATURE_AT` says, 1 / (1 + m to the next object ahead), 0 where there is none, and rad turned left against
where the road leads over the next `HEADING_OVER`."""
HEADING_OVER: Final = 0.4
"""m of road. A lens sees the road from 16 cm ahead on: what lies beside it, it can only guess in a bend."""
CURVATURE_AT: Final = (0.5, 1.0, 2.0)
"""m ahead where curvature is told."""
ROWS: Final = (45, 52, 60, 67, 75, 82, 90, 97, 105, 112)
"""Rows of a picture of 160 x 120 in which the road's middle is told."""
HALF: Final = 80.0
"""Pixels from a picture's middle to its side: what 1 of the network is for a column."""
REGION_ROWS: Final = (38, 50, 62, 76, 92, 110)
"""Rows of the middles of regions."""
REGION_COLUMNS: Final = tuple(range(10, 160, 20))
"""Columns of the middles of regions."""

NUM_REGIONS: Final = len(REGION_ROWS) * len(REGION_COLUMNS)
NUM_CONTINUOUS: Final = len(NUMBERS) + len(ROWS)
"""Numbers and columns, which are told with how far off they may be; the other targets are yes or no."""
NUM_TARGETS: Final = NUM_CONTINUOUS + len(ROWS) + NUM_REGIONS + 1
NUM_OUTPUTS: Final = NUM_TARGETS + NUM_CONTINUOUS
"""Of the network: an answer to each target, then the logarithm of the mean error of each continuous one."""
LOG_LIMITS: Final = (-6.0, 2.0)
"""Of those logarithms, in units of the network."""

PLACES: Final = {name: place for place, name in enumerate(NUMBERS)}
"""Where each of the numbers is among the outputs."""
POSE: Final = [PLACES[name] for name in ("offset", "heading", "heading_ahead")]
"""Where those are that say how the lens stands on its road."""
CURVATURES: Final = slice(PLACES["curvature_near"], PLACES["curvature_far"] + 1)
"""Where the road's curvature is, at `CURVATURE_AT`."""
MIDDLES: Final = slice(len(NUMBERS), NUM_CONTINUOUS)
"""Where the columns of the road's middle are, counted from the picture's middle."""
IN_SIGHT: Final = slice(MIDDLES.stop, MIDDLES.stop + len(ROWS))
"""Where it is said whether each of them is in the picture."""
REGIONS: Final = slice(IN_SIGHT.stop, IN_SIGHT.stop + NUM_REGIONS)
ON_ROAD: Final = NUM_TARGETS - 1
ERRORS: Final = slice(NUM_TARGETS, NUM_OUTPUTS)
"""Where the logarithms are."""
