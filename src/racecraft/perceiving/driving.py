"""A driver that has learned nothing but to see: pure pursuit of the road that perception believes in.

frames ──watcher──▶ Belief ──as the simulator's state──▶ autopilot ──caution──▶ commands
            └──────────────────────── until the next frames ───────────────────────┘
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import CURVATURE_AT
from racecraft.perception.belief import Belief
from racecraft.perception.network import Perceiver
from racecraft.perception.watching import Watcher
from racecraft.race.autopilot import Autopilot
from racecraft.sim.columns import CURVATURE_AHEAD, STATE_COLUMNS

CAUTION: Final = 3.0
"""It drives slower by one over one plus this times how far its offset may be off, in halves of the road's width."""
TOP_SPEED: Final = 4.0
"""m/s that the state's speed counts as 1."""


class PerceptionDriver:
    """Steers along the middle of the road that it sees, slows for bends, and more where it is not sure.

    Args:
        perceiver: Who looks; by default with the weights that the package brings along.
        autopilot: Who steers by what is seen.
        remembers: Whether a car's pictures before are remembered, and its commands since; otherwise a picture always
            gives the same commands.
    """

    def __init__(
        self, perceiver: Perceiver | None = None, *, autopilot: Autopilot | None = None, remembers: bool = True
    ) -> None:
        self.perceiver = perceiver or Perceiver()
        self.autopilot = autopilot or Autopilot(speed=1.5)
        self._watcher = Watcher(self.perceiver) if remembers else None

    def forget(self, cars: NDArray[np.intp] | NDArray[np.bool_] | None = None) -> None:
        """Begin anew with some cars, which were put somewhere else; by default with all."""
        if self._watcher is not None:
            self._watcher.forget(cars)

    def __call__(self, frames: NDArray[np.uint8], cars: NDArray[np.intp] | None = None) -> NDArray[np.float32]:
        """Commands (N, 2), steering angle in rad and speed in m/s, for pictures uint8 (N, 120, 160).

        Args:
            frames: Of cars under way, the next picture of each.
            cars: Which they are; by default the first N  (N,).
        """
        belief = self.perceiver(frames) if self._watcher is None else self._watcher(frames, cars)
        state = state_of(belief)
        # no picture tells the speed: it is taken to be the one that the bends ahead allow
        pace = self.autopilot(state)[:, 1]
        state[:, STATE_COLUMNS.index("speed")] = pace / TOP_SPEED
        commands = self.autopilot(state)
        commands[:, 1] /= 1.0 + CAUTION * belief.offset_error / _half_width(belief)
        if self._watcher is not None:
            self._watcher.tell(commands, cars)
        return commands


def state_of(belief: Belief) -> NDArray[np.float32]:
    """What is believed, in the columns of the simulator's state of cars that stand  (N, S)."""
    state = np.zeros((len(belief), len(STATE_COLUMNS)), np.float32)
    half_width = _half_width(belief)
    columns = {
        "offset": belief.offset / half_width,
        "half_width": half_width,
        "sin_heading_error": np.sin(belief.heading),
        "cos_heading_error": np.cos(belief.heading),
    }
    for name, values in columns.items():
        state[:, STATE_COLUMNS.index(name)] = values
    first = STATE_COLUMNS.index("curvature_0")
    state[:, first : first + len(CURVATURE_AHEAD)] = belief.curvature @ _BETWEEN
    return state


def _half_width(belief: Belief) -> NDArray[np.float32]:
    return np.maximum(belief.half_width, np.float32(0.1))


_BETWEEN: Final = np.stack([np.interp(CURVATURE_AHEAD, CURVATURE_AT, unit) for unit in np.eye(len(CURVATURE_AT))])
"""Weights from the believed curvatures (3,) to those of the state (C,)."""
