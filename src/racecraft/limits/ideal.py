"""The ideal lap: minimum time over lines and commands, by direct collocation.

    road in cells of 0.2 m -> state at every node, one command a cell, equations of the car as constraints (Radau IIA
    of order 3) -> an interior-point solver minimises the lap's seconds plus a price on jerky commands

The problem has many poor local minima in which the car saws at its wheel. So the price starts high, where one smooth
line is left, and falls in steps, each solved from the one before. Commands are free every 0.2 m, not held for 1/15 s
as the simulator's, so the result is a little better than what can be driven.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from racecraft.errors import TrackError
from racecraft.limits.car import WHEELS, along_the_road, load_casadi
from racecraft.limits.road import SmoothRoad
from racecraft.sim.simulation import MAX_STEERING
from racecraft.sim.vehicle import Vehicle
from racecraft.track.polyline import Floats

CELL: Final = 0.2
"""m of road with one command."""
SMOOTH: Final = 0.3
"""s for a change of the steering command by 1 rad, squared and summed: at first, and for the line that is driven."""
PRICES: Final = (SMOOTH, 0.03, 0.003)
"""The falling price."""
SPEED_PRICE: Final = 0.05
"""Price of a change of the speed command by 1 m/s over that of the steering command by 1 rad."""
SLOWEST: Final = 0.5
"""m/s, bound of the forward speed; below it the equations turn stiff, and no fast lap goes there."""
FASTEST: Final = 6.0
"""m/s, bound of the forward speed; the car does not reach it."""
_GUESSES: Final = (1.5, 1.0, 2.5)  # m/s² across, of the first guess's speed; the next is tried where one fails


@dataclass(frozen=True, kw_only=True, eq=False)
class IdealLap:
    """A periodic lap of the car's equations."""

    time: float
    """s"""
    road: SmoothRoad
    nodes: Floats
    """m along the road's line  (K + 1,)."""
    states: Floats
    """At the nodes: offset, heading error, forward speed, speed to the left, yaw rate, steering  (K + 1, 6)."""
    commands: Floats
    """Steering angle and speed, of the cells  (K, 2)."""
    variables: Floats
    """What the solver worked on, to go on from."""

    @property
    def places(self) -> Floats:
        """The line that the car's origin takes, m  (K + 1, 2)."""
        heading = self.road.at(self.nodes, self.road.heading)
        normal = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        return np.asarray(self.road.at(self.nodes, self.road.places) + self.states[:, :1] * normal)

    @property
    def speeds(self) -> Floats:
        """m/s at the nodes  (K + 1,)."""
        return np.asarray(np.hypot(self.states[:, 2], self.states[:, 3]))


def ideal_lap(road: SmoothRoad, car: Vehicle) -> IdealLap:
    """The fastest lap with all four wheels on the road.

    Raises:
        TrackError: The solver finds none.
        ConfigError: casadi is not installed.
    """
    lap = smooth_lap(road, car)
    for price in PRICES[1:]:
        lap = _solve(road, car, price=price, start=lap) or lap
    return lap


def smooth_lap(road: SmoothRoad, car: Vehicle, *, start: IdealLap | None = None) -> IdealLap:
    """A fast lap with smooth commands, from a first guess or another lap.

    Raises:
        TrackError: The solver finds none.
        ConfigError: casadi is not installed.
    """
    lap = _solve(road, car, price=SMOOTH, start=start) if start else None
    for guess in _GUESSES:
        lap = lap or _solve(road, car, price=SMOOTH, guess=guess)
    if lap is None:
        raise TrackError("No lap with all wheels on the road was found; is the road wide enough for the car's turns?")
    return lap


def _solve(
    road: SmoothRoad, car: Vehicle, *, price: float, start: IdealLap | None = None, guess: float = 1.5
) -> IdealLap | None:
    ca = load_casadi()
    num = max(20, round(road.length / CELL))
    step = road.length / num
    nodes = np.linspace(0.0, road.length, num + 1)
    inner = nodes[:-1] + step / 3  # Radau's other point
    variables = ca.MX.sym("variables", 14 * num + 6)
    at_nodes = ca.reshape(variables[: 6 * (num + 1)], 6, num + 1)
    at_inner = ca.reshape(variables[6 * (num + 1) : 6 * (2 * num + 1)], 6, num)
    commands = ca.reshape(variables[6 * (2 * num + 1) :], 2, num)
    curvature, inner_curvature = road.at(nodes, road.curvature), road.at(inner, road.curvature)

    equations = along_the_road(ca, car).map(num)
    change_1, pace_1 = equations(at_inner, commands, ca.DM(inner_curvature).T)
    change_2, pace_2 = equations(at_nodes[:, 1:], commands, ca.DM(curvature[1:]).T)
    before = at_nodes[:, :-1]
    seconds = step * ca.sum2(0.75 * pace_1 + 0.25 * pace_2)
    held: list[Any] = [
        ca.vec(at_inner - before - step * (5 / 12 * change_1 - 1 / 12 * change_2)),
        ca.vec(at_nodes[:, 1:] - before - step * (3 / 4 * change_1 + 1 / 4 * change_2)),
        at_nodes[:, -1] - at_nodes[:, 0],
    ]
    low, high = [np.zeros(12 * num + 6)], [np.zeros(12 * num + 6)]
    servo = (commands[0, :] + car.steering_bias - before[5, :]) / car.steering_time_constant
    held.append(servo.T)
    low.append(np.full(num, -car.steering_rate))
    high.append(np.full(num, car.steering_rate))
    for states, s, bend in ((at_nodes, nodes, curvature), (at_inner, inner, inner_curvature)):
        offset, heading = states[0, :].T, states[1, :].T
        for ahead, left in WHEELS:
            along = ahead * ca.cos(heading) - left * ca.sin(heading)
            across = offset + ahead * ca.sin(heading) + left * ca.cos(heading)
            held.append(across - 0.5 * ca.DM(bend) * along**2)  # the road bends away below the wheel
            low.append(-road.at(s, road.right) if left < 0 else np.full(len(s), -99.0))
            high.append(road.at(s, road.left) if left > 0 else np.full(len(s), 99.0))

    steering = 1.3 * MAX_STEERING + abs(car.steering_bias)
    box = np.array([[-9.0, -1.2, SLOWEST, -3.0, -12.0, -steering], [9.0, 1.2, FASTEST, 3.0, 12.0, steering]])
    floor, ceiling = (
        np.concatenate((np.tile(states, 2 * num + 1), np.tile(command, num)))
        for states, command in ((box[0], (-MAX_STEERING, 0.1)), (box[1], (MAX_STEERING, 4.0)))
    )
    jerk = commands[:, 1:] - commands[:, :-1]
    cost = seconds + price * (ca.sumsqr(jerk[0, :]) + SPEED_PRICE * ca.sumsqr(jerk[1, :]))
    settings = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 400}
    settings |= {"ipopt.tol": 1e-4, "ipopt.acceptable_tol": 1e-3, "ipopt.acceptable_iter": 8}
    if start is None:
        settings |= {"ipopt.mu_strategy": "adaptive"}
        first = _first_guess(nodes, inner, curvature, inner_curvature, guess)
    else:
        settings |= {"ipopt.mu_init": 1e-3, "ipopt.warm_start_init_point": "yes"}
        first = start.variables
    solver = ca.nlpsol("solver", "ipopt", {"x": variables, "f": cost, "g": ca.vertcat(*held)}, settings)
    found = solver(x0=first, lbx=floor, ubx=ceiling, lbg=np.concatenate(low), ubg=np.concatenate(high))
    if not solver.stats()["success"]:
        return None
    values = np.array(found["x"]).ravel()
    return IdealLap(
        time=float(ca.Function("seconds", [variables], [seconds])(values)),
        road=road,
        nodes=nodes,
        states=values[: 6 * (num + 1)].reshape(-1, 6),
        commands=values[6 * (2 * num + 1) :].reshape(-1, 2),
        variables=values,
    )


def _first_guess(
    nodes: Floats, inner: Floats, curvature: Floats, inner_curvature: Floats, lateral_acceleration: float
) -> Floats:
    """Along the middle of the road, as fast as the bends allow, speeding up and braking by 2 m/s²."""
    speed = np.sqrt(lateral_acceleration / np.maximum(np.abs(curvature), lateral_acceleration / 3.5**2))
    rise, last = 2 * 2.0 * nodes[1], len(speed) - 1
    for _ in range(2):
        for i in range(1, last + 1):
            speed[i] = min(speed[i], np.sqrt(speed[i - 1] ** 2 + rise))
        speed[0] = min(speed[0], speed[last])
        for i in range(last - 1, -1, -1):
            speed[i] = min(speed[i], np.sqrt(speed[i + 1] ** 2 + rise))
        speed[last] = min(speed[last], speed[0])
    inner_speed = np.interp(inner, nodes, speed)

    def states(bend: Floats, pace: Floats) -> Floats:
        none = np.zeros_like(bend)
        return np.stack([none, none, pace, none, pace * bend, np.clip(0.25 * bend, -0.5, 0.5)], axis=1).ravel()

    commands = np.stack([np.clip(0.25 * inner_curvature, -0.5, 0.5), inner_speed], axis=1).ravel()
    return np.concatenate((states(curvature, speed), states(inner_curvature, inner_speed), commands))
