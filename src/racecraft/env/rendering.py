"""Pictures of a running environment for people."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError
from racecraft.sim import Simulation

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
    """Draws what the driver's camera sees, enlarged to `RENDER_SIZE`."""

    def __init__(self, simulation: Simulation) -> None:
        self._frames = simulation.frames
        height, width = self._frames.shape[1:]
        self._columns = np.arange(RENDER_SIZE[0]) * width // RENDER_SIZE[0]
        self._rows = np.arange(RENDER_SIZE[1]) * height // RENDER_SIZE[1]

    def frame(self, car: int) -> NDArray[np.uint8]:
        """The picture of one car (480, 640, 3)."""
        grey = self._frames[car][self._rows[:, None], self._columns]
        return np.repeat(grey[..., None], 3, axis=2)
