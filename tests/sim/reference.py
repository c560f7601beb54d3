"""A slow, obvious simulator of one car in float64, written from the rules and the physics, not from the core.

It shares nothing with the native code but `Track` and `Vehicle`: no grid, no tables, no float32, math.sin instead of
polynomials. `test_reference.py` holds the core to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from racecraft.sim import Vehicle
from racecraft.track import Track

GRAVITY = 9.8  # m/s²
DT = 1.0 / 15.0  # s, one control step
DRIVE_OVER_FRICTION = 3.0  # most that drive and brakes may give over what the slipperier axle gives across
YAW_RATE = 60.0  # rad/s, fastest spin
REFERENCE_AHEAD = 0.14  # m, from the origin to the point that x, y and progress speak of
WHEELS = ((-0.08166, 0.08105), (-0.08166, -0.08105), (0.08231, 0.0796), (0.08231, -0.0796))  # m, forward and left
PATIENCE = 15  # steps of standing or of falling progress that end an episode
STANDSTILL = 0.0003  # m in a step


@dataclass
class Pose:
    """Where a car is and how it moves; SI units, radians."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    lateral_speed: float = 0.0
    yaw_rate: float = 0.0
    steering: float = 0.0

    def array(self) -> np.ndarray:
        return np.array([self.x, self.y, self.heading, self.speed, self.lateral_speed, self.yaw_rate, self.steering])


def clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def command(action: tuple[float, float]) -> tuple[float, float]:
    """What the car is told to do: up to ±45°, and 0.1 to 12 m/s or a stop."""
    steering, speed = action
    return clip(steering, -math.pi / 4, math.pi / 4), 0.0 if speed == 0.0 else clip(speed, 0.1, 12.0)


def saturated(wanted: float, limit: float) -> float:
    return wanted / math.sqrt(1.0 + (wanted / limit) ** 2)


def rates(car: Vehicle, state: np.ndarray, steering_command: float, speed_command: float) -> np.ndarray:
    """Time derivatives of the seven numbers of a Pose."""
    _, _, heading, u, v, r, delta = state
    weight = car.mass * GRAVITY
    target = speed_command * car.speed_gain
    most = DRIVE_OVER_FRICTION * min(car.front_friction, car.rear_friction) * GRAVITY

    def across(load: float, friction: float, stiffness: float, forward: float, sideways: float) -> float:
        """Force of an axle's tyres across its wheels, newtons."""
        return -load * saturated(stiffness * sideways / max(forward, car.slip_speed), friction)

    def along(load: float, forward: float) -> float:
        """Force of one wheel that turns at the target speed, newtons."""
        limit = car.drive_acceleration if forward < target else car.brake_acceleration
        return load / GRAVITY * saturated((target - forward) / car.speed_time_constant, min(limit, most))

    # Every wheel's velocity along its own plane, and each axle's across.
    front_v, rear_v = v + car.front_axle * r, v - car.rear_axle * r
    front_load, rear_load = weight * car.front_load, weight * (1.0 - car.front_load)
    force_x = force_y = moment = 0.0
    for axle_x, load, angle in ((car.front_axle, front_load, delta), (-car.rear_axle, rear_load, 0.0)):
        axle_v = front_v if axle_x > 0 else rear_v
        c, s = math.cos(angle), math.sin(angle)
        friction, stiffness = (
            (car.front_friction, car.front_stiffness) if axle_x > 0 else (car.rear_friction, car.rear_stiffness)
        )
        side = across(load, friction, stiffness, u * c + axle_v * s, axle_v * c - u * s)
        parts = [(axle_x, 0.0, -side * s, side * c)]
        for y in (car.half_track, -car.half_track):
            pull = along(load / 2, (u - r * y) * c + axle_v * s)
            parts.append((axle_x, y, pull * c, pull * s))
        for x, y, fx, fy in parts:
            force_x += fx
            force_y += fy
            moment += x * fy - y * fx
    steering_rate = (steering_command + car.steering_bias - delta) / car.steering_time_constant
    return np.array(
        [
            u * math.cos(heading) - v * math.sin(heading),
            u * math.sin(heading) + v * math.cos(heading),
            r,
            force_x / car.mass + r * v,
            force_y / car.mass - r * u,
            moment / car.yaw_inertia,
            clip(steering_rate, -car.steering_rate, car.steering_rate),
        ]
    )


def move(
    car: Vehicle, pose: Pose, action: tuple[float, float], *, substeps: int = 8, sim_dt: float | None = None
) -> Pose:
    """One control step of classic Runge-Kutta of fourth order, or with sim_dt so many substeps of that."""
    steering, speed = command(action)
    steering, speed = clip(steering, -math.pi / 6, math.pi / 6), min(speed, 4.0)  # no further, and no faster
    state, dt = pose.array(), DT / substeps if sim_dt is None else sim_dt
    for _ in range(substeps):
        k1 = rates(car, state, steering, speed)
        k2 = rates(car, state + dt / 2 * k1, steering, speed)
        k3 = rates(car, state + dt / 2 * k2, steering, speed)
        k4 = rates(car, state + dt * k3, steering, speed)
        state = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        state[2] = math.remainder(state[2], 2 * math.pi)
        state[3] = max(state[3], 0.0)
        state[5] = clip(state[5], -YAW_RATE, YAW_RATE)
    return Pose(*state.tolist())


def front_point(pose: Pose) -> tuple[float, float]:
    return (
        pose.x + REFERENCE_AHEAD * math.cos(pose.heading),
        pose.y + REFERENCE_AHEAD * math.sin(pose.heading),
    )


def wheel_points(pose: Pose) -> list[tuple[float, float]]:
    c, s = math.cos(pose.heading), math.sin(pose.heading)
    return [(pose.x + f * c - side * s, pose.y + f * s + side * c) for f, side in WHEELS]


def is_inside(ring: np.ndarray, x: float, y: float) -> bool:
    """Even-odd rule: an odd number of edges lies to the right of the point."""
    x0, y0 = ring.T
    x1, y1 = np.roll(ring, -1, axis=0).T
    spans = (y0 <= y) != (y1 <= y)
    crossing = x0[spans] + (y - y0[spans]) * (x1 - x0)[spans] / (y1 - y0)[spans]
    return int((crossing > x).sum()) % 2 == 1


def is_on_road(track: Track, x: float, y: float) -> bool:
    if track.is_closed:
        return is_inside(track.inner, x, y) != is_inside(track.outer, x, y)
    return is_inside(np.concatenate((track.outer, track.inner[::-1])), x, y)


def project(track: Track, x: float, y: float) -> tuple[float, float, int]:
    """Arc length, offset and the piece of the centre line that is nearest, by trying all of them."""
    start, step = track.centerline[:-1], np.diff(track.centerline, axis=0)
    length = np.hypot(*step.T)
    to_point = np.array([x, y]) - start
    along = np.clip((to_point * step).sum(axis=1) / length**2, 0.0, 1.0)
    distance = np.hypot(*(to_point - along[:, None] * step).T)
    nearest = int(distance.argmin())
    side = step[nearest, 0] * to_point[nearest, 1] - step[nearest, 1] * to_point[nearest, 0]
    arc_length = float(track.arc_length[nearest] + along[nearest] * length[nearest])
    if track.is_closed:
        arc_length %= track.length
    # A place on a waypoint belongs to the piece that starts there.
    piece = int(np.searchsorted(track.arc_length, arc_length, side="right")) - 1
    return arc_length, math.copysign(distance[nearest], side), min(piece, len(step) - 1)


@dataclass
class Judge:
    """What the rules remember of one car during an episode."""

    track: Track
    start: float
    pose: Pose
    laps: int = 1
    steps: int = 1
    completed: int = 0
    progress: float = 0.0
    falling: int = 0
    standing: int = 0
    front: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        self.front = front_point(self.pose)
        self.progress = self._shorter_way(project(self.track, *self.front)[0] / self.track.length - self.start)

    def _shorter_way(self, fraction: float) -> float:
        return fraction - math.floor(fraction + 0.5) if self.track.is_closed else fraction

    def __call__(self, pose: Pose, action: tuple[float, float]) -> tuple[dict[str, float], bool]:
        """The row of a step, as far as it is the rules' business, and whether the episode is over."""
        front = front_point(pose)
        arc_length, offset, piece = project(self.track, *front)
        wheels = [is_on_road(self.track, *wheel) for wheel in wheel_points(pose)]
        self.steps += 1

        now = self.progress + self._shorter_way(arc_length / self.track.length - self.start - self.progress)
        self.falling = self.falling + 1 if now < self.progress else 0
        self.standing = self.standing + 1 if math.dist(front, self.front) <= STANDSTILL else 0
        self.progress, self.front = now, front

        status = "in_progress"
        if self.falling >= PATIENCE:
            status = "reversed"
        if self.standing >= PATIENCE:
            status = "immobilized"
        if not any(wheels):
            status = "off_track"
        if now >= 1.0:
            status = "lap_complete"
            self.completed += 1
        is_over = self.completed >= self.laps if status == "lap_complete" else status != "in_progress"
        steering, speed = command(action)
        row = {
            "steps": self.steps,
            "x": front[0],
            "y": front[1],
            "heading": pose.heading,
            "steering_angle": steering,
            "speed": speed,
            "progress": now,
            "offset": offset,
            "projection_distance": arc_length,
            "track_width": float(self.track.width_at(arc_length)),
            "track_length": self.track.length,
            "closest_prev": piece,
            "closest_next": piece + 1,
            "all_wheels_on_track": all(wheels),
            "is_offtrack": not any(wheels),
            "status": status,
            "time": self.steps * DT,
            "actual_speed": pose.speed,
            "actual_steering_angle": pose.steering,
            "lap": self.completed,
        }
        if status == "lap_complete" and not is_over:
            self.progress -= 1.0
        return row, is_over
