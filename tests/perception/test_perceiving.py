"""How well perception sees: a car's own pictures, and roads of the simulator that it never learned from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from unseen_roads import unseen_roads

from racecraft.errors import ShapeError
from racecraft.perceiving import PerceptionDriver, perceive
from racecraft.perception import Belief, Perceiver
from racecraft.perception.answers import NUM_CONTINUOUS, NUM_TARGETS, NUMBERS, ROWS
from racecraft.perception.network import of_one_brightness
from racecraft.perception.truth import Truth
from racecraft.perception.worlds import Episodes, World
from racecraft.race.autopilot import Autopilot

pytestmark = pytest.mark.costly

FLOOR = Path(__file__).parents[3] / "shared" / "frames" / "car"
TOLD = (60, 75, 90, 105)
AHEAD = list(NUMBERS).index("heading_ahead")


@pytest.fixture(scope="module")
def perceiver() -> Perceiver:
    return Perceiver(num_threads=2)


def dashes(picture: NDArray[np.uint8]) -> dict[int, float]:
    """Columns of yellow dashes in some rows, found by their colour alone, where there is one."""
    red, _, blue = picture.astype(int).transpose(2, 0, 1)
    is_yellow = (red > 150) & (red - blue > 35)
    found = {}
    for row in TOLD:
        columns = np.nonzero(is_yellow[row - 1 : row + 2])[1]
        if len(columns) >= 4 and np.ptp(columns) < 22:
            found[row] = float(columns.mean())
    return found


@pytest.mark.skipif(not FLOOR.is_dir(), reason="the pictures of a car on the floor are not there: ../shared/frames/car")
def test_the_middle_of_a_real_road(perceiver: Perceiver) -> None:
    told = perceive([FLOOR], perceiver=perceiver)
    assert [Path(one["file"]).name for one in told] == sorted(path.name for path in FLOOR.glob("*.jpg"))
    off, is_seen = [], []
    for one in told:
        yellow = dashes(np.asarray(Image.open(one["file"]).convert("RGB")))
        for place, row in enumerate(TOLD):
            column = one["middle"][place]
            if row in yellow:
                is_seen.append(column is not None)
                if column is not None:
                    off.append(abs(column - yellow[row]))
    assert len(is_seen) > 180
    assert np.mean(is_seen) > 0.97
    assert np.median(off) <= 4.0
    assert np.percentile(off, 90) <= 10.0


@pytest.fixture(scope="module")
def unseen(perceiver: Perceiver) -> tuple[Belief, NDArray[np.float32]]:
    """Roads that were never learned from, driven by what is seen under strong conditions; belief and truth."""
    simulation = unseen_roads()
    truth, driver = Truth(simulation), PerceptionDriver(perceiver, autopilot=Autopilot(speed=1.5))
    frames, targets = [], []
    for step in range(80):
        simulation.step(driver(simulation.frames))
        begins = simulation.terminated | simulation.truncated
        simulation.reset(begins)
        driver.forget(begins)
        if step % 5 == 0:
            frames.append(simulation.frames.copy())
            targets.append(truth.targets())
    return perceiver(np.concatenate(frames)), np.concatenate(targets)


@pytest.mark.costly
def test_offset_and_heading_on_roads_never_seen(unseen: tuple[Belief, NDArray[np.float32]]) -> None:
    belief, truth = unseen
    offset = np.abs(belief.offset - truth[:, 0] * NUMBERS["offset"])
    heading = np.abs(belief.heading - truth[:, 1] * NUMBERS["heading"])
    ahead = np.abs(belief.heading_ahead - truth[:, AHEAD] * NUMBERS["heading_ahead"])
    assert np.percentile(offset, 90) <= 0.02
    # 2 degrees were hoped for: what of a road lies under the lens and behind it no single picture shows, and the best
    # of eyes err by 3.5 (benchmarks/perception_limit.py); where it leads to from there, more of it does
    assert np.degrees(np.median(heading)) <= 1.8
    assert np.degrees(np.percentile(heading, 90)) <= 5.3
    assert np.degrees(np.median(ahead)) <= 1.0
    assert np.degrees(np.percentile(ahead, 90)) <= 2.7


def test_it_knows_how_far_off_it_may_be(unseen: tuple[Belief, NDArray[np.float32]]) -> None:
    belief, truth = unseen
    for name, told, expected in (
        ("offset", belief.offset, belief.offset_error),
        ("heading", belief.heading, belief.heading_error),
        ("heading_ahead", belief.heading_ahead, belief.heading_ahead_error),
    ):
        error = np.abs(told - truth[:, list(NUMBERS).index(name)] * NUMBERS[name])
        assert 0.6 < expected.mean() / error.mean() < 1.7, name
        surest = expected < np.median(expected)
        assert error[surest].mean() < 0.8 * error[~surest].mean(), name


def test_regions_and_rows_on_roads_never_seen(unseen: tuple[Belief, NDArray[np.float32]]) -> None:
    belief, truth = unseen
    rows = len(ROWS)
    is_there = truth[:, NUM_CONTINUOUS : NUM_CONTINUOUS + rows] > 0.5
    assert ((belief.is_middle > 0.5) == is_there).mean() > 0.97
    regions = truth[:, NUM_CONTINUOUS + rows : NUM_TARGETS - 1] > 0.5
    assert ((belief.regions.reshape(len(truth), -1) > 0.5) == regions).mean() > 0.97
    assert ((belief.on_road > 0.5) == (truth[:, -1] > 0.5)).mean() > 0.95


def test_what_stands_in_the_way(perceiver: Perceiver) -> None:
    boxed = World(["lakeside"], Episodes(lateral=0.1, turned=0.1), num_envs=64, seed=4, randomize="real", objects=8)
    looks = []
    for _ in range(8):
        frames, targets = boxed.look()
        looks.append((frames.copy(), targets))
    belief = perceiver(np.concatenate([frames for frames, _ in looks]))
    truth = np.concatenate([targets for _, targets in looks])[:, list(NUMBERS).index("closeness")] * 0.5
    near, far = truth > 1 / (1 + 0.8), truth < 1 / (1 + 3.0)
    assert near.sum() > 20
    assert far.sum() > 20
    assert np.median(belief.closeness[near]) > np.median(belief.closeness[far]) + 0.2


def test_light_and_threads_change_nothing(perceiver: Perceiver) -> None:
    rng = np.random.default_rng(2)
    frames = rng.integers(40, 120, (5, 120, 160)).astype(np.uint8)
    belief, again = perceiver(frames), Perceiver(num_threads=1)(frames)
    assert (belief.middle == again.middle).all()
    single = np.concatenate([perceiver(frame[None]).offset for frame in frames])
    assert (belief.offset == single).all()
    assert np.abs(of_one_brightness(frames).astype(int) - of_one_brightness(frames + 50)).max() <= 1
    assert (of_one_brightness(np.full((1, 4, 4), 9, np.uint8)) == 112).all()


def test_pictures_of_another_shape_are_refused(perceiver: Perceiver) -> None:
    with pytest.raises(ShapeError):
        perceiver(np.zeros((2, 60, 80), np.uint8))
