"""`racecraft evaluate --as car`: the car's pictures, choices and commands, and what is written of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from test_export import trained

from racecraft import load_track
from racecraft.agent import ActionSpace, DiscreteActionSpace
from racecraft.agent.sensor_suite import SensorSuite
from racecraft.car import evaluation
from racecraft.car.calibration import CarCalibration
from racecraft.car.command import Floats
from racecraft.car.driving import CAR_CAMERA, CarPolicy, car_picture
from racecraft.car.evaluation import evaluate_as_car
from racecraft.car.picture import DOT, FINE, LEFTS, PANEL, TOP, draw_commands
from racecraft.errors import ConfigError
from racecraft.race import load_driver
from racecraft.replay import read_replay, verify
from racecraft.run import read_simtrace
from racecraft.sim import Randomization, Simulation
from racecraft.sim.camera import CAMERAS as CAMERAS_BY_NAME
from racecraft.sim.columns import ROW_COLUMNS

MEASURED = CarCalibration(left_degrees=24.0, right_degrees=18.0, speeds=((20.0, 0.5), (60.0, 2.5)), slider_percent=40.0)


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return trained(tmp_path_factory.mktemp("runs"), name="floor")


def bilinear(picture: np.ndarray) -> np.ndarray:
    """A quarter of a picture's size without smoothing, pixel by pixel."""
    small = np.empty((120, 160))
    for row in range(120):
        for column in range(160):
            y, x = (row + 0.5) * 4 - 0.5, (column + 0.5) * 4 - 0.5
            top, left = int(y), int(x)
            down, right = y - top, x - left
            upper = picture[top, left] * (1 - right) + picture[top, left + 1] * right
            lower = picture[top + 1, left] * (1 - right) + picture[top + 1, left + 1] * right
            small[row, column] = upper * (1 - down) + lower * down
    return np.floor(small + 0.5).astype(np.uint8)


def test_pictures_are_made_smaller_as_the_car_s_software_does() -> None:
    pictures = np.random.default_rng(1).integers(0, 256, (2, 3, 480, 640), np.uint8)
    small = car_picture(pictures)
    assert small.shape == (2, 3, 120, 160)
    assert np.array_equal(small[1, 2], bilinear(pictures[1, 2]))
    assert (car_picture(np.full((1, 480, 640), 255, np.uint8)) == 255).all()


def test_what_the_simulator_s_camera_sees_is_nearly_what_the_policy_was_trained_on() -> None:
    cars = {scale: Simulation(load_track("oval"), num_envs=4, camera=camera) for scale, camera in CAMERAS.items()}
    for simulation in cars.values():
        simulation.reset()
    difference = car_picture(cars["car"].frames).astype(int) - cars["trained"].frames
    assert np.abs(difference).mean() < 4  # of 255: edges without smoothing
    assert (difference != 0).any()


CAMERAS = {"car": CAR_CAMERA, "trained": SensorSuite().camera()}


def test_the_choice_is_the_policy_s_own_on_the_smaller_picture(run: Path) -> None:
    policy = load_driver(run)
    car = CarPolicy(policy, CarCalibration())
    frames = np.random.default_rng(2).integers(0, 256, (6, 480, 640), np.uint8)
    meant, resulting = policy(car_picture(frames)), car(frames)
    np.testing.assert_allclose(car.chosen[0], meant, atol=1e-6)
    np.testing.assert_allclose(resulting[:, 0], meant[:, 0], atol=1e-6)
    np.testing.assert_allclose(resulting[:, 1], np.where(meant[:, 1] == 1.0, 1.6, 2.0), atol=1e-6)


@pytest.mark.parametrize("options", [{"actions": "continuous"}, {"sensors": ("STEREO_CAMERAS", "LIDAR")}], ids=str)
def test_other_actions_and_sensors_drive_as_well(options: dict[str, object], tmp_path: Path) -> None:
    run = trained(tmp_path, name="other", **options)
    policy = load_driver(run)
    suite, rng = policy.sensors, np.random.default_rng(3)
    large = rng.integers(0, 256, (3, suite.lenses, 480, 640), np.uint8)
    lidar = rng.integers(0, 256, (3, suite.lidar_size), np.uint8)
    small = car_picture(large)
    if suite.lidar_name:
        seen, sight = (np.concatenate([a.reshape(3, -1), lidar], axis=1) for a in (large, small))
    else:
        seen, sight = large[:, 0], small[:, 0]
    car = CarPolicy(policy, CarCalibration())
    car(seen)
    np.testing.assert_allclose(car.chosen[0], policy(sight), atol=1e-6)


@pytest.mark.costly
def test_the_evaluation_drives_what_the_car_makes_of_it_and_says_so(run: Path) -> None:
    outcome = evaluate_as_car(run, car=MEASURED, laps=1, num_trials=2, max_resets=1, video=False, num_threads=1)
    (steering, speed) = (ROW_COLUMNS.index(name) for name in ("steering_angle", "speed"))
    rows = np.concatenate([trial.recording.rows for trial in outcome.evaluation.trials])
    rows = rows[rows[:, speed] > 0]
    half = 0.5 + 2.0 * (0.4 * 0.8 - 0.2) / 0.4
    assert set(np.round(rows[:, speed], 4).tolist()) <= {round(half, 4), 1.5}
    assert set(np.round(np.degrees(rows[:, steering]), 3).tolist()) <= {-18.0, -9.0, 0.0, 12.0, 24.0}
    document = json.loads(outcome.files["summary"].read_text())
    assert document["as_car"]["left_degrees"] == 24.0
    assert document["as_car"]["slider_driven_percent"] == 40.0
    assert outcome.to_dict()["as_car"] == {**document["as_car"], "speeds": ((20.0, 0.5), (60.0, 2.5))}
    assert outcome.files["as a car"].name == "as-car.png"
    with Image.open(outcome.files["as a car"]) as picture:
        assert picture.size == (1200, 640)
    assert not list(run.glob("*.tar.gz"))
    trace = read_simtrace(outcome.files["sim-trace"])
    driven = trace["episode_status"] == "in_progress"
    table = [(angle, speed) for angle in (-18.0, -9.0, 0.0, 12.0, 24.0) for speed in (1.1, 1.5)]
    pairs = zip(trace["steer"][driven].tolist(), trace["throttle"][driven].tolist(), strict=True)
    assert list(pairs) == [pytest.approx(table[action], abs=1e-9) for action in trace["action"][driven].tolist()]
    assert verify(read_replay(outcome.files["replay"])).is_genuine


@pytest.mark.costly
def test_of_a_car_that_is_faster_than_the_simulator_the_picture_shows_what_was_driven(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[float, str]] = []

    def draw(chosen: Floats, resulting: Floats, space: ActionSpace, path: Path, *, note: str) -> Path:
        drawn.append((resulting[:, 1].max(), note))
        return draw_commands(chosen, resulting, space, path, note=note)

    monkeypatch.setattr(evaluation, "draw_commands", draw)
    fast = CarCalibration(speeds=((60.0, 8.0),), slider_percent=60.0)
    outcome = evaluate_as_car(run, car=fast, laps=1, num_trials=1, max_resets=0, video=False, num_threads=1)
    (trial,) = outcome.evaluation.trials
    assert trial.recording.column("speed").max() == 4.0
    assert drawn == [(4.0, "the simulator drives 4 m/s at most")]
    evaluate_as_car(run, car=MEASURED, laps=1, num_trials=1, max_resets=0, video=False, num_threads=1)
    assert drawn[1] == (pytest.approx(1.5), "")


@pytest.mark.costly
def test_the_camera_has_the_look_that_the_run_was_trained_with(tmp_path: Path) -> None:
    run = trained(tmp_path, name="later", camera="2026")
    outcome = evaluate_as_car(run, laps=1, num_trials=1, max_resets=0, video=False, num_threads=1)
    assert outcome.evaluation.conditions.camera == replace(CAMERAS_BY_NAME["2026"], width=640, height=480)


@pytest.mark.costly
def test_latency_is_the_randomisation_s(run: Path, tmp_path: Path) -> None:
    car = tmp_path / "car.json"
    CarCalibration(latency_seconds=0.05, slider_percent=33.333).save(car)
    outcome = evaluate_as_car(run, car=car, laps=1, num_trials=1, max_resets=0, video=False, num_threads=1)
    assert outcome.evaluation.conditions.randomize.latency == pytest.approx((0.75, 0.75))
    assert json.loads(outcome.files["summary"].read_text())["as_car"]["slider_driven_percent"] == 33.3
    with pytest.raises(ConfigError, match="has a latency, and so has the randomisation"):
        evaluate_as_car(run, car=car, randomize=Randomization(latency=(0.5, 0.5)), video=False)
    with pytest.raises(ConfigError, match="car is None; use 'car' or a file's path"):
        evaluate_as_car(run, car=None, video=False)  # type: ignore[arg-type]


def test_a_dot_lies_where_the_command_and_what_came_of_it_say(tmp_path: Path) -> None:
    space = DiscreteActionSpace.from_aws([{"steering_angle": a, "speed": s} for a, s in ((-30, 1), (30, 2))])
    chosen = np.array([[np.radians(30), 2.0]])
    path = draw_commands(chosen, np.array([[np.radians(-10), 0.5]]), space, tmp_path / "as-car.png")
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    for left, x, y in ((LEFTS[0], 1.0, (-10 + 30) / 60), (LEFTS[1], 1.0, 0.25)):
        row, column = round(TOP + PANEL * (1 - y)), round(left + PANEL * x)
        assert np.abs(pixels[row, column] - DOT).max() < 10
    assert FINE > 1
    assert (np.abs(pixels - np.array(DOT)).max(axis=2) < 10).sum() < 4000  # two dots and no more
