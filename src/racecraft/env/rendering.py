"""Pictures of a running environment for people: the chase camera behind a car."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError
from racecraft.sim import Simulation
from racecraft.sim.views import CarView, Scene, View

RENDER_SIZE: Final = (640, 480)
"""Width and height of a rendered frame, pixels."""


def check_render_mode(mode: str | None) -> None:
    """Refuse a render mode that does not exist.

    Raises:
        ConfigError: It is neither None nor ``rgb_array``.
    """
    if mode not in (None, "rgb_array"):
        raise ConfigError(f"render_mode is {mode!r}, allowed: None or 'rgb_array'.")


class Renderer:
    """Draws a car of a simulation on its track, seen from behind."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._views: dict[int, View] = {}

    def frame(self, car: int) -> NDArray[np.uint8]:
        """The picture of one car, RGB (480, 640, 3)."""
        x, y, heading, _, _, _, steering = self._simulation.vehicles[:, car].tolist()
        itself = CarView(x, y, heading, steering)
        return self._view(car).draw(x, y, heading, cars=[itself])

    def _view(self, car: int) -> View:
        simulation = self._simulation
        track = int(simulation.column("track_index")[car]) % len(simulation.tracks)
        if track not in self._views:
            palette = simulation.camera.palette if simulation.camera else "2018"
            width, height = RENDER_SIZE
            scene = Scene(simulation.tracks[track], palette=palette)
            self._views[track] = scene.chase_view(width=width, height=height)
        return self._views[track]
