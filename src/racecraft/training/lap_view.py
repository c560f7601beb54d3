"""`LapView`: what of its lap a critic, or a teacher, is told behind the privileged state.

The privileged state looks three metres ahead. What a line through a long bend is worth shows later than that, and who
estimates it without knowing which bend it is sees chance where there is none. Who is to drive a whole lap at the limit
must see further, too: at 4 m/s three metres are less than a second, and how a bend is left depends on the next one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.sim import Simulation

SPACING: Final = 0.05
"""m between two places of the road whose curvature is kept."""


@dataclass(frozen=True)
class LapView:
    """How much of the lap is told; by itself, nothing."""

    num_harmonics: int = 0
    """As a lap is round, its place is an angle; sines and cosines of its first multiples tell bends apart."""
    ahead: tuple[float, ...] = ()
    """m ahead of the car at which the road's curvature is told, beyond what the privileged state has of it."""

    @property
    def size(self) -> int:
        """Columns."""
        return 2 * self.num_harmonics + len(self.ahead)


NOTHING: Final = LapView()
CRITICS_VIEW: Final = LapView(num_harmonics=3)
"""Of who only judges."""
TEACHERS_VIEW: Final = LapView(num_harmonics=16, ahead=(2.5, 4.0, 5.0, 6.0))
"""Of who drives by it: on 95 m the shortest wave is one of 6 m. What each of both is worth: docs/log/fastest-lap.md."""


class LapTeller:
    """Tells every car of a simulation of its lap.

    Args:
        view: How much.
        simulation: The cars.
    """

    def __init__(self, view: LapView, simulation: Simulation) -> None:
        self.view = view
        self._simulation = simulation
        self._ahead = np.asarray(view.ahead)
        roads = [] if not view.ahead else [*simulation.tracks, *(track.reversed() for track in simulation.tracks)]
        reach = max(view.ahead, default=0.0)
        most = math.ceil((max((road.length for road in roads), default=0.0) + reach) / SPACING) + 1
        self._curvature = np.array([road.curvature_at(SPACING * np.arange(most)) for road in roads], np.float32)

    def __call__(self) -> NDArray[np.float32]:
        """At the last judged step: the place on the lap, then the curvature ahead in 1/m, left positive  (N, size)."""
        distance, length = (self._simulation.column(name) for name in ("projection_distance", "track_length"))
        place = lap_place(distance, length, num_harmonics=self.view.num_harmonics)
        if not self.view.ahead:
            return place
        road = self._simulation.column("track_index").astype(np.intp)
        there = ((distance[:, None] + self._ahead) / SPACING).astype(np.intp)
        return np.concatenate([place, self._curvature[road[:, None], there]], axis=1)


def lap_place(distance: NDArray[np.float64], length: NDArray[np.float64], *, num_harmonics: int) -> NDArray[np.float32]:
    """Sine and cosine of one to `num_harmonics` times the lap's angle: smooth, and the same on both sides of the line.

    Args:
        distance: m along the centre line from the start  (N,).
        length: m of the whole lap  (N,).
        num_harmonics: The angle's multiples.

    Returns:
        Within [-1, 1], all sines before the cosines  (N, 2 * num_harmonics).
    """
    angles = 2.0 * np.pi * (distance / length)[:, None] * np.arange(1, num_harmonics + 1)
    return np.concatenate([np.sin(angles), np.cos(angles)], axis=1).astype(np.float32)
