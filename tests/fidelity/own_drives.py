"""Drives of the simulator, and logs of them in every form."""

from __future__ import annotations

import gzip
import math

import numpy as np

from racecraft.run.simtrace import COLUMNS
from racecraft.sim import ROW_COLUMNS, STATUS_NAMES, Simulation, Start
from racecraft.track import load_track

OVAL = load_track("oval")
AT = {name: index for index, name in enumerate(ROW_COLUMNS)}


def drive(*, episodes: int, direction: str = "forward", vehicle: str = "v5") -> list[list[str]]:
    """Fields of a log of 19 columns, written from the simulation's rows."""
    start = Start(mode="random", lateral_jitter=0.1)
    simulation = Simulation(OVAL, camera=None, seed=4, start=start, direction=direction, vehicle=vehicle)
    waypoints = (OVAL if direction == "forward" else OVAL.reversed()).centerline
    rng, lines, clock = np.random.default_rng(3), [], 10.0
    action = np.array([0.0, 1.0])
    for episode in range(episodes):
        simulation.reset()
        row, is_over = simulation.rows[0].tolist(), False
        while True:
            behind, ahead = int(row[AT["closest_prev"]]), int(row[AT["closest_next"]])
            here = row[AT["x"]], row[AT["y"]]
            nearer = min((behind, ahead), key=lambda i: math.dist(waypoints[i], here))
            clock += 1 / 15
            status = STATUS_NAMES[int(row[AT["status"]])]
            reward = 0.0 if status == "prepare" else row[AT["speed"]]
            lines.append(
                [
                    *(str(episode), repr(row[AT["steps"]]), repr(here[0]), repr(here[1])),
                    repr(math.degrees(row[AT["heading"]])),
                    *(repr(math.degrees(row[AT["steering_angle"]])), repr(row[AT["speed"]]), "[1.0 2.0]"),
                    *(repr(reward), str(is_over), str(row[AT["all_wheels_on_track"]] > 0)),
                    "100" if row[AT["progress"]] >= 1 else repr(100 * row[AT["progress"]]),
                    *(str(nearer), repr(OVAL.length), repr(clock), status, "0.0", "0", "1700000000.5"),
                ]
            )
            if is_over:
                break
            s = simulation.state[0]
            if rng.random() < 0.3:
                action = np.array([rng.uniform(-0.3, 0.3), rng.uniform(0.8, 2.0)])
            steer = -0.5 * s[4] - 1.2 * s[5] + 0.2 * s[9]
            simulation.step([np.clip(action + np.array([steer, 0.0]), -0.5, 3.0)])
            row, is_over = simulation.rows[0].tolist(), bool(simulation.terminated[0])
    return lines


def write(path, lines, *, columns: int = 19, form: str = "csv"):
    """A log of these fields: a table with a header (csv), without one (bare), or a simulator's output (log)."""
    rows = [",".join(fields[:columns]) for fields in lines]
    if form == "log":
        rows = [f"2026-01-01 INFO something\nSIM_TRACE_LOG:{row}" for row in rows]
    elif form == "csv":
        rows.insert(0, ",".join(COLUMNS[:columns]))
    data = ("\n".join(rows) + "\n").encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    return path
