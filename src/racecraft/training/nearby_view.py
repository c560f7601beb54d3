"""What a teacher, and the critic it leaves behind, is told of the nearest box or bot, behind the privileged state.

The privileged state tells of what is ahead along the road, up to the car's middle. Who passes must know until the end
of what it passes, and of a bot which way it is drifting: what ends most laps among them is one that changes lanes
beside the car. docs/log/among-objects.md has what that is worth.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.sim import Simulation
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.training.nearest import nearest_along

NEARBY_COLUMNS: Final = (
    "nearby_closeness",  # of the nearest along the road: e to the power of minus how many `REACH` lie between middles
    "nearby_place",  # hyperbolic tangent of how many `PLACE` it is ahead; negative behind
    "nearby_offset",  # how much farther to the left it is, over half the width of the road, times closeness
    "nearby_drift",  # sine of its angle to the road, positive to the left, times `DRIFT` and closeness
)
REACH: Final = 0.7
"""m."""
PLACE: Final = 0.4
"""m: about a car and a half."""
DRIFT: Final = 4.0
"""A bot that crosses half a road in a metre has an angle of about a quarter."""
SPACING: Final = 0.05
"""m between two places of the road whose direction is kept."""
_GONE: Final = OBJECT_KINDS.index("gone_racer")


class NearbyTeller:
    """Tells every car of a simulation with objects of the nearest of them, in front or behind.

    Args:
        simulation: The cars.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        roads = [*simulation.tracks, *(track.reversed() for track in simulation.tracks)]
        places = SPACING * np.arange(math.ceil(max(road.length for road in roads) / SPACING) + 1)
        self._directions = np.array([road.heading_at(np.minimum(places, road.length)) for road in roads])
        self._is_closed = np.array([road.is_closed for road in roads])

    def __call__(self) -> NDArray[np.float32]:
        """`NEARBY_COLUMNS` of every car at the last judged step; zeros where nobody is left  (N, 4)."""
        column, of_objects = self._simulation.column, self._simulation.object_column
        road, length = column("track_index").astype(np.intp), column("track_length")[:, None]
        is_there = of_objects("object_kind") != _GONE
        nearest, away = nearest_along(
            of_objects("object_distance") - column("projection_distance")[:, None],
            length=length,
            is_closed=self._is_closed[road][:, None],
            is_there=is_there,
        )
        gap = away[:, 0]

        def of_nearest(values: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.take_along_axis(values, nearest, axis=1)[:, 0]

        closeness = np.exp(-np.abs(gap) / REACH)
        left = (of_nearest(of_objects("object_offset")) - column("offset")) / (0.5 * column("track_width"))
        direction = self._directions[road, (of_nearest(of_objects("object_distance")) / SPACING).astype(np.intp)]
        drift = np.sin(of_nearest(of_objects("object_heading")) - direction)
        told = np.stack([closeness, np.tanh(gap / PLACE), closeness * left, DRIFT * closeness * drift], axis=-1)
        return np.where(is_there.any(axis=1)[:, None], told, 0.0).astype(np.float32)
