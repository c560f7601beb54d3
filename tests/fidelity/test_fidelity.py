"""The simulator against training runs of AWS's console: the figures of docs/fidelity.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from racecraft.fidelity import replay

SHARED = Path(__file__).parents[3] / "shared"
ROUTE = SHARED / "tracks" / "reinvent_base.npy"
RUNS = [SHARED / "traces" / f"console_{number:02d}.csv.gz" for number in range(1, 19)]
UNSEEN = [RUNS[number - 1] for number in (4, 7, 10, 13, 16, 18)]  # v5 was fitted to the others
OLDER = SHARED / "traces" / "console_2022.csv.gz"

pytestmark = pytest.mark.skipif(not OLDER.is_file(), reason="the logs of AWS's console are not beside this repository")

# In words in traces/README.md.
REWARD = """
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


def medians(found: dict) -> list[float]:
    return [100 * metres for metres in found["position_error_m"].values()]


@pytest.mark.costly
def test_the_rules_of_every_row_of_every_run():
    result = replay([*RUNS, OLDER], track=str(ROUTE))
    found = result.to_dict()
    assert (found["rows"], found["episodes"], found["broken_rows"]) == (277_872, 3_120, 0)
    assert found["progress_agreement"] == 1.0
    assert found["closest_waypoint_agreement"] == 1.0
    assert found["all_wheels_agreement"] > 0.9997
    assert found["episode_end_agreement"] > 0.993
    assert not result.reversed


@pytest.mark.costly
def test_the_car_on_runs_that_the_fit_never_saw():
    found = replay(UNSEEN, track=str(ROUTE), vehicle="v5").to_dict()
    assert found["windows"] > 50_000
    assert all(error < bar for error, bar in zip(medians(found), (3.0, 7.0, 12.0), strict=True))
    turns = found["heading_error_deg"].values()
    assert all(error < bar for error, bar in zip(turns, (3.0, 5.0, 6.5), strict=True))


@pytest.mark.costly
def test_the_car_of_2022():
    found = replay(OLDER, track=str(ROUTE), vehicle="v4").to_dict()
    assert all(error < bar for error, bar in zip(medians(found), (2.5, 5.5, 9.0), strict=True))


def test_the_car_of_version_6():
    logs = sorted((SHARED / "logs" / "droa").glob("*.csv"))
    found = replay(logs, track=str(SHARED / "tracks" / "Spain_track.npy"), vehicle="v6").to_dict()
    assert found["progress_agreement"] == 1.0
    assert found["closest_waypoint_agreement"] == 1.0  # its route names a waypoint twice
    assert found["all_wheels_agreement"] > 0.997
    assert found["episode_end_agreement"] > 0.95
    assert all(error < bar for error, bar in zip(medians(found), (3.0, 5.5, 8.5), strict=True))


@pytest.mark.costly
def test_every_row_of_the_other_eras_that_differs_is_explained():
    for folder, route, marks in (
        ("droa", "Spain_track", 14),
        ("drfc", "reinvent_base", 1),
        ("console", "reinvent_base", 0),
    ):
        logs = [path for path in (SHARED / "logs" / folder).iterdir() if path.suffix in (".csv", ".log")]
        logs = [path for path in logs if "sagemaker" not in path.name]
        result = replay(logs, track=str(SHARED / "tracks" / f"{route}.npy"), vehicle="v4")
        found = [difference.why for difference in result.differences.kept]
        assert len(found) == marks, folder
        for why in found:
            near = re.search(r"([\d.]+) mm", why)
            assert "just put back" in why or (near is not None and float(near[1]) < 10.0), why


def test_logged_rewards():
    result = replay(RUNS[4], track=str(ROUTE), reward=REWARD)
    assert result.rewards > 19_000
    assert result.to_dict()["reward_agreement"] > 0.999  # within 1e-4; the others are on an edge: a wheel, or the pace


@pytest.mark.parametrize("folder", ["console", "drfc"])
def test_logs_of_other_eras(folder):
    logs = [
        path for path in (SHARED / "logs" / folder).iterdir() if "simtrace" in path.name or "robomaker" in path.name
    ]
    found = replay(logs, track=str(ROUTE), vehicle="v4").to_dict()
    assert found["rows"] > 1_000
    for key in ("progress_agreement", "all_wheels_agreement", "closest_waypoint_agreement"):
        assert found[key] > 0.999
    assert found["episode_end_agreement"] > 0.97
