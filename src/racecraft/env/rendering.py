"""Pictures of a running environment for people: the chase camera behind a car."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import require
from racecraft.sim import Simulation
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS
from racecraft.sim.views import RACER_COLORS, CarView, ScanView, Scene, View, views_of_objects

RENDER_SIZE: Final = (640, 480)
"""Width and height of a rendered frame, pixels."""
_POSE: Final = [OBJECT_COLUMNS.index(f"object_{name}") for name in ("x", "y", "heading")]


def check_render_mode(mode: str | None) -> None:
    """Refuse a render mode that does not exist.

    Raises:
        ConfigError: It is neither None nor ``rgb_array``.
    """
    require("render_mode", mode, mode in (None, "rgb_array"), "None or 'rgb_array'")


class Renderer:
    """Draws a car of a simulation on its track, seen from behind."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._views: dict[int, View] = {}

    def frame(self, car: int) -> NDArray[np.uint8]:
        """The picture of one car, RGB (480, 640, 3)."""
        simulation = self._simulation
        x, y, heading, _, _, _, steering = simulation.vehicles[:, car].tolist()
        number = car % simulation.cars_per_race
        itself = CarView(x, y, heading, steering, RACER_COLORS[number])
        around = views_of_objects(self._around(car), car=number)
        scan = ScanView(x, y, heading, around) if simulation.lidar.size else None
        return self._view(car).draw(x, y, heading, cars=[itself, *around], scan=scan)

    def _around(self, car: int) -> NDArray[np.float64]:
        """The columns of a car's objects, with the other cars where they are now: rows tell where they were judged."""
        simulation = self._simulation
        columns = simulation.judged[car, len(ROW_COLUMNS) :].copy()
        racers = columns[len(OBJECT_HEADER) :].reshape(-1, len(OBJECT_COLUMNS))[simulation.objects.count :]
        first = car // simulation.cars_per_race * simulation.cars_per_race
        others = [other for other in range(first, first + simulation.cars_per_race) if other != car]
        racers[:, _POSE] = simulation.vehicles[:3, others].T
        return columns

    def _view(self, car: int) -> View:
        simulation = self._simulation
        track = int(simulation.column("track_index")[car]) % len(simulation.tracks)
        if track not in self._views:
            palette = simulation.camera.palette if simulation.camera else "2018"
            width, height = RENDER_SIZE
            scene = Scene(simulation.tracks[track], palette=palette)
            self._views[track] = scene.chase_view(width=width, height=height)
        return self._views[track]
