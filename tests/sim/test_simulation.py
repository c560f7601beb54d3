"""What an episode is: starts, the order of a step, every way to end, laps, penalties, commands."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft import _native
from racecraft.errors import ConfigError
from racecraft.sim import CONTROL_DT, ROW_COLUMNS, STATUS_NAMES, Simulation, Start, Vehicle
from racecraft.sim.columns import STATE_COLUMNS
from racecraft.track import Track, load_track

OVAL = load_track("oval")
FIXED = Start(mode="fixed")
STRAIGHT = Vehicle(steering_bias=0.0)  # goes where it is steered


def test_names_are_the_cores():
    assert tuple(_native.ROW_COLUMNS) == ROW_COLUMNS
    assert tuple(_native.STATE_COLUMNS) == STATE_COLUMNS


def test_shapes_and_types():
    simulation = Simulation([OVAL, load_track("bowtie")], num_envs=5)
    assert simulation.frames.shape == (5, 120, 160)
    assert simulation.frames.dtype == np.uint8
    assert simulation.rows.shape == (5, len(ROW_COLUMNS))
    assert simulation.rows.dtype == np.float64
    assert simulation.state.shape == (5, len(STATE_COLUMNS))
    assert simulation.state.dtype == np.float32
    assert simulation.terminated.shape == simulation.truncated.shape == (5,)
    assert simulation.column("track_index").tolist() == [0, 1, 0, 1, 0]
    assert simulation.frames.base is not None
    assert Simulation(OVAL, camera=None).frames.size == 0


def test_the_prepare_step_is_part_of_the_reset(status):
    simulation = Simulation(OVAL, camera=None, start=FIXED)
    assert status(simulation) == "prepare"
    assert simulation.column("steps")[0] == 1
    assert simulation.column("progress")[0] == pytest.approx(0.14 / OVAL.length, rel=1e-3)
    x, y = simulation.rows[0, 2:4]
    simulation.step([[0.0, 1.0]])
    assert status(simulation) == "in_progress"
    assert simulation.column("steps")[0] == 2
    # The row holds the pose before the action acts, with the action's command.
    assert simulation.rows[0, 2:4].tolist() == [x, y]
    assert simulation.column("speed")[0] == 1.0
    assert simulation.column("actual_speed")[0] == 0.0
    assert simulation.vehicles[3, 0] > 0.1
    simulation.step([[0.0, 1.0]])
    assert simulation.column("actual_speed")[0] > 0.1
    assert simulation.column("time")[0] == pytest.approx(3 * CONTROL_DT)


def test_commands_are_clipped_and_a_stop_is_a_stop():
    simulation = Simulation(OVAL, num_envs=4, camera=None, start=FIXED)
    simulation.step([[9, 90], [-9, -9], [0.2, 0.05], [0.2, 0.0]])
    limit = float(np.float32(math.pi / 4))  # the wheels stop at 30°, see test_reference.py
    assert simulation.column("steering_angle")[:2].tolist() == [limit, -limit]
    assert simulation.column("speed").tolist() == [12.0, float(np.float32(0.1)), float(np.float32(0.1)), 0.0]


# --- starts


def starts(simulation: Simulation, episodes: int) -> np.ndarray:
    """Fraction of the lap at which each episode of each car starts, (episodes, N)."""
    found = []
    for _ in range(episodes):
        length = simulation.column("track_length")
        found.append((simulation.column("projection_distance") / length - simulation.column("progress")) % 1.0)
        simulation.reset()
    return np.array(found)


def on_circle(fractions: np.ndarray, expected: np.ndarray) -> bool:
    return bool((np.abs((fractions - expected + 0.5) % 1.0 - 0.5) < 1e-9).all())


def test_starts_advance_by_five_percent_of_a_lap():
    simulation = Simulation(OVAL, num_envs=2, camera=None)
    assert on_circle(starts(simulation, 45), 0.05 * np.arange(45)[:, None])
    assert simulation.column("episode").tolist() == [45, 45]


def test_starts_may_be_fixed_offset_spread_or_of_another_step():
    assert on_circle(
        starts(Simulation(OVAL, camera=None, start=Start(mode="fixed", offset=0.3)), 3), np.full((3, 1), 0.3)
    )
    spread = Simulation(OVAL, num_envs=4, camera=None, start=Start(spread=True, advance=0.1))
    assert on_circle(starts(spread, 3), 0.1 * np.arange(3)[:, None] + 0.25 * np.arange(4))


def test_a_start_on_a_waypoint_points_along_the_road_ahead():
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    square = Track("square", 2.0 * corners, 1.5 * corners, 2.5 * corners)
    for number in range(4):
        start = Start(mode="fixed", offset=number / 4)
        x, y, heading = Simulation(square, camera=None, start=start).vehicles[:3, 0].tolist()
        assert [x, y] == (2.0 * corners[number]).tolist()
        ahead = 0.5 * np.diff(corners, axis=0)[number]
        assert [math.cos(heading), math.sin(heading)] == pytest.approx(ahead.tolist(), abs=1e-6)


def test_starts_may_be_random():
    fractions = starts(Simulation(OVAL, num_envs=50, camera=None, start=Start(mode="random")), 40)
    assert len(np.unique(fractions.round(9))) > 1900
    counts = np.histogram(fractions, bins=10, range=(0, 1))[0]
    assert counts.min() > 140
    again = starts(Simulation(OVAL, num_envs=50, camera=None, start=Start(mode="random")), 40)
    assert (fractions == again).all()
    other = starts(Simulation(OVAL, num_envs=50, camera=None, seed=1, start=Start(mode="random")), 40)
    assert (fractions != other).mean() > 0.99


def test_jitter_stays_in_its_bounds_and_fills_them(road):
    jitter = Start(lateral_jitter=0.3, heading_jitter=0.5)
    simulation = Simulation(road, num_envs=500, camera=None, start=jitter)
    offset, heading = simulation.vehicles[1], simulation.vehicles[2]
    assert np.abs(offset).max() <= 0.3
    assert np.abs(heading).max() <= 0.5 + 1e-6
    assert np.abs(offset).max() > 0.29
    assert offset.min() < -0.28 < 0.28 < offset.max()
    assert abs(np.corrcoef(offset, heading)[0, 1]) < 0.2


def test_jitter_is_across_the_road_whichever_way_it_points():
    offsets = []
    for fraction in (0.0, 0.2, 0.45, 0.8):
        start = Start(mode="fixed", offset=fraction, lateral_jitter=0.3)
        simulation = Simulation(OVAL, num_envs=100, camera=None, start=start)
        straight = Simulation(OVAL, camera=None, start=Start(mode="fixed", offset=fraction))
        apart = simulation.vehicles[:2].T.astype(float) - straight.vehicles[:2, 0].astype(float)
        heading = float(straight.vehicles[2, 0])
        np.testing.assert_allclose(apart @ [np.cos(heading), np.sin(heading)], 0.0, atol=1e-5)
        offsets.append(apart @ [-np.sin(heading), np.cos(heading)])
        assert offsets[-1].min() < -0.25
        assert offsets[-1].max() > 0.25
    np.testing.assert_allclose(offsets, np.broadcast_to(offsets[0], np.shape(offsets)), atol=1e-5)


def test_an_open_road_always_starts_at_its_beginning(road):
    simulation = Simulation(road, num_envs=3, camera=None, start=Start(mode="random", spread=True, offset=0.5))
    for _ in range(3):
        assert (simulation.vehicles[0] == 0.0).all()
        simulation.reset()


@pytest.mark.parametrize("direction", ["forward", "reverse", "alternate"])
def test_directions(direction):
    simulation = Simulation([OVAL, load_track("bowtie")], num_envs=4, camera=None, direction=direction, start=FIXED)
    for episode in range(4):
        is_reversed = {"forward": False, "reverse": True, "alternate": episode % 2 == 1}[direction]
        assert (simulation.column("is_reversed") == is_reversed).all()
        assert simulation.column("track_index").tolist() == [2 * is_reversed, 1 + 2 * is_reversed] * 2
        track = simulation.driven_track(1)
        expected = (load_track("bowtie").reversed() if is_reversed else load_track("bowtie")).heading_at(0.0)
        assert track.heading_at(0.0) == expected
        assert simulation.vehicles[2, 1] == pytest.approx(float(expected), abs=1e-5)
        for _ in range(10):
            simulation.step(np.tile([0.0, 1.0], (4, 1)))
        assert (simulation.column("progress") > 0.01).all()
        simulation.reset()


def test_track_choice_counts_from_the_next_episode():
    simulation = Simulation([OVAL, load_track("bowtie")], num_envs=2, camera=None)
    simulation.track_choice[:] = 1
    assert simulation.column("track_index").tolist() == [0, 1]
    simulation.reset()
    assert simulation.column("track_index").tolist() == [1, 1]
    assert simulation.column("track_length")[0] == pytest.approx(load_track("bowtie").length)


# --- ends


def test_a_lap_is_complete_when_progress_reaches_one(road, status):
    simulation = Simulation(road, camera=None, vehicle=STRAIGHT)
    previous = 0.0
    while not simulation.terminated[0]:
        simulation.step([[0.0, 4.0]])
        assert simulation.column("progress")[0] >= previous
        previous = simulation.column("progress")[0]
    assert status(simulation) == "lap_complete"
    assert simulation.column("progress")[0] == 1.0  # exactly, at the end of an open road
    assert simulation.column("lap")[0] == 1
    pose = simulation.vehicles.copy()
    simulation.step([[0.0, 4.0]])
    assert (simulation.vehicles == pose).all()  # a car that has ended stands until it is reset
    assert not simulation.truncated[0]


def drive_along(simulation: Simulation, env: int, fractions: np.ndarray) -> list[dict[str, float]]:
    """Put a car at each of the places in turn and judge it there."""
    rows = []
    for fraction in fractions:
        simulation.place(env, float(fraction) * OVAL.length)
        simulation.step(np.zeros((simulation.num_envs, 2)))
        rows.append(dict(zip(ROW_COLUMNS, simulation.rows[env].tolist(), strict=True)))
    return rows


@pytest.mark.parametrize("laps", [1, 3])
def test_laps_flow_into_each_other(laps):
    simulation = Simulation(OVAL, camera=None, laps=laps, start=FIXED)
    rows = drive_along(simulation, 0, np.arange(1, laps * 50) / 50)
    completed = [STATUS_NAMES[int(row["status"])] == "lap_complete" for row in rows]
    ahead = 0.14 / OVAL.length  # the point that progress speaks of
    for i, row in enumerate(rows, start=1):
        done = (i / 50 + ahead) // 1.0
        assert row["lap"] == done
        assert row["progress"] == pytest.approx(i / 50 + ahead - max(0, done - completed[i - 1]), abs=2e-3)
    assert sum(completed) == laps - 1
    drive_along(simulation, 0, np.array([laps + 0.001]))
    assert simulation.terminated[0]
    assert simulation.column("lap")[0] == laps


def test_a_car_is_off_track_only_when_no_wheel_is_on_it(road, status):
    simulation = Simulation(road, camera=None)
    for offset, all_on, off in [
        (0.41, 1, 0),
        (0.43, 0, 0),
        (0.57, 0, 0),
        (0.585, 0, 1),
        (-0.41, 1, 0),
        (-0.57, 0, 0),
        (-0.585, 0, 1),
    ]:
        simulation.set_pose(0, 5.0, offset, 0.0)
        simulation.step([[0.0, 1.0]])
        row = dict(zip(ROW_COLUMNS, simulation.rows[0].tolist(), strict=True))
        assert (row["all_wheels_on_track"], row["is_offtrack"]) == (all_on, off)
        assert row["offset"] == pytest.approx(offset, abs=1e-6)
        assert simulation.terminated[0] == bool(off)
        assert status(simulation) == ("off_track" if off else "in_progress")


def test_standing_ends_an_episode_after_fifteen_still_steps(status):
    simulation = Simulation(OVAL, camera=None, start=FIXED)
    for step in range(1, 16):
        assert not simulation.terminated[0]
        simulation.step([[0.3, 0.0]])
        assert simulation.column("steps")[0] == step + 1
    assert simulation.terminated[0]
    assert status(simulation) == "immobilized"


def test_a_crawling_car_is_not_immobilized(status):
    simulation = Simulation(OVAL, camera=None, start=FIXED)
    for _ in range(60):
        simulation.step([[0.0, 0.1]])
    assert status(simulation) == "in_progress"


def test_driving_back_ends_an_episode_after_fifteen_falling_steps(road, status):
    simulation = Simulation(road, camera=None, vehicle=STRAIGHT)
    simulation.set_pose(0, 10.0, 0.0, math.pi, speed=2.0)
    simulation.step([[0.0, 2.0]])  # the jump to 10 m is progress
    assert simulation.column("progress")[0] > 0.2
    for _ in range(14):
        simulation.step([[0.0, 2.0]])
        assert not simulation.terminated[0]
    simulation.step([[0.0, 2.0]])
    assert simulation.terminated[0]
    assert status(simulation) == "reversed"


def test_a_car_put_elsewhere_has_neither_stood_nor_driven_back(road, status):
    simulation = Simulation(road, num_envs=2, camera=None, vehicle=STRAIGHT)
    simulation.set_pose(0, 20.0, 0.0, math.pi, speed=2.0)
    simulation.set_pose(1, 20.0, 0.0, 0.0)
    commands = [[0.0, 2.0], [0.0, 0.0]]
    for _ in range(14):  # the first of the standing car is a movement
        simulation.step(commands)
    for at in (15.0, 10.0):  # farther back, so that the jump itself is one more falling step
        simulation.set_pose(0, at, 0.0, math.pi, speed=2.0)
        simulation.set_pose(1, at, 0.0, 0.0)
        for _ in range(14):
            simulation.step(commands)
            assert [status(simulation, env) for env in range(2)] == ["in_progress"] * 2
    simulation.step(commands)
    assert [status(simulation, env) for env in range(2)] == ["reversed", "immobilized"]


def test_limits_truncate_and_the_last_action_still_acts(status):
    simulation = Simulation(OVAL, camera=None, vehicle=STRAIGHT, time_limit=2.0)
    while not simulation.truncated[0]:
        simulation.step([[0.0, 0.5]])
    assert simulation.column("steps")[0] == 30
    assert status(simulation) == "time_up"
    assert not simulation.terminated[0]

    simulation = Simulation(OVAL, camera=None, max_steps=7)
    for _ in range(6):
        pose = simulation.vehicles.copy()
        simulation.step([[0.0, 1.0]])
    assert simulation.truncated[0]
    assert simulation.column("steps")[0] == 7
    assert (simulation.vehicles != pose).any()
    pose = simulation.vehicles.copy()
    simulation.step([[0.0, 1.0]])
    assert (simulation.vehicles == pose).all()


@pytest.mark.parametrize(
    ("time_limit", "expected"), [(0.0, "lap_complete"), (5 / 15, "time_up"), (6 / 15, "lap_complete")]
)
def test_time_up_goes_before_lap_complete(status, time_limit, expected):
    simulation = Simulation(OVAL, camera=None, start=FIXED, time_limit=time_limit)
    for fraction in (0.3, 0.6, 0.9, 1.01):  # steps 2 to 5
        simulation.place(0, fraction * OVAL.length)
        simulation.step([[0.0, 0.0]])
    assert simulation.column("progress")[0] > 1.0
    assert status(simulation) == expected
    assert simulation.truncated[0] == (expected == "time_up")
    assert simulation.terminated[0] == (expected == "lap_complete")
    assert simulation.column("lap")[0] == (expected == "lap_complete")


# --- penalties and places


def test_a_frozen_car_stands_and_then_goes_on(status):
    simulation = Simulation(OVAL, num_envs=2, camera=None, start=FIXED)
    for _ in range(10):
        simulation.step([[0.0, 1.0]] * 2)
    simulation.freeze(0, 20)
    pose = simulation.vehicles[:, 0].copy()
    for _ in range(20):
        simulation.step([[0.0, 1.0]] * 2)
        assert status(simulation) == "pause"
        assert (simulation.vehicles[:, 0] == pose).all()
    assert status(simulation, 1) == "in_progress"
    simulation.step([[0.0, 1.0]] * 2)
    assert status(simulation) == "in_progress"
    assert simulation.column("steps").tolist() == [32, 32]
    assert simulation.vehicles[0, 0] != pose[0]


def test_a_placed_car_is_seen_at_once_and_may_go_on_after_its_end():
    simulation = Simulation(OVAL, num_envs=2, start=FIXED)
    frame = simulation.frames[0].copy()
    simulation.set_pose(0, 100.0, 100.0, 0.0)
    simulation.step(np.zeros((2, 2)))
    assert simulation.terminated[0]
    simulation.place(0, 3.0, offset=0.1, speed=1.5)
    assert not simulation.terminated[0]
    assert (simulation.frames[0] != frame).any()
    assert simulation.state[0, 0] == pytest.approx(1.5 / 4.0)
    assert simulation.vehicles[3, 0] == 1.5
    assert OVAL.project(simulation.vehicles[:2, 0])[1] == pytest.approx(0.1, abs=2e-3)
    before = simulation.vehicles[:, 1].copy()
    simulation.place(0, 5.0)
    assert (simulation.vehicles[:, 1] == before).all()


def test_the_mask_of_a_reset_may_be_what_it_clears():
    simulation = Simulation(OVAL, num_envs=3, camera=None, start=FIXED)
    while not simulation.terminated.all():
        simulation.step(np.tile(np.float32([0.5, 2.0]), (3, 1)))
    simulation.reset(simulation.terminated)
    assert not simulation.terminated.any()
    assert simulation.column("episode").tolist() == [1.0, 1.0, 1.0]


def test_a_column_that_does_not_exist_is_told_with_the_nearest_that_does():
    simulation = Simulation(OVAL, num_envs=1, camera=None)
    with pytest.raises(ConfigError, match="There is no column 'progres'; allowed are episode, steps, x") as told:
        simulation.column("progres")
    assert told.value.hint == "Did you mean 'progress'?"
