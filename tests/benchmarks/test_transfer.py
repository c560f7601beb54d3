"""The second world is sane: it can be driven, left is left, and its camera sees the paint where the road has it."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from racecraft import load_track

ROOT = Path(__file__).parents[2]
MUJOCO = ROOT / "build" / "mujoco"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (MUJOCO / "mujoco").exists() and find_spec("mujoco") is None,
        reason="MuJoCo is not installed: make build/mujoco",
    ),
]


@pytest.fixture(scope="module")
def transfer():
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        import transfer
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))
    return transfer


def test_a_controller_that_knows_where_it_is_laps_and_one_that_does_not_steer_leaves_the_road(transfer):
    track = load_track("reinvent_2018")
    world = transfer.World(track, seed=2, size=None)
    lap = transfer.drive_lap(world, track, transfer.geometry(track), start=2, sees=False)
    assert (lap.ended, lap.completion) == ("completed", 1.0)
    assert 13 < lap.seconds < 18
    straight = transfer.drive_lap(world, track, lambda _, __: (0.0, 1.2), start=0, sees=False)
    assert straight.ended == "off the road"
    assert 0.05 < straight.completion < 0.5


def test_it_turns_to_where_it_steers_and_drives_as_fast_as_it_is_told(transfer):
    track = load_track("oval")
    world = transfer.World(track, seed=0, size=None)
    turns = []
    for angle in (0.2, -0.2, 0.0):
        world.place(*track.point_at(1.0), 0.0)
        for _ in range(30):
            world.step(angle, 1.0)
        turns.append(world.pose.heading)
        assert world.pose.speed == pytest.approx(1.0, abs=0.15)
    assert turns[0] > 0.5
    assert turns[1] < -0.5
    assert turns[2] == pytest.approx(0.0, abs=0.1)


def test_the_camera_sees_the_dashes_where_the_middle_of_the_road_is(transfer):
    track = load_track("oval")
    x, y = track.point_at(1.0)
    heading = float(track.heading_at(1.0))
    try:
        world = transfer.World(track, seed=0)
    except Exception as error:  # of whichever library lacks a part
        pytest.skip(f"nothing draws here: {error}")
    for left in (0.0, 0.1):
        world.place(x - left * np.sin(heading), y + left * np.cos(heading), heading)
        red, _, blue = world.picture()[360:460].astype(int).transpose(2, 0, 1)
        rows, columns = np.nonzero(red - blue > 60)  # yellow
        assert len(columns) > 300
        # the ray of a row meets the floor 0.1314 m below the lens
        down = np.tan(0.2618 + np.arctan((rows + 360.5 - 240) / (320 / np.tan(0.565))))
        slant = 0.1314 / down * np.cos(0.2618) + 0.1314 * np.sin(0.2618)
        expected = 320 + left / slant * 320 / np.tan(0.565)
        assert np.abs(columns - expected).mean() < 25
        assert np.abs((columns - expected).mean()) < 8
    world.close()
