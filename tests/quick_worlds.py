"""Gymnasium's classic worlds with the same bits in a fraction of the time, for tests that take a million steps there.

Gymnasium computes a handful of numbers at a time with NumPy, whose calls cost far more than the sums. Here stand the
same operations in the same order on Python's numbers; `classic/test_quick_worlds.py` holds each beside Gymnasium's, to
the bit. What such tests are about, what is learned in these worlds, sees no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi
from pathlib import Path
from typing import Any, Final

import numpy as np
from gymnasium.envs.classic_control import acrobot, cartpole, mountain_car, pendulum
from gymnasium.envs.toy_text import cliffwalking, frozen_lake

Stepped = tuple[Any, float, bool, bool, dict[str, Any]]


def mountain_car_step(self: Any, action: int) -> Stepped:
    assert action in (0, 1, 2)
    position, velocity = self.state
    velocity += (action - 1) * self.force + cos(3 * position) * (-self.gravity)
    velocity = min(max(velocity, -self.max_speed), self.max_speed)
    position = min(max(position + velocity, self.min_position), self.max_position)
    if position == self.min_position and velocity < 0:
        velocity = 0
    terminated = position >= self.goal_position and velocity >= self.goal_velocity
    self.state = (float(position), float(velocity))
    return np.array(self.state, np.float32), -1.0, bool(terminated), False, {}


def cartpole_step(self: Any, action: int) -> Stepped:
    assert action in (0, 1)
    assert self.kinematics_integrator == "euler"
    assert not self._sutton_barto_reward
    assert self.steps_beyond_terminated is None
    x, x_dot, theta, theta_dot = self.state.tolist()
    force = self.force_mag if action == 1 else -self.force_mag
    costheta, sintheta = float(np.cos(theta)), float(np.sin(theta))
    temp = (force + self.polemass_length * (theta_dot * theta_dot) * sintheta) / self.total_mass
    thetaacc = (self.gravity * sintheta - costheta * temp) / (
        self.length * (4.0 / 3.0 - self.masspole * (costheta * costheta) / self.total_mass)
    )
    xacc = temp - self.polemass_length * thetaacc * costheta / self.total_mass
    x += self.tau * x_dot
    x_dot += self.tau * xacc
    theta += self.tau * theta_dot
    theta_dot += self.tau * thetaacc
    self.state = np.array((x, x_dot, theta, theta_dot))
    terminated = not (
        -self.x_threshold <= x <= self.x_threshold
        and -self.theta_threshold_radians <= theta <= self.theta_threshold_radians
    )
    if terminated:
        self.steps_beyond_terminated = 0
    return self.state.astype(np.float32), 1.0, terminated, False, {}


def pendulum_step(self: Any, u: Any) -> Stepped:
    th, thdot = self.state.tolist()
    u = np.float32(min(max(float(u[0]), -self.max_torque), self.max_torque))
    self.last_u = u
    angle = ((th + pi) % (2 * pi)) - pi
    costs = angle**2 + 0.1 * thdot**2 + float(0.001 * (u**2))
    newthdot = thdot + (3 * self.g / (2 * self.l) * np.sin(th) + 3.0 / (self.m * self.l**2) * u) * self.dt
    newthdot = min(max(float(newthdot), -self.max_speed), self.max_speed)
    self.state = np.array([th + newthdot * self.dt, newthdot])
    return self._get_obs(), -costs, False, False, {}


ARMS: Final[Any] = acrobot.AcrobotEnv
M1, M2, L1, LC1, LC2, INERTIA, G = (
    *(ARMS.LINK_MASS_1, ARMS.LINK_MASS_2, ARMS.LINK_LENGTH_1, ARMS.LINK_COM_POS_1, ARMS.LINK_COM_POS_2),
    *(ARMS.LINK_MOI, 9.8),
)
FIRST, SECOND, MIXED = M1 * LC1**2, M2 * LC2**2 + INERTIA, M2 * L1 * LC2
WEIGHT_1, WEIGHT_2 = (M1 * LC1 + M2 * L1) * G, M2 * LC2 * G


def acrobot_derivatives(s: Sequence[float], torque: float) -> tuple[float, float, float, float]:
    theta1, theta2, dtheta1, dtheta2 = s
    cos2, sin2 = float(np.cos(theta2)), float(np.sin(theta2))
    d1 = FIRST + M2 * (L1**2 + LC2**2 + 2 * L1 * LC2 * cos2) + INERTIA + INERTIA
    d2 = M2 * (LC2**2 + L1 * LC2 * cos2) + INERTIA
    phi2 = WEIGHT_2 * float(np.cos(theta1 + theta2 - pi / 2.0))
    phi1 = (
        -MIXED * dtheta2**2 * sin2
        - 2 * MIXED * dtheta2 * dtheta1 * sin2
        + WEIGHT_1 * float(np.cos(theta1 - pi / 2))
        + phi2
    )
    ddtheta2 = (torque + d2 / d1 * phi1 - MIXED * dtheta1**2 * sin2 - phi2) / (SECOND - d2**2 / d1)
    return dtheta1, dtheta2, -(d2 * ddtheta2 + phi1) / d1, ddtheta2


def acrobot_step(self: Any, action: int) -> Stepped:
    assert self.torque_noise_max == 0
    assert self.book_or_nips == "book"
    torque, dt = self.AVAIL_TORQUE[action], self.dt
    half, sixth = dt / 2.0, dt / 6.0
    a, b, c, d = s = [float(number) for number in self.state]
    a1, b1, c1, d1 = acrobot_derivatives(s, torque)
    a2, b2, c2, d2 = acrobot_derivatives((a + half * a1, b + half * b1, c + half * c1, d + half * d1), torque)
    a3, b3, c3, d3 = acrobot_derivatives((a + half * a2, b + half * b2, c + half * c2, d + half * d2), torque)
    a4, b4, c4, d4 = acrobot_derivatives((a + dt * a3, b + dt * b3, c + dt * c3, d + dt * d3), torque)
    theta1 = a + sixth * (a1 + 2 * a2 + 2 * a3 + a4)
    theta2 = b + sixth * (b1 + 2 * b2 + 2 * b3 + b4)
    dtheta1 = c + sixth * (c1 + 2 * c2 + 2 * c3 + c4)
    dtheta2 = d + sixth * (d1 + 2 * d2 + 2 * d3 + d4)
    theta1, theta2 = acrobot.wrap(theta1, -pi, pi), acrobot.wrap(theta2, -pi, pi)
    dtheta1 = min(max(dtheta1, -self.MAX_VEL_1), self.MAX_VEL_1)
    dtheta2 = min(max(dtheta2, -self.MAX_VEL_2), self.MAX_VEL_2)
    self.state = (theta1, theta2, dtheta1, dtheta2)
    cos1 = np.cos(theta1)
    terminated = bool(-cos1 - np.cos(theta2 + theta1) > 1.0)
    seen = np.array([cos1, np.sin(theta1), np.cos(theta2), np.sin(theta2), dtheta1, dtheta2], np.float32)
    return seen, 0.0 if terminated else -1.0, terminated, False, {}


def categorical_sample(chances: Sequence[float], rng: np.random.Generator) -> int:
    drawn, total = rng.random(), 0.0
    for number, chance in enumerate(chances):
        total += chance
        if total > drawn:
            return number
    return 0


QUICK: Final = (
    (mountain_car.MountainCarEnv, "step", mountain_car_step),
    (cartpole.CartPoleEnv, "step", cartpole_step),
    (pendulum.PendulumEnv, "step", pendulum_step),
    (acrobot.AcrobotEnv, "step", acrobot_step),
    (frozen_lake, "categorical_sample", categorical_sample),
    (cliffwalking, "categorical_sample", categorical_sample),
)


FOLDER: Final = str(Path(__file__).parent)
FIRST_LINE: Final = f"import sys; sys.path.append({FOLDER!r}); import quick_worlds; quick_worlds.install()"
"""Of a program for a process of its own: there, too."""


def install(put: Callable[[Any, str, Any], None] = setattr) -> None:
    """In the place of Gymnasium's, in this process."""
    for owner, name, quick in QUICK:
        put(owner, name, quick)
