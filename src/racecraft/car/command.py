"""From a policy's choice to what a car's servo and motor are told, by the rules of the car's own software.

    angle, speed -> *steering_share, throttle* -> shares of full lock and of full throttle, -1 to 1 and 0 to 1

Only ratios count: the largest angle of the action space is full lock, whatever it says in degrees, and its largest
speed is full throttle, which the slider of the car's page scales.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import (
    MAX_SPEED,
    MAX_STEERING,
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
)
from racecraft.errors import ConfigError

Floats = NDArray[np.float64]

CURVE: Final = (-1.2, 2.2)
"""Of the throttle over the share of the largest speed: a parabola through (0, 0), (1/2, 0.8) and (1, 1)."""


def as_driven(space: ActionSpace) -> ActionSpace:
    """The choices as the simulator drove them: wheels stop at 30° and the car at 4 m/s, whatever old files list.

    A car knows no such limits. Told of 45° it would take that for full lock, and 22.5° for half of it, where the policy
    learned with three quarters.
    """
    if isinstance(space, ContinuousActionSpace):
        return space
    widest = np.radians(MAX_STEERING)
    return DiscreteActionSpace(
        np.column_stack([space.table[:, 0].clip(-widest, widest), space.table[:, 1].clip(max=MAX_SPEED)])
    )


def listed_choices(space: ActionSpace) -> Floats:
    """What can be chosen, as the metadata lists it: angle in rad, speed in m/s; two ends if continuous  (C, 2)."""
    return np.array([space.low, space.high]) if isinstance(space, ContinuousActionSpace) else space.table


def largest(space: ActionSpace) -> tuple[float, float]:
    """Largest angle to either side, rad, and largest speed, m/s: what a car takes for full lock and full throttle.

    Raises:
        ConfigError: Nothing steers, and the car would divide by zero.
    """
    angle, speed = np.abs(listed_choices(space)).max(axis=0).tolist()
    if angle == 0.0:
        raise ConfigError(
            "No action steers: a car divides by the largest steering angle.",
            hint="Train with an action space in which an action steers, such as --actions default.",
        )
    return angle, speed


def steering_share(angles: Floats, space: ActionSpace) -> Floats:
    """Share of full lock, left positive, for angles in rad."""
    return np.asarray(angles / largest(space)[0])


def throttle(speeds: Floats, space: ActionSpace) -> Floats:
    """Share of the throttle that the slider allows, for speeds in m/s."""
    share = speeds / largest(space)[1]
    return np.asarray(CURVE[0] * share**2 + CURVE[1] * share)
