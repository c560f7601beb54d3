"""An oval of 24 waypoints and rows of cars on it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track.track import Track

MakeRow = Callable[..., np.ndarray]


@pytest.fixture(scope="session")
def track() -> Track:
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    shape = np.array((3.0, 2.0))
    return Track("oval", centerline=circle * shape, inner=circle * (shape - 0.4), outer=circle * (shape + 0.4))


@pytest.fixture(scope="session")
def make_row() -> MakeRow:
    """Makes a row from column names; the rest is a car on the centre line of a road 0.8 m wide."""

    def make(**columns: float) -> np.ndarray:
        values = dict.fromkeys(ROW_COLUMNS, 0.0)
        values |= {"steps": 2.0, "speed": 1.0, "progress": 0.01, "track_width": 0.8, "track_length": 15.8}
        values |= {"closest_next": 1.0, "all_wheels_on_track": 1.0, "status": 1.0, "time": 2 / 15}
        unknown = columns.keys() - values.keys()
        assert not unknown
        return np.array(list((values | columns).values()), np.float64)

    return make


@pytest.fixture(scope="session")
def rows(make_row: MakeRow) -> np.ndarray:
    """Ten cars, ever further from the centre line."""
    return np.stack([make_row(x=float(i), offset=0.05 * i, steps=2.0 + i) for i in range(10)])
