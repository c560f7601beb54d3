"""What a teacher, and the critic it leaves behind, is told of the other cars of its race, behind the privileged state.

The privileged state tells of what is ahead along the road. Who is to race must know of the car beside it, too, and of
the one that comes from behind: a pass begins with the first and ends with the second.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.sim import Simulation
from racecraft.training.nearest import nearest_along

RIVAL_COLUMNS: Final = (
    "rival_closeness",  # of the nearest other car along the road: 1 / (1 + m between them)
    "rival_place",  # hyperbolic tangent of how many `PLACE` it is ahead; negative behind
    "rival_offset",  # how much farther to the left it is, over half the width of the road
    "rival_speed",  # how much faster it is, over 4 m/s
)
PLACE: Final = 0.5
"""m: about a car and a half."""


def tell_rivals(simulation: Simulation) -> NDArray[np.float32]:
    """`RIVAL_COLUMNS` of every car of races of two and more, at the last judged step  (N, 4)."""
    size = simulation.cars_per_race
    place, length, offset, speed, width = (
        simulation.column(name).reshape(-1, size)
        for name in ("projection_distance", "track_length", "offset", "actual_speed", "track_width")
    )
    is_closed = np.array([track.is_closed for track in simulation.tracks])
    index = simulation.column("track_index").reshape(-1, size, 1).astype(np.intp) % len(is_closed)
    nearest, away = nearest_along(
        place[:, None, :] - place[:, :, None],  # m: race, car, other car
        length=length[:, :, None],
        is_closed=is_closed[index],
        is_there=~np.eye(size, dtype=bool)[None],
    )
    nearest, gap = nearest[:, :, 0], away[:, :, 0]

    left, faster = (np.take_along_axis(values, nearest, axis=1) - values for values in (offset, speed))
    columns = (1.0 / (1.0 + np.abs(gap)), np.tanh(gap / PLACE), left / (0.5 * width), faster / 4.0)
    return np.stack(columns, axis=-1).reshape(-1, len(columns)).astype(np.float32)
