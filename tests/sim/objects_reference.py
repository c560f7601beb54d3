"""Where objects are and who runs into whom, as slowly and plainly as it can be said."""

from __future__ import annotations

import math

import numpy as np

from racecraft.track import Track

SIZES = {"box": (0.5, 0.4), "parked_car": (0.3235, 0.1961), "bot_car": (0.3235, 0.1961)}  # m, as collisions see them
CAR = (0.3235, 0.1961)
REFERENCE_AHEAD = 0.14
REAR, FRONT = 0.08166, 0.08231  # m from the car's origin to its axles


def lane_line(track: Track, s: float, lane: float) -> np.ndarray:
    """Point of a lane's middle line."""
    s = s % track.length if track.is_closed else min(max(s, 0.0), track.length)
    border = track.inner if lane >= 0 else track.outer
    lines = track.centerline + 0.5 * abs(lane) * (border - track.centerline)
    return np.array([np.interp(s, track.arc_length, lines[:, axis]) for axis in (0, 1)])


def lane_pose(track: Track, s: float, lane: float) -> tuple[float, float, float]:
    """Origin and heading of a car with both axles on a lane's line."""
    rear, front = lane_line(track, s - REAR, lane), lane_line(track, s + FRONT, lane)
    x, y = rear + REAR / (REAR + FRONT) * (front - rear)
    return x, y, math.atan2(front[1] - rear[1], front[0] - rear[0])


def corners(x: float, y: float, heading: float, size: tuple[float, float]) -> list[tuple[float, float]]:
    found = []
    for along in (-size[0] / 2, size[0] / 2):
        for across in (-size[1] / 2, size[1] / 2):
            cx = x + along * math.cos(heading) - across * math.sin(heading)
            cy = y + along * math.sin(heading) + across * math.cos(heading)
            found.append((cx, cy))
    return found


def margin(point: tuple[float, float], pose: tuple[float, float, float], size: tuple[float, float]) -> float:
    """How far a point is inside a rectangle, m; negative outside."""
    dx, dy = point[0] - pose[0], point[1] - pose[1]
    along = dx * math.cos(pose[2]) + dy * math.sin(pose[2])
    across = dy * math.cos(pose[2]) - dx * math.sin(pose[2])
    return min(size[0] / 2 - abs(along), size[1] / 2 - abs(across))


def overlap(car: tuple[float, float, float], other: tuple[float, float, float], kind: str) -> float:
    """How deep the deepest corner of the car is in the other, m; negative if none is."""
    return max(margin(corner, other, SIZES[kind]) for corner in corners(*car, CAR))


def closest(distances: list[float], here: float) -> tuple[int, int]:
    """The objects behind and ahead along the track: AWS sorts them and bisects."""
    order = sorted(range(len(distances)), key=lambda i: distances[i])
    place = sum(d <= here for d in distances)
    return order[(place - 1) % len(order)], order[place % len(order)]
