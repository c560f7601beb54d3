"""What a policy sees: the driver's camera, the privileged state, or both; and the Gymnasium space of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_choice
from racecraft.sim.simulation import Simulation

ObservationKind = Literal["camera", "state", "both"]
ArrayObservation = NDArray[np.uint8] | NDArray[np.float32]
Observation = ArrayObservation | dict[str, ArrayObservation]

KINDS: Final = ("camera", "state", "both")

STATE_BOUNDS: Final[Mapping[str, tuple[float, float]]] = {
    "speed": (-2.0, 2.0),  # forward, over 4 m/s
    "lateral_speed": (-4.0, 4.0),  # m/s, left positive
    "yaw_rate": (-4.0, 4.0),  # over 4 rad/s, counter-clockwise positive
    "steering": (-2.0, 2.0),  # actual angle of the wheels, over 30 degrees, left positive
    "offset": (-4.0, 4.0),  # from the centre line, over half the track's width, left positive
    "sin_heading_error": (-1.0, 1.0),  # of the heading against the centre line
    "cos_heading_error": (-1.0, 1.0),
    "half_width": (0.0, 4.0),  # m, half of the track's width
    **{f"curvature_{i}": (-10.0, 10.0) for i in range(8)},  # 1/m, of the centre line ahead, left positive
}
"""The columns of the state in the core's order, and the range that each is clipped to."""


OBJECT_STATE_BOUNDS: Final[Mapping[str, tuple[float, float]]] = {
    f"{name}_{i}": bounds
    for i in range(2)
    for name, bounds in (
        ("object_closeness", (0.0, 1.0)),  # of the next object ahead and the one after: 1 / (1 + m ahead); 0 for none
        ("object_offset", (-4.0, 4.0)),  # from the centre line, over half the track's width
        ("object_speed", (0.0, 3.0)),  # over 4 m/s
    )
}
"""What follows where there are objects."""


def check_kind(kind: str) -> None:
    """Refuse an observation that does not exist.

    Raises:
        ConfigError: It is none of `KINDS`.
    """
    check_choice("observation", kind, KINDS)


class Observer:
    """Hands out the observations of a simulation's cars.

    Args:
        simulation: Has a camera unless the kind is ``state``.
        kind: ``camera``: pixels (120, 160, 1); ``state``: numbers (16,), with objects (22,);
            ``both``: a dict of the two.
    """

    def __init__(self, simulation: Simulation, *, kind: ObservationKind) -> None:
        check_kind(kind)
        more = OBJECT_STATE_BOUNDS.values() if simulation.num_objects else ()
        low, high = np.array([*STATE_BOUNDS.values(), *more], dtype=np.float32).T
        self._low, self._high = low, high
        self._kind = kind
        self._state = simulation.state  # (N, 16)
        self._frames = simulation.frames[..., None]  # (N, 120, 160, 1)
        self._clipped = np.empty_like(simulation.state)
        camera_space = gymnasium.spaces.Box(0, 255, self._frames.shape[1:], np.uint8)
        state_space = gymnasium.spaces.Box(low, high, dtype=np.float32)
        self.space: gymnasium.Space[Any]
        """The space of one car's observation."""
        if kind == "camera":
            self.space = camera_space
        elif kind == "state":
            self.space = state_space
        else:
            self.space = gymnasium.spaces.Dict({"camera": camera_space, "state": state_space})

    def batch(self, *, copy: bool) -> Observation:
        """What all cars see now (N, ...); without a copy, arrays that the next step overwrites."""
        pixels = self._frames.copy() if copy and self._kind != "state" else self._frames
        if self._kind == "camera":
            return pixels
        state = np.clip(self._state, self._low, self._high, out=None if copy else self._clipped)
        return state if self._kind == "state" else {"camera": pixels, "state": state}

    def one(self, car: int) -> Observation:
        """What one car sees now, a copy."""
        pixels: NDArray[np.uint8] = self._frames[car].copy()
        if self._kind == "camera":
            return pixels
        state: NDArray[np.float32] = np.clip(self._state[car], self._low, self._high)
        return state if self._kind == "state" else {"camera": pixels, "state": state}
