"""Many of AWS's routes name a waypoint twice. Its rules count both, so rows, rewards and logs here do."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
import pytest
import shapely

from racecraft.reward import RewardWorker
from racecraft.sim import Simulation, Start
from racecraft.track import Track, load_track

TELLS = """
def reward_function(params):
    behind, ahead = params["closest_waypoints"]
    assert ahead == behind + 1
    return behind + len(params["waypoints"]) / 1000
"""


def closest_waypoints(waypoints: np.ndarray, x: float, y: float) -> tuple[int, int]:
    """AWS's rule, in its own words: shares of the length of every waypoint, and where the car's falls among them."""
    line = shapely.LinearRing(waypoints)
    shares = [line.project(shapely.Point(point), normalized=True) for point in waypoints[:-1]] + [1.0]
    ahead = bisect_right(shares, line.project(shapely.Point(x, y), normalized=True))
    return ahead - 1, ahead


@pytest.mark.costly
@pytest.mark.parametrize("direction", ["forward", "reverse"])
def test_closest_waypoints_are_those_of_the_route(direction: str) -> None:
    plain = load_track("oval")
    rows = np.sort(np.concatenate((np.arange(len(plain.centerline)), [4, 9, 9, 30])))
    track = Track("doubled", plain.centerline[rows], plain.inner[rows], plain.outer[rows])
    waypoints = (track.reversed() if direction == "reverse" else track).waypoints
    start = Start(mode="random", lateral_jitter=0.2)
    simulation = Simulation(track, num_envs=200, camera=None, direction=direction, start=start, seed=2)
    twin = Simulation(plain, num_envs=200, camera=None, direction=direction, start=start, seed=2)
    with RewardWorker(TELLS, [track]) as worker:
        for _ in range(3):
            for cars in (simulation, twin):
                cars.step(np.tile(np.float32([0.1, 2.0]), (200, 1)))
            behind = simulation.column("closest_prev").astype(int)
            places = zip(simulation.column("x"), simulation.column("y"), strict=True)
            expected = [closest_waypoints(waypoints, x, y) for x, y in places]
            assert list(zip(behind, simulation.column("closest_next").astype(int), strict=True)) == expected
            assert worker(simulation.rows) == pytest.approx(behind + len(waypoints) / 1000)
            # Nothing but the count depends on it.
            np.testing.assert_array_equal(simulation.vehicles, twin.vehicles)
            np.testing.assert_array_equal(simulation.column("progress"), twin.column("progress"))
    assert len(set(behind)) > 30
