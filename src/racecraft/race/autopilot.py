"""A driver that needs no training: pure pursuit of the centre line, from the privileged state.

It proves that a track can be driven, paces tests and benchmarks, and is a baseline to beat.

    state (offset, heading error, curvature ahead) -> centre line ahead in the car's frame -> a point on it
        -> the arc through that point -> steering; curvature on the way there -> speed
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_number
from racecraft.sim.columns import CURVATURE_AHEAD, STATE_COLUMNS
from racecraft.sim.simulation import MAX_STEERING

PATH_SPACING: Final = 0.05
"""m between the points of the path ahead."""
REFERENCE_AHEAD: Final = 0.14
"""m from the car's origin to the point that the state's offset speaks of."""
WHEELBASE: Final = 0.25
"""m, effective: four driven wheels scrub, which acts like a longer car."""
UNDERSTEER: Final = 0.025
"""s²/m: extra steering per curvature and squared speed, of the default car."""

_SPEED, _OFFSET, _HALF_WIDTH, _SINE, _COSINE, _CURVATURE = (
    STATE_COLUMNS.index(name)
    for name in ("speed", "offset", "half_width", "sin_heading_error", "cos_heading_error", "curvature_0")
)


@dataclass(frozen=True, kw_only=True)
class Autopilot:
    """Steers along the centre line and slows for bends; called with state (N, S), returns commands (N, 2)."""

    sees: ClassVar = "state"

    speed: float = 1.0
    """m/s on a straight, 0.1 to 4."""
    lateral_acceleration: float = 2.0
    """m/s² it allows itself in bends; the default car holds about 3."""
    lookahead: float = 0.3
    """m to the point it steers for when standing, beyond the car's nose."""
    lookahead_time: float = 0.25
    """s of driving added to that."""

    def __post_init__(self) -> None:
        limits = {
            "speed": (0.1, 4.0),
            "lateral_acceleration": (0.1, 20.0),
            "lookahead": (0.1, 2.0),
            "lookahead_time": (0.0, 0.5),
        }
        for name, (low, high) in limits.items():
            check_number(f"Autopilot setting {name}", getattr(self, name), low, high)

    def __call__(self, state: NDArray[np.float32]) -> NDArray[np.float32]:
        """Commands for `Simulation.step`: steering_angle [rad], speed [m/s], (N, 2)."""
        speed = 4.0 * state[:, _SPEED].astype(np.float64)
        sine, cosine = state[:, _SINE].astype(np.float64), state[:, _COSINE].astype(np.float64)
        offset = (state[:, _OFFSET] * state[:, _HALF_WIDTH]).astype(np.float64)
        curvature = state[:, _CURVATURE : _CURVATURE + len(CURVATURE_AHEAD)] @ _INTERPOLATION  # (N, P)

        # the centre line ahead, in the frame of its own tangent beside the car's reference point
        heading = np.cumsum(curvature, axis=1) * PATH_SPACING
        path_x, path_y = np.cumsum(np.cos(heading), axis=1), np.cumsum(np.sin(heading), axis=1)
        index = (self.lookahead + self.lookahead_time * speed) / PATH_SPACING - 1.0
        index = index.round().astype(np.intp).clip(0, curvature.shape[1] - 1)
        row = np.arange(len(state))
        ahead = path_x[row, index] * PATH_SPACING + REFERENCE_AHEAD * cosine
        left = path_y[row, index] * PATH_SPACING - offset + REFERENCE_AHEAD * sine

        # the same point as the car sees it, and the arc that leads there
        target_x, target_y = cosine * ahead + sine * left, cosine * left - sine * ahead
        bend = 2.0 * target_y / (target_x**2 + target_y**2)
        steering = np.arctan(bend * (WHEELBASE + UNDERSTEER * speed**2)).clip(-MAX_STEERING, MAX_STEERING)

        reach = np.abs(curvature[:, : int(_BRAKING_VIEW / PATH_SPACING)]).max(axis=1)
        pace = np.sqrt(self.lateral_acceleration / np.maximum(reach, 1e-6)).clip(0.1, self.speed)
        return np.stack([steering, pace], axis=1).astype(np.float32)


_BRAKING_VIEW: Final = 1.5  # m ahead that the speed is chosen for


def _interpolation() -> NDArray[np.float64]:
    """Weights from the state's curvatures (C,) to those at every path point (P,)."""
    at = np.arange(0.5, CURVATURE_AHEAD[-1] / PATH_SPACING) * PATH_SPACING
    return np.stack([np.interp(at, CURVATURE_AHEAD, unit) for unit in np.eye(len(CURVATURE_AHEAD))])


_INTERPOLATION: Final = _interpolation()
