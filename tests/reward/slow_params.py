"""A slow, obvious second computation of the params, from a route's file, a pose and a command.

It shares nothing with the simulator, `Track` or `make_params`: lines are shapely's, everything is searched anew, and
each key is one method of its own name. `test_contract.py` drives cars and compares.
"""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

WHEELS = ((-0.08166, 0.08105), (-0.08166, -0.08105), (0.08231, 0.0796), (0.08231, -0.0796))  # m, forward and left


@dataclass(frozen=True)
class Road:
    """A route as its file has it, (W, 6), with everything turned round where it is driven in reverse."""

    route: np.ndarray
    is_reversed: bool

    @cached_property
    def lines(self) -> list[list[tuple[float, float]]]:
        """Waypoints of centre, inner and outer line in driving direction."""
        rows = self.route[::-1] if self.is_reversed else self.route
        return [[(float(x), float(y)) for x, y in rows[:, i : i + 2]] for i in (0, 2, 4)]

    @cached_property
    def center(self) -> LineString:
        return LineString(self.lines[0])

    @cached_property
    def is_closed(self) -> bool:
        return self.lines[0][0] == self.lines[0][-1]

    @cached_property
    def surface(self) -> Polygon:
        _, inner, outer = self.lines
        if not self.is_closed:
            return Polygon([*outer, *reversed(inner)])
        rings = sorted((Polygon(inner), Polygon(outer)), key=lambda ring: ring.area)
        return Polygon(rings[1].exterior, [rings[0].exterior])


@dataclass(frozen=True)
class Moment:
    """What is known of a call from outside: where the car stood, what it was told, which call of the episode it is."""

    road: Road
    pose: tuple[float, float, float]
    """m, m, rad: the car's origin before the action acts."""
    command: tuple[float, float]
    """rad, m/s."""
    call: int
    """Of this episode, from 0."""
    start: float
    """Fraction of the lap where the episode began."""
    progress_before: float
    """Fraction of the lap at the call before; 0 at the start."""

    @cached_property
    def front(self) -> Point:
        x, y, heading = self.pose
        return Point(x + 0.14 * math.cos(heading), y + 0.14 * math.sin(heading))

    @cached_property
    def nearest(self) -> Point:
        return shapely.shortest_line(self.road.center, self.front).interpolate(0.0)

    def wheels_on_road(self) -> list[bool]:
        x, y, heading = self.pose
        c, s = math.cos(heading), math.sin(heading)
        centers = [Point(x + f * c - left * s, y + f * s + left * c) for f, left in WHEELS]
        return [self.road.surface.contains(center) for center in centers]

    # --- the keys

    def all_wheels_on_track(self) -> bool:
        return all(self.wheels_on_road())

    def x(self) -> float:
        return self.front.x

    def y(self) -> float:
        return self.front.y

    def heading(self) -> float:
        return math.degrees(math.atan2(math.sin(self.pose[2]), math.cos(self.pose[2])))

    def distance_from_center(self) -> float:
        return self.road.center.distance(self.front)

    def projection_distance(self) -> float:
        return self.road.center.project(self.front)

    def progress(self) -> float:
        here = self.projection_distance() / self.track_length() - self.start
        if self.road.is_closed:  # of all that differ by whole laps, the one next to the call before
            here = min((here + lap for lap in range(-2, 3)), key=lambda p: abs(p - self.progress_before))
        return min(100.0 * here, 100.0)

    def steps(self) -> float:
        return 2.0 + self.call

    def speed(self) -> float:
        return self.command[1]

    def steering_angle(self) -> float:
        return math.degrees(self.command[0])

    def track_width(self) -> float:
        inner, outer = (LineString(line) for line in self.road.lines[1:])
        return inner.interpolate(inner.project(self.nearest)).distance(outer.interpolate(outer.project(self.nearest)))

    def track_length(self) -> float:
        points = self.road.lines[0]
        return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))

    def waypoints(self) -> list[tuple[float, float]]:
        return self.road.lines[0]

    def closest_waypoints(self, shift: float = 0.0) -> list[int]:
        points = self.road.lines[0]
        marks = [0.0]
        for a, b in itertools.pairwise(points):
            marks.append(marks[-1] + math.dist(a, b))
        here = (self.projection_distance() + shift) / marks[-1]
        ahead = bisect.bisect_right([mark / marks[-1] for mark in marks], here)
        ahead = min(max(ahead, 1), len(points) - 1)
        return [ahead - 1, ahead]

    def is_left_of_center(self) -> bool:
        behind, ahead = (np.array(self.road.lines[0][index]) for index in self.closest_waypoints())
        along, across = ahead - behind, np.array(self.front.coords[0]) - behind
        return bool(along[0] * across[1] - along[1] * across[0] > 0.0)

    def is_reversed(self) -> bool:
        return self.road.is_reversed

    def closest_objects(self) -> list[int]:
        return [0, 0]

    def objects_location(self) -> list[tuple[float, float]]:
        return []

    def objects_left_of_center(self) -> list[bool]:
        return []

    def object_in_camera(self) -> bool:
        return False

    def objects_speed(self) -> list[float]:
        return []

    def objects_heading(self) -> list[float]:
        return []

    def objects_distance_from_center(self) -> list[float]:
        return []

    def objects_distance(self) -> list[float]:
        return []

    def is_crashed(self) -> bool:
        return False

    def is_offtrack(self) -> bool:
        return not any(self.wheels_on_road())

    def sim_time(self) -> float:
        return self.steps() / 15.0
