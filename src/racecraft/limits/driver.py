"""Drives a line in the simulator, at 15 Hz and by its rules: what of an ideal lap can really be had.

    state -> place along the line -> the line's own command for the next 1/15 s + feedback on what is off -> command

The feedback is that of a linear-quadratic regulator along the lap, so it knows where the tyres have nothing left to
give. A batch of cars drives with different amounts of it; the best one counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import expm

from racecraft.limits.car import along_the_road, load_casadi
from racecraft.limits.ideal import IdealLap
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.simulation import CONTROL_DT, MAX_STEERING, Simulation, Start
from racecraft.sim.vehicle import Vehicle
from racecraft.track.polyline import Floats, wrap_angle
from racecraft.track.track import Track

NUM_CARS: Final = 96
LAPS: Final = 5
FIRST_COUNTED: Final = 2
"""Laps before the first that counts: one to join the line, one to settle on it."""
STATE_PRICES: Final = (40.0, 10.0, 4.0, 0.1, 0.1, 0.0)
"""Of being off in each state, squared: 1/m², 1/rad² and so on."""
COMMAND_PRICES: Final = (20.0, 1.0)
"""Of the feedback on steering [1/rad²] and speed [s²/m²]."""
JOIN_SPEED: Final = 0.8
"""Fraction of the line's speed at which a car chases it before it is on it."""

_LAP, _WHEELS, _STATUS, _TIME = (ROW_COLUMNS.index(n) for n in ("lap", "all_wheels_on_track", "status", "time"))
_LAP_COMPLETE: Final = STATUS_NAMES.index("lap_complete")


@dataclass(frozen=True, kw_only=True, eq=False)
class DrivenLap:
    """What a car drove in the simulator."""

    time: float
    """s, mean of three flying laps in a row with all four wheels on the road."""
    places: Floats
    """Of the car's origin, a step apart, over the last lap, m  (T, 2)."""
    speeds: Floats
    """m/s  (T,)."""


def drive_line(track: Track, line: IdealLap, car: Vehicle, *, seed: int = 0) -> DrivenLap | None:
    """Drive a line with many cars that differ in their feedback; the fastest with all wheels on the road, or None.

    Args:
        track: In driving direction.
        line: A smooth lap, of this car or of one with a little less grip.
        car: What is driven.
        seed: Of the cars' differences.
    """
    rng = np.random.default_rng(seed)
    steering_share, speed_share = rng.uniform(0.2, 1.2, NUM_CARS), rng.uniform(0.2, 1.0, NUM_CARS)
    lead, join = rng.uniform(-0.02, 0.04, NUM_CARS), rng.uniform(0.1, 0.4, NUM_CARS)
    gains = regulator(line, car)
    simulation = Simulation(
        track, num_envs=NUM_CARS, vehicle=car, camera=None, start=Start(mode="fixed"), laps=LAPS, num_threads=1
    )
    road, nodes, num = line.road, line.nodes, len(line.commands)
    course = np.unwrap(road.at(nodes[:-1], road.heading))
    driven_so_far = np.concatenate((np.zeros((1, 2)), np.cumsum(line.commands, axis=0))) * nodes[1]
    is_joined = np.zeros(NUM_CARS, dtype=np.bool_)
    wheels_on, finished = np.ones((LAPS + 1, NUM_CARS), dtype=np.bool_), np.full((LAPS + 1, NUM_CARS), np.nan)
    is_done, seen = np.zeros(NUM_CARS, dtype=np.bool_), []
    node_places = road.at(nodes[:-1], road.places)

    for _ in range(round((4.0 + 2.5 * LAPS * line.time) / CONTROL_DT)):
        x, y, heading, forward, *rest = simulation.vehicles.astype(np.float64)
        seen.append((x, y, np.hypot(forward, rest[0])))
        # where along the line, and how far off
        nearest = ((x[:, None] - node_places[:, 0]) ** 2 + (y[:, None] - node_places[:, 1]) ** 2).argmin(axis=1)
        ahead_x, ahead_y = x - node_places[nearest, 0], y - node_places[nearest, 1]
        s = nodes[nearest] + ahead_x * np.cos(course[nearest]) + ahead_y * np.sin(course[nearest])
        place, along = road.at(s, road.places), road.at(s, road.heading)
        offset = -np.sin(along) * (x - place[:, 0]) + np.cos(along) * (y - place[:, 1])
        state = np.stack([offset, wrap_angle(heading - along), forward, *rest], axis=1)
        wanted = _along(s, nodes, line.states)
        off = state - wanted
        is_near = (np.abs(off[:, 0]) < 0.08) & (np.abs(off[:, 1]) < 0.12) & (np.abs(off[:, 2]) < join * wanted[:, 2])
        is_joined = (is_joined | is_near) & (np.abs(off[:, 0]) < 0.3) & (np.abs(off[:, 1]) < 0.6)
        off = off.clip([-0.2, -0.4, -0.5, -9.0, -9.0, -9.0], [0.2, 0.4, 0.5, 9.0, 9.0, 9.0])
        # the line's commands over the way that the next step takes
        way = np.maximum(forward, 0.3) * CONTROL_DT
        begin = s + lead * forward
        own = (_total(begin + way, nodes, driven_so_far) - _total(begin, nodes, driven_so_far)) / way[:, None]
        feedback = np.einsum("nij,nj->ni", gains[(s % road.length / nodes[1]).astype(int).clip(0, num - 1)], off)
        command = own - np.stack([steering_share, speed_share], axis=1) * feedback
        chase = _chase(line, car, s, np.stack([x, y, heading, forward], axis=1))
        command = np.where(is_joined[:, None], command, chase)
        simulation.step(command.clip([-MAX_STEERING, 0.1], [MAX_STEERING, 4.0]))

        rows, cars = simulation.rows, np.arange(NUM_CARS)
        lap = rows[:, _LAP].astype(int).clip(0, LAPS)
        wheels_on[lap, cars] &= rows[:, _WHEELS] == 1.0
        crossed = (rows[:, _STATUS] == _LAP_COMPLETE) & ~is_done
        finished[lap[crossed], cars[crossed]] = rows[crossed, _TIME]
        is_done = simulation.terminated | simulation.truncated
        if is_done.all():
            break
    times = (finished[LAPS] - finished[FIRST_COUNTED]) / (LAPS - FIRST_COUNTED)
    times[~wheels_on[FIRST_COUNTED:].all(axis=0)] = np.nan
    if np.isnan(times).all():
        return None
    best = int(np.nanargmin(times))
    last = slice(round(finished[LAPS - 1, best] / CONTROL_DT), round(finished[LAPS, best] / CONTROL_DT) + 1)
    trace = np.array([[step[part][best] for part in range(3)] for step in seen])[last]
    return DrivenLap(time=float(times[best]), places=trace[:, :2], speeds=trace[:, 2])


def regulator(line: IdealLap, car: Vehicle) -> Floats:
    """Feedback of the commands on what is off in each state, for every cell of the lap  (K, 2, 6)."""
    ca = load_casadi()
    equations = along_the_road(ca, car)
    state, command, curvature = ca.SX.sym("state", 6), ca.SX.sym("command", 2), ca.SX.sym("curvature")
    change = equations(state, command, curvature)[0]
    slopes = ca.Function(
        "slopes", [state, command, curvature], [ca.jacobian(change, state), ca.jacobian(change, command)]
    )
    step, bends = line.nodes[1], line.road.at(line.nodes[:-1] + line.nodes[1] / 2, line.road.curvature)
    cells = []
    for index, bend in enumerate(bends):
        middle = (line.states[index] + line.states[index + 1]) / 2
        by_state, by_command = (np.array(part) for part in slopes(middle, line.commands[index], bend))
        both = np.zeros((8, 8))
        both[:6, :6], both[:6, 6:] = by_state * step, by_command * step
        both = expm(both)
        cells.append((both[:6, :6], both[:6, 6:]))
    state_price, command_price = np.diag(STATE_PRICES), np.diag(COMMAND_PRICES)
    cost, gains = state_price.copy(), np.zeros((len(cells), 2, 6))
    for _ in range(2):  # the second lap backwards is periodic, for all that matters
        for index in reversed(range(len(cells))):
            a, b = cells[index]
            gains[index] = np.linalg.solve(command_price + b.T @ cost @ b, b.T @ cost @ a)
            cost = state_price + a.T @ cost @ (a - b @ gains[index])
            cost = (cost + cost.T) / 2
    return gains


def _chase(line: IdealLap, car: Vehicle, s: Floats, poses: Floats) -> Floats:
    """Commands of a pure pursuit of the line, for cars that are not on it yet  (N, 2)."""
    x, y, heading, speed = poses.T
    ahead = s + 0.35 + 0.22 * speed
    offset, along = _along(ahead, line.nodes, line.states)[:, 0], line.road.at(ahead, line.road.heading)
    target = line.road.at(ahead, line.road.places) + np.stack([-np.sin(along), np.cos(along)], axis=1) * offset[:, None]
    east, north = target[:, 0] - x, target[:, 1] - y
    forward, left = np.cos(heading) * east + np.sin(heading) * north, np.cos(heading) * north - np.sin(heading) * east
    bend = 2.0 * left / np.maximum(forward**2 + left**2, 1e-6)
    steering = np.arctan(bend * (0.25 + 0.025 * speed**2)) - car.steering_bias
    return np.stack([steering, JOIN_SPEED * _along(s + 0.1 * speed, line.nodes, line.states)[:, 2]], axis=1)


def _along(s: Floats, nodes: Floats, values: Floats) -> Floats:
    """Rows of node values between the nodes  (N, D)."""
    s = s % nodes[-1]
    return np.stack([np.interp(s, nodes, column) for column in values.T], axis=1)


def _total(s: Floats, nodes: Floats, sums: Floats) -> Floats:
    """Integral of the commands along the road from the start line, over laps  (N, 2)."""
    laps, rest = np.divmod(s, nodes[-1])
    part = np.stack([np.interp(rest, nodes, column) for column in sums.T], axis=1)
    return np.asarray(laps[:, None] * sums[-1] + part)
