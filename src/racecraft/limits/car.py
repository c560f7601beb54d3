"""The car of `vehicle.hpp` once more, as symbols that a solver can differentiate.

A test steps both side by side. State: offset left of the road's line [m], heading against it [rad], forward speed
[m/s], speed to the left [m/s], yaw rate [rad/s], angle of the front wheels [rad]. Command: steering angle [rad],
speed [m/s]. Left out: the limit on the steering's rate (a constraint of the solver) and standing still.
"""

from __future__ import annotations

from typing import Any, Final

from racecraft.extras import needed_for
from racecraft.sim.vehicle import Vehicle

GRAVITY: Final = 9.8
"""m/s²"""
MAX_DRIVE_OVER_FRICTION: Final = 3.0
"""As `kMaxDriveOverFriction` in the core."""
WHEELS: Final = ((0.08231, 0.0796), (0.08231, -0.0796), (-0.08166, 0.08105), (-0.08166, -0.08105))
"""Wheel centres in the car's frame, m: ahead of the origin and left of it, as in `rules.hpp`."""


def load_casadi() -> Any:
    """The solver's library.

    Raises:
        ConfigError: It is not installed.
    """
    with needed_for("To compute a minimum lap time"):
        import casadi
    return casadi


def body_rates(ca: Any, car: Vehicle, body: tuple[Any, Any, Any, Any], speed_command: Any) -> tuple[Any, Any, Any]:
    """Change of forward speed, speed to the left and yaw rate per second, as `vehicle_rates` has them.

    Args:
        ca: The casadi module.
        car: The parameters.
        body: Forward speed, speed to the left, yaw rate, angle of the front wheels.
        speed_command: m/s
    """
    forward, sideways, yaw_rate, steering = body
    sine, cosine = ca.sin(steering), ca.cos(steering)
    front_sideways_body = sideways + car.front_axle * yaw_rate
    front_forward = forward * cosine + front_sideways_body * sine
    front_sideways = front_sideways_body * cosine - forward * sine
    rear_sideways = sideways - car.rear_axle * yaw_rate
    most = MAX_DRIVE_OVER_FRICTION * GRAVITY * min(car.front_friction, car.rear_friction)
    drive_limit, brake_limit = min(car.drive_acceleration, most), min(car.brake_acceleration, most)

    def along(wheel_speed: Any) -> Any:
        wanted = (speed_command * car.speed_gain - wheel_speed) / car.speed_time_constant
        share = wanted * ca.if_else(wanted > 0, 1.0 / drive_limit, 1.0 / brake_limit)
        return wanted / ca.sqrt(1.0 + share * share)

    def across(stiffness: float, friction: float, slip: Any, speed: Any) -> Any:
        wanted = stiffness * slip
        available = friction * ca.fmax(speed, car.slip_speed)
        return -GRAVITY * friction * wanted / ca.sqrt(available * available + wanted * wanted)

    rear_scrub = car.half_track * yaw_rate
    front_scrub = rear_scrub * cosine
    front_left, front_right = along(front_forward - front_scrub), along(front_forward + front_scrub)
    rear_left, rear_right = along(forward - rear_scrub), along(forward + rear_scrub)
    front_half, rear_half = 0.5 * car.front_load, 0.5 * (1.0 - car.front_load)
    front_along, rear_along = front_half * (front_left + front_right), rear_half * (rear_left + rear_right)
    scrub = car.half_track * (front_half * cosine * (front_right - front_left) + rear_half * (rear_right - rear_left))
    front_across = car.front_load * across(car.front_stiffness, car.front_friction, front_sideways, front_forward)
    rear_across = (1.0 - car.front_load) * across(car.rear_stiffness, car.rear_friction, rear_sideways, forward)
    front_x = front_along * cosine - front_across * sine
    front_y = front_along * sine + front_across * cosine
    return (
        front_x + rear_along + yaw_rate * sideways,
        front_y + rear_across - yaw_rate * forward,
        (car.front_axle * front_y - car.rear_axle * rear_across + scrub) * car.mass / car.yaw_inertia,
    )


def along_the_road(ca: Any, car: Vehicle) -> Any:
    """The car's change per metre of the road's line, and the seconds that a metre takes.

    Returns:
        A casadi function of state (6,), command (2,) and the line's curvature, to the change (6,) and the seconds.
    """
    state, command, curvature = ca.SX.sym("state", 6), ca.SX.sym("command", 2), ca.SX.sym("curvature")
    offset, heading, forward, sideways, yaw_rate, steering = (state[i] for i in range(6))
    rates = body_rates(ca, car, (forward, sideways, yaw_rate, steering), command[1])
    pace = (forward * ca.cos(heading) - sideways * ca.sin(heading)) / (1.0 - offset * curvature)
    change = ca.vertcat(
        forward * ca.sin(heading) + sideways * ca.cos(heading),
        yaw_rate - curvature * pace,
        *rates,
        (command[0] + car.steering_bias - steering) / car.steering_time_constant,
    )
    return ca.Function("along_the_road", [state, command, curvature], [change / pace, 1.0 / pace])
