"""The rules against real logs: poses that AWS logged, judged again by the core."""

from __future__ import annotations

import csv
import gzip
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from racecraft.sim import ROW_COLUMNS, Simulation, Start
from racecraft.track import load_track

SHARED = Path(__file__).parents[3] / "shared"
TRACE = SHARED / "traces" / "console_05.csv.gz"
NUM_EPISODES = 60


@cache
def logged() -> list[list[dict[str, str]]]:
    """Rows of the first episodes, one list for each."""
    if not TRACE.is_file():
        pytest.skip("the folder ../shared/traces with AWS's logs is not here")
    episodes: dict[str, list[dict[str, str]]] = {}
    with gzip.open(TRACE, "rt", newline="") as file:
        for row in csv.DictReader(file):
            if row["episode"] not in episodes and len(episodes) == NUM_EPISODES:
                break
            episodes.setdefault(row["episode"], []).append(row)
    return list(episodes.values())


@cache
def judged() -> dict[str, np.ndarray]:
    """What the core says of the logged poses: a car for each episode, put at its next pose before every step."""
    episodes = logged()
    track = load_track(SHARED / "tracks" / "reinvent_base.npy")
    simulation = Simulation(track, num_envs=len(episodes), camera=None, start=Start(mode="fixed"), laps=1000)
    found: list[np.ndarray] = []
    expected: list[dict[str, str]] = []
    for step in range(max(map(len, episodes))):
        running = [env for env, rows in enumerate(episodes) if step < len(rows)]
        for env in running:
            row = episodes[env][step]
            heading = np.radians(float(row["yaw"]))
            x, y = float(row["X"]) - 0.14 * np.cos(heading), float(row["Y"]) - 0.14 * np.sin(heading)
            simulation.set_pose(env, x, y, heading)
        simulation.step(np.zeros((len(episodes), 2)))
        found += [simulation.rows[env].copy() for env in running]
        expected += [episodes[env][step] for env in running]
    rows = dict(zip(ROW_COLUMNS, np.array(found).T, strict=True))
    return rows | {"expected": np.array(expected, dtype=object)}


def column(name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in judged()["expected"]])


def test_there_are_thousands_of_rows():
    assert len(judged()["x"]) > 3000


def test_positions_survive_single_precision():
    assert np.abs(judged()["x"] - column("X")).max() < 1e-6
    assert np.abs(judged()["y"] - column("Y")).max() < 1e-6


def test_progress_agrees():
    """Progress counts from an episode's start, which the log does not say but which advances by 5 % of a lap."""
    rows = judged()
    start = 100.0 * rows["projection_distance"] / rows["track_length"] - column("progress")
    error = np.abs(start - 5.0 * np.round(start / 5.0))
    assert (error < 1e-3).mean() >= 0.995
    assert np.median(error) < 1e-6  # what float32 positions leave


def test_wheels_agree():
    expected = np.array([row["all_wheels_on_track"] == "True" for row in judged()["expected"]])
    agree = judged()["all_wheels_on_track"] == expected
    assert agree.mean() >= 0.999


def test_closest_waypoints_agree():
    """The log names the nearer of the two waypoints that enclose the car's projection."""
    rows, arc_length = judged(), load_track(SHARED / "tracks" / "reinvent_base.npy").arc_length
    behind, ahead = rows["closest_prev"].astype(int), rows["closest_next"].astype(int)
    here = rows["projection_distance"]
    nearer = np.where(here - arc_length[behind] <= arc_length[ahead] - here, behind, ahead)
    assert (nearer == column("closest_waypoint")).mean() >= 0.999


def test_off_track_agrees():
    expected = np.array([row["episode_status"] == "off_track" for row in judged()["expected"]])
    assert ((judged()["is_offtrack"] == 1.0) == expected).mean() >= 0.999
