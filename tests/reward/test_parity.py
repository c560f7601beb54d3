"""A real training run of AWS's console: its reward function, rebuilt, gives the rewards that AWS logged."""

from __future__ import annotations

import csv
import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from racecraft.reward.worker import RewardWorker
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track.track import Track

SHARED = Path(__file__).parents[3] / "shared"
TRACE, ROUTE = SHARED / "traces" / "console_05.csv.gz", SHARED / "tracks" / "reinvent_base.npy"

# In words in traces/README.md.
SOURCE = """
import math

def reward_function(params):
    if params["is_offtrack"]:
        return -10.0
    reward = 0.0
    if params["all_wheels_on_track"] and not params["is_reversed"]:
        reward += 0.1
    waypoints = params["waypoints"]
    target = waypoints[(params["closest_waypoints"][1] + 3) % len(waypoints)]
    direction = math.degrees(math.atan2(target[1] - params["y"], target[0] - params["x"]))
    difference = abs(direction - params["heading"])
    if difference > 180:
        difference = 360 - difference
    reward += math.cos(math.radians(difference)) * params["speed"] / 4.0
    if params["steps"] % 100 == 0 and params["progress"] > params["steps"] / 300 * 100:
        reward += 10.0
    return reward
"""


@pytest.mark.skipif(not TRACE.is_file(), reason="the logs of AWS's console are not beside this repository")
def test_logged_rewards():
    route = np.load(ROUTE)
    track = Track("route", centerline=route[:, 0:2], inner=route[:, 2:4], outer=route[:, 4:6])
    with gzip.open(TRACE, "rt", newline="") as file:
        logged = [row for row in csv.DictReader(file) if row["episode_status"] != "prepare"]
    points = np.array([(float(row["X"]), float(row["Y"])) for row in logged])
    s, offset = track.project(points)
    following = np.searchsorted(track.arc_length, s, side="right").clip(1, len(track.arc_length) - 1)
    rows = np.zeros((len(logged), len(ROW_COLUMNS)))

    def fill(name, values):
        rows[:, ROW_COLUMNS.index(name)] = values

    fill("x", points[:, 0])
    fill("y", points[:, 1])
    fill("offset", offset)
    fill("projection_distance", s)
    fill("closest_prev", following - 1)
    fill("closest_next", following)
    fill("heading", [math.radians(float(row["yaw"])) for row in logged])
    fill("steering_angle", [math.radians(float(row["steer"])) for row in logged])
    fill("speed", [float(row["throttle"]) for row in logged])
    fill("steps", [float(row["steps"]) for row in logged])
    fill("progress", [float(row["progress"]) / 100 for row in logged])
    fill("all_wheels_on_track", [row["all_wheels_on_track"] == "True" for row in logged])
    fill("is_offtrack", [row["episode_status"] == "off_track" for row in logged])
    fill("track_length", track.length)
    fill("track_width", track.width_at(s))

    with RewardWorker(SOURCE, track) as worker:
        rewards = worker(rows)
    wrong = np.abs(rewards - [float(row["reward"]) for row in logged]) > 1.1e-4
    assert len(logged) > 19_000
    assert not wrong.any()
