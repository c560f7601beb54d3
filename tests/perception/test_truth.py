"""What perception is told was in a picture, held against the picture itself and against a plain projection."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from racecraft.perception.answers import (
    HALF,
    IN_SIGHT,
    MIDDLES,
    NUM_CONTINUOUS,
    NUMBERS,
    PLACES,
    REGION_COLUMNS,
    REGION_ROWS,
    ROWS,
)
from racecraft.perception.truth import Truth
from racecraft.perception.worlds import Episodes, World
from racecraft.sim import STATE_COLUMNS, Simulation, Start
from racecraft.track import load_track

AHEAD = PLACES["heading_ahead"]


def columns_of(targets: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Columns of the road's middle, and whether they are in the picture  (N, R)."""
    return targets[:, MIDDLES] * np.float32(HALF) + np.float32(HALF - 0.5), targets[:, IN_SIGHT] > 0.5


@pytest.fixture(scope="module")
def strong() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Pictures under strong randomisation, and the truth of them."""
    episodes = Episodes(lateral=0.1, turned=0.15)
    world = World(["reinvent_2018", "delta"], episodes, num_envs=64, seed=5, randomize="strong")
    looks = [(frames.copy(), targets) for frames, targets in (world.look() for _ in range(12))]
    return np.concatenate([frames for frames, _ in looks]), np.concatenate([targets for _, targets in looks])


def test_dashes_are_where_the_middle_is_said_to_be(strong: tuple[NDArray[np.uint8], NDArray[np.float32]]) -> None:
    frames, targets = strong
    columns, is_there = columns_of(targets)
    for place, row in enumerate(ROWS):
        if not 60 <= row <= 90:  # further away a dash is a pixel wide, nearer it seldom lies whole in the picture
            continue
        which = np.flatnonzero(is_there[:, place] & (np.abs(columns[:, place] - 79.5) < 60.0))
        around = np.arange(-12, 13)
        strips = frames[which[:, None], row, np.rint(columns[which, place]).astype(int)[:, None] + around].astype(float)
        is_dash = strips > np.median(strips, axis=1, keepdims=True) + 25.0
        is_dash = is_dash[(is_dash.sum(axis=1) > 0) & (is_dash.sum(axis=1) < 12)]
        middles = (is_dash * around).sum(axis=1) / is_dash.sum(axis=1)
        assert len(middles) > 20
        assert abs(np.median(middles)) < 0.6, row
        assert np.percentile(np.abs(middles), 80) < 2.0, row


@pytest.fixture(scope="module")
def straight() -> Simulation:
    """Cars on a straight road."""
    return Simulation(
        [load_track("straight")],
        num_envs=64,
        seed=3,
        start=Start(mode="random", lateral_jitter=0.2, heading_jitter=0.3),
        num_threads=1,
    )


def test_a_straight_road_is_projected_as_a_pinhole_does(straight: Simulation) -> None:
    simulation = straight
    targets = Truth(simulation).targets()
    camera = simulation.camera
    assert camera is not None
    track = simulation.tracks[0]
    begin, end = (np.asarray(track.point_at(at), float).ravel() for at in (2.0, 12.0))
    along = (end - begin) / np.linalg.norm(end - begin)
    x, y, heading = (simulation.vehicles[i].astype(float) for i in range(3))
    looks = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    lens = np.stack([x, y], axis=1) + camera.forward * looks
    off = lens - begin
    offset = along[0] * off[:, 1] - along[1] * off[:, 0]
    turned = np.arctan2(along[0] * looks[:, 1] - along[1] * looks[:, 0], looks @ along)
    assert np.abs(offset).max() > 0.15
    assert targets[:, 0] * NUMBERS["offset"] == pytest.approx(offset, abs=2e-4)
    assert targets[:, 1] * NUMBERS["heading"] == pytest.approx(turned, abs=2e-4)
    assert targets[:, AHEAD] * NUMBERS["heading_ahead"] == pytest.approx(turned, abs=2e-4)

    columns, is_there = columns_of(targets)
    ahead = np.linspace(0.0, 1.5, 3001)
    for car in range(64):
        if off[car] @ along > 6.0:
            continue  # the road ends within sight
        points = lens[car] - offset[car] * np.array([-along[1], along[0]]) + ahead[:, None] * along
        seen = points - lens[car]
        deep, right = seen @ looks[car], seen @ np.array([looks[car, 1], -looks[car, 0]])
        depth = deep * np.cos(camera.pitch) + camera.above_ground * np.sin(camera.pitch)
        down = camera.above_ground * np.cos(camera.pitch) - deep * np.sin(camera.pitch)
        focal = HALF / np.tan(0.5 * camera.horizontal_fov)
        is_before = depth > 0.1
        row, column = ((59.5 + focal * down / depth)[is_before], (79.5 + focal * right / depth)[is_before])
        for place, wanted in enumerate(ROWS):
            if row.min() < wanted < row.max():
                expected = float(np.interp(-wanted, -row, column))
                assert bool(is_there[car, place]) == (abs(expected - 79.5) < HALF)
                if is_there[car, place]:
                    assert columns[car, place] == pytest.approx(expected, abs=0.2)


def test_regions_are_where_rays_meet_the_road(straight: Simulation) -> None:
    targets, camera, track = Truth(straight).targets(), straight.camera, straight.tracks[0]
    assert camera is not None
    begin, end = (np.asarray(track.point_at(at), float).ravel() for at in (2.0, 12.0))
    along = (end - begin) / np.linalg.norm(end - begin)
    half_width = straight.state[0, STATE_COLUMNS.index("half_width")]
    x, y, heading = (straight.vehicles[i].astype(float) for i in range(3))
    focal = HALF / np.tan(0.5 * camera.horizontal_fov)
    first = NUM_CONTINUOUS + len(ROWS)
    told = targets[:, first:-1].reshape(-1, len(REGION_ROWS), len(REGION_COLUMNS)) > 0.5
    seen = []
    for car in range(64):
        ahead, right = (
            np.array([np.cos(heading[car]), np.sin(heading[car])]),
            np.array([np.sin(heading[car]), -np.cos(heading[car])]),
        )
        for line, row in enumerate(REGION_ROWS):
            for place, column in enumerate(REGION_COLUMNS):
                down, aside = (row - 59.5) / focal, (column - 79.5) / focal
                forward = np.cos(camera.pitch) - down * np.sin(camera.pitch)
                fall = np.sin(camera.pitch) + down * np.cos(camera.pitch)
                if fall < 0.02 or camera.above_ground / fall * forward > 3.0:
                    continue
                hit = np.array([x[car], y[car]]) + camera.forward * ahead
                hit = hit + camera.above_ground / fall * (forward * ahead + aside * right) - begin
                lateral = abs(along[0] * hit[1] - along[1] * hit[0])
                if hit @ along < 9.0 and abs(lateral - half_width) > 0.03:
                    assert told[car, line, place] == (lateral < half_width)
                    seen.append(lateral < half_width)
    assert 0.3 < np.mean(seen) < 0.95


def test_a_lens_in_its_place_is_the_point_that_the_state_speaks_of() -> None:
    simulation = Simulation(
        [load_track("delta")],
        num_envs=128,
        seed=3,
        start=Start(mode="random", lateral_jitter=0.2, heading_jitter=0.3),
        num_threads=1,
    )
    targets, state = Truth(simulation).targets(), dict(zip(STATE_COLUMNS, simulation.state.T, strict=True))
    assert targets[:, 0] * NUMBERS["offset"] == pytest.approx(state["offset"] * state["half_width"], abs=0.01)
    heading = np.arctan2(state["sin_heading_error"], state["cos_heading_error"])
    assert targets[:, 1] * NUMBERS["heading"] == pytest.approx(heading, abs=0.12)
    assert np.median(np.abs(targets[:, 1] * NUMBERS["heading"] - heading)) < 0.02
    assert targets[:, 3] == pytest.approx(state["curvature_2"], abs=1e-3)


def test_where_a_road_leads_is_half_of_its_bend_over_40_cm_further_on() -> None:
    track = load_track("oval")
    simulation = Simulation(
        [track], num_envs=128, seed=4, start=Start(mode="random", heading_jitter=0.3), num_threads=1
    )
    targets, state = Truth(simulation).targets(), dict(zip(STATE_COLUMNS, simulation.state.T, strict=True))
    # where it bends alike from 0.2 m behind the lens, whose direction the first one is told over, to 0.5 m ahead
    bends = np.stack([state[f"curvature_{i}"] for i in range(3)])
    is_even = (np.ptp(bends, axis=0) < 0.02) & (np.abs(bends[0]) > 0.2)
    assert is_even.sum() > 15
    turned = targets[:, 1] * NUMBERS["heading"] - targets[:, AHEAD] * NUMBERS["heading_ahead"]
    ahead = 0.2 * state["curvature_1"]
    close = np.abs(turned - ahead)[is_even] < 0.03
    assert close.mean() > 0.8
    assert np.abs(ahead[is_even]).min() > 0.04
