"""A car's file: made from measured numbers, read back, and what is wrong in one is told in a sentence."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.agent import DiscreteActionSpace
from racecraft.car.calibration import MAX_POINTS, CarCalibration, calibrate, load_calibration
from racecraft.errors import ConfigError, RacecraftError

MEASURED = CarCalibration(
    left_degrees=24.0, right_degrees=18.0, speeds=((20.0, 0.5), (60.0, 2.5)), slider_percent=40.0, latency_seconds=0.05
)


def table(*actions: tuple[float, float]) -> DiscreteActionSpace:
    return DiscreteActionSpace.from_aws([{"steering_angle": angle, "speed": speed} for angle, speed in actions])


def test_a_turning_circle_says_how_far_the_wheels_turn() -> None:
    left, right = 2 * 0.164 / math.tan(math.radians(20)), 2 * 0.164 / math.tan(math.radians(25))
    car = calibrate(circles=(left, right))
    assert (car.left_degrees, car.right_degrees) == (20.0, 25.0)
    assert calibrate(circles=(left, None)).right_degrees == 30.0


@pytest.mark.parametrize(
    ("servo", "degrees"),
    [
        ([1.70, 1.45, 1.20], (30, 30)),
        ([1.20, 1.45, 1.70], (30, 30)),
        ([1.60, 1.45, 1.25], (18, 24)),
        ([1.25, 1.40, 1.65], (18, 30)),
    ],
)
def test_without_a_circle_the_pulse_widths_do(servo: list[float], degrees: tuple[float, float]) -> None:
    car = calibrate(servo=servo)
    assert (car.left_degrees, car.right_degrees) == pytest.approx(degrees)


def test_a_circle_counts_more_than_a_pulse_width() -> None:
    car = calibrate(servo=[1.60, 1.45, 1.25], circles=(None, 2 * 0.164 / math.tan(math.radians(10))))
    assert (car.left_degrees, car.right_degrees) == (18.0, 10.0)


def test_speeds_run_straight_between_what_was_measured() -> None:
    share = np.array([0.0, 0.1, 0.2, 0.4, 0.6, 0.9])
    np.testing.assert_allclose(MEASURED.speed(share, 4.0), [0, 0.25, 0.5, 1.5, 2.5, 3.75])
    np.testing.assert_allclose(CarCalibration().speed(share, 4.0), 4 * share)


def test_as_many_speeds_may_be_measured_as_the_limit_says() -> None:
    points = [(float(position), 0.1 * position) for position in range(1, MAX_POINTS + 2)]
    assert calibrate(speeds=points[:-1]).speeds == tuple(points[:-1])
    with pytest.raises(ConfigError, match=f"at most {MAX_POINTS} pairs"):
        calibrate(speeds=points)


def test_the_slider_stands_where_the_largest_speed_is_driven() -> None:
    car = CarCalibration(speeds=((20.0, 0.5), (60.0, 2.5)))
    for fastest, percent in ((0.25, 10.0), (0.5, 20.0), (1.5, 40.0), (2.5, 60.0), (3.0, 72.0), (4.0, 96.0)):
        space = table((-30, fastest / 2), (30, fastest))
        assert 100 * car.slider(space) == pytest.approx(percent)
        assert car.commands(np.array([[0.0, fastest]]), space)[0, 1] == pytest.approx(fastest)
    slow = CarCalibration(speeds=((50.0, 0.4),))
    assert slow.slider(table((-30, 1), (30, 2))) == 1.0
    assert slow.commands(np.array([[0.0, 2.0]]), table((-30, 1), (30, 2)))[0, 1] == pytest.approx(0.8)
    assert MEASURED.slider(table((-30, 1), (30, 2))) == 0.4
    assert CarCalibration().slider(table((-30, 1), (30, 2))) == 1.0


def test_commands_are_shares_of_this_car_s_lock_and_speed() -> None:
    space = table((-20, 1), (10, 2), (0, 1))
    resulting = MEASURED.commands(space.table, space)
    np.testing.assert_allclose(np.degrees(resulting[:, 0]), [-18, 12, 0], atol=1e-9)
    at_slider, at_half = 1.5, 0.5 + 2.0 * (0.4 * 0.8 - 0.2) / 0.4
    np.testing.assert_allclose(resulting[:, 1], [at_half, at_slider, at_half])
    unmeasured = CarCalibration().commands(space.table, space)
    np.testing.assert_allclose(np.degrees(unmeasured[:, 0]), [-30, 15, 0], atol=1e-9)
    np.testing.assert_allclose(unmeasured[:, 1], [1.6, 2.0, 1.6])


def test_no_speed_is_told_that_the_simulator_does_not_drive() -> None:
    fast = CarCalibration(speeds=((20.0, 2.0), (60.0, 8.0)), slider_percent=60.0)
    space = table((-30, 1), (30, 2), (0, 4))
    assert fast.fastest(space) == 8.0
    np.testing.assert_allclose(fast.commands(space.table, space)[:, 1], [3.275, 4.0, 4.0])
    slow = CarCalibration(speeds=((50.0, 0.05),), slider_percent=50.0)
    assert slow.fastest(space) == 0.05
    np.testing.assert_allclose(slow.commands(space.table, space)[:, 1], [0.1, 0.1, 0.1])
    assert MEASURED.fastest(space) == 1.5


def test_a_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    MEASURED.save(tmp_path / "car.json")
    assert load_calibration(tmp_path / "car.json") == MEASURED
    assert load_calibration("car") == CarCalibration()
    with pytest.raises(ConfigError, match=r"car\.json cannot be written"):
        MEASURED.save(tmp_path / "nowhere" / "car.json")
    with pytest.raises(ConfigError, match=r"car is 5; use 'car' or a file's path\."):
        load_calibration(5)  # type: ignore[arg-type]


WRONG_NUMBERS: dict[str, tuple[dict[str, Any], str]] = {
    "nothing": ({}, "Nothing was measured"),
    "a circle of a hand": ({"circles": (0.15, None)}, "A circle of 0.15 m to the left means wheels at"),
    "a tiny circle": ({"circles": (0.3, None)}, "A circle of 0.3 m to the left means wheels at"),
    "a huge circle": ({"circles": (None, 40.0)}, "A circle of 40 m to the right means wheels at 0.47"),
    "no circle": ({"circles": (0.0, None)}, "circle-left is 0.0"),
    "not a number": ({"circles": (math.nan, None)}, "circle-left is nan"),
    "two widths": ({"servo": [1.2, 1.7]}, "servo is [1.2, 1.7]; allowed is three pulse widths"),
    "straight is not between": ({"servo": [1.2, 1.7, 1.45]}, "straight between the others"),
    "equal widths": ({"servo": [1.45, 1.45, 1.45]}, "straight between the others"),
    "widths in nanoseconds": ({"servo": [1700000, 1450000, 1200000]}, "servo is 1700000; allowed is a number from 0.5"),
    "a wide pulse": ({"servo": [1.9, 1.45, 1.2]}, "The servo's pulse of 0.45 ms to the left means wheels at 54°"),
    "a slider of nothing": ({"speeds": [(0.0, 1.0)]}, "speeds: slider is 0.0"),
    "a speed of nothing": ({"speeds": [(50.0, 0.0)]}, "speeds: speed is 0.0"),
    "slower with more": ({"speeds": [(30.0, 1.0), (60.0, 0.9)]}, "both rising"),
    "one slider twice": ({"speeds": [(30.0, 1.0), (30.0, 1.1)]}, "both rising"),
    "a slider beyond": ({"slider": 101.0}, "slider_percent is 101.0; allowed is a number from 1 to 100"),
    "one circle": ({"circles": 0.75}, "circles is 0.75; allowed is two diameters in m"),
    "a single circle": ({"circles": (0.75,)}, "circles is (0.75,); allowed is two diameters in m"),
    "one width": ({"servo": 1.2}, "servo is 1.2; allowed is three pulse widths"),
    "widths in a text": ({"servo": "1.2,1.45,1.7"}, "servo is '1.2,1.45,1.7'; allowed is three pulse widths"),
    "a speed alone": ({"speeds": 0.7}, "speeds is 0.7; allowed is at most 20 pairs"),
    "speeds by their sliders": ({"speeds": {30: 0.7}}, "speeds is {30: 0.7}; allowed is at most 20 pairs"),
    "speeds of texts": ({"speeds": [("a", 1.0), (2.0, 3.0)]}, "speeds: slider is 'a'"),
    "a latency of a second": ({"latency": 1.0}, "latency_seconds is 1.0"),
}


@pytest.mark.parametrize(("numbers", "says"), WRONG_NUMBERS.values(), ids=WRONG_NUMBERS)
def test_a_number_that_cannot_be_is_one_sentence(numbers: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError) as caught:
        calibrate(**numbers)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


HOSTILE = {
    "no JSON": ("left_degrees: 20", "not valid JSON"),
    "a list": ("[]", "expected an object"),
    "another word": ('{"left_degree": 20}', "unknown parameter 'left_degree'"),
    "a text": ('{"left_degrees": "20"}', "left_degrees is '20'"),
    "true": ('{"left_degrees": true}', "left_degrees is True"),
    "infinity": ('{"latency_seconds": 1e999}', "1e999"),
    "twice": ('{"left_degrees": 20, "left_degrees": 21}', "left_degrees"),
    "speeds of texts": ('{"speeds": [["a", 1]]}', "speeds: slider is 'a'"),
    "speeds of one number": ('{"speeds": [1, 2]}', "pairs of slider"),
    "speeds of three": ('{"speeds": [[1, 2, 3]]}', "pairs of slider"),
    "speeds that are a text": ('{"speeds": "fast"}', "pairs of slider"),
    "many speeds": (json.dumps({"speeds": [[i, i / 10] for i in range(1, 30)]}), "at most 20 pairs"),
    "nested": ('{"speeds": ' + "[" * 25_000 + "]" * 25_000 + "}", "nested too deeply"),
    "large": (" " * 200_000 + "{}", "too large"),
}


@pytest.mark.parametrize(("text", "says"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_one_sentence(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "car.json"
    path.write_text(text)
    with pytest.raises(RacecraftError) as caught:
        load_calibration(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_told_with_what_would_be_understood(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is neither a preset \\(car\\) nor a file") as caught:
        load_calibration("cra")
    assert caught.value.hint == "Did you mean 'car'?"
