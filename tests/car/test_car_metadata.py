"""What a car is told of a model, and what is said of what it does otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.agent import ContinuousActionSpace, DiscreteActionSpace, ModelMetadata, action_space
from racecraft.agent.action_space import ActionSpace
from racecraft.car.calibration import CarCalibration
from racecraft.car.command import listed_choices, steering_share, throttle
from racecraft.car.metadata import car_metadata, car_notes
from racecraft.errors import ConfigError
from racecraft.learn import NetworkSpec

FRONT = ("FRONT_FACING_CAMERA",)


def of(
    space: ActionSpace, sensors: tuple[str, ...] = FRONT, *, is_squashed: bool = False
) -> tuple[ModelMetadata, NetworkSpec]:
    metadata = ModelMetadata(action_space=space, sensors=sensors)
    discrete = space.kind == "discrete"
    return metadata, NetworkSpec(num_actions=space.size, is_discrete=discrete, is_squashed=is_squashed)


def table(*actions: tuple[float, float]) -> DiscreteActionSpace:
    return DiscreteActionSpace.from_aws([{"steering_angle": angle, "speed": speed} for angle, speed in actions])


def continuous(right: float, left: float, slow: float, fast: float) -> ContinuousActionSpace:
    return ContinuousActionSpace([np.radians(right), slow], [np.radians(left), fast])


def test_the_car_reads_actions_in_degrees_and_no_more_than_it_needs() -> None:
    document = car_metadata(*of(table((-30, 1), (0, 2), (30, 1))))
    assert document == {
        "action_space": [
            {"steering_angle": -30.0, "speed": 1.0, "index": 0},
            {"steering_angle": 0.0, "speed": 2.0, "index": 1},
            {"steering_angle": 30.0, "speed": 1.0, "index": 2},
        ],
        "action_space_type": "discrete",
        "sensor": ["FRONT_FACING_CAMERA"],
        "training_algorithm": "clipped_ppo",
        "neural_network": "RACECRAFT_SMALL",
        "version": "5",
    }
    document = car_metadata(*of(continuous(-25, 27, 0.5, 3), is_squashed=True))
    assert document["training_algorithm"] == "sac"
    assert document["action_space_type"] == "continuous"
    assert document["action_space"]["steering_angle"] == {"low": -25.0, "high": 27.0}
    assert ModelMetadata.from_dict(document).action_space == continuous(-25, 27, 0.5, 3)


def test_a_car_is_told_of_old_files_what_the_simulator_drove() -> None:
    """Of ±45° and 12 m/s the car would make full lock and full throttle, and less than was learned of all others."""
    space = table((-45, 4), (-22.5, 12), (0, 8), (45, 1))
    told = ModelMetadata.from_dict(car_metadata(*of(space))).action_space
    assert told == table((-30, 4), (-22.5, 4), (0, 4), (30, 1))
    commands = CarCalibration().commands(listed_choices(told), told)
    np.testing.assert_allclose(np.degrees(commands[:, 0]), [-30, -22.5, 0, 30], atol=1e-12)
    np.testing.assert_allclose(commands[:, 1], [4, 4, 4, 1.9], atol=1e-12)


@pytest.mark.parametrize(("sensor", "distance", "sectors"), [("LIDAR", 1.0, 64), ("SECTOR_LIDAR", 0.5, 8)])
def test_a_lidar_comes_with_all_seven_keys(sensor: str, distance: float, sectors: int) -> None:
    metadata, spec = of(action_space("default"), (*FRONT, sensor))
    assert car_metadata(metadata, spec)["lidar_config"] == {
        "num_values": 64,
        "min_angle": -150.0,
        "max_angle": 150.0,
        "min_distance": 0.15,
        "max_distance": distance,
        "clipping_distance": distance,
        "num_sectors": sectors,
    }
    kit = f"The standard car has one camera in front: it takes the sensor kit to have {sensor}."
    assert kit in car_notes(metadata, spec)
    assert any("lidar_config" in note for note in car_notes(metadata, spec))


def test_all_that_is_of_the_sensor_kit_is_named() -> None:
    notes = car_notes(*of(action_space("default"), ("STEREO_CAMERAS", "LIDAR")))
    assert any("it takes the sensor kit to have STEREO_CAMERAS, LIDAR." in note for note in notes)


def test_what_the_car_cannot_do_is_refused() -> None:
    with pytest.raises(ConfigError, match="does not know the sensor DISCRETIZED_SECTOR_LIDAR"):
        car_metadata(*of(action_space("default"), (*FRONT, "DISCRETIZED_SECTOR_LIDAR")))
    with pytest.raises(ConfigError, match="No action steers") as told:
        car_metadata(*of(table((0, 1), (0, 2))))
    assert "--actions default" in told.value.hint


NOTES = {
    "half speed": (table((-30, 1), (30, 2)), "1 m/s, 50 % of the largest speed, gets 80 % of the throttle of 2 m/s"),
    "an eighth": (
        continuous(-30, 30, 0.5, 4),
        "0.5 m/s, 12 % of the largest speed, gets 26 % of the throttle of 4 m/s",
    ),
    "one speed": (action_space("steady"), "it is the slider alone that says how fast"),
    "twenty degrees": (table((-20, 1), (20, 1)), "20° here, where it was trained with 20° of 30°"),
    "forty-five degrees": (table((-45, 1), (45, 2)), "2 of 2 actions ask for more than the simulator's car does"),
    "eight metres a second": (table((-30, 1), (30, 8)), "1 m/s, 25 % of the largest speed"),
    "unequal": (continuous(-25, 27, 1, 2), "It steers 27° to the left and 25° to the right"),
    "left only": (table((10, 1), (30, 1)), "It steers 30° to the left and 0° to the right"),
}


@pytest.mark.parametrize(("space", "says"), NOTES.values(), ids=NOTES)
def test_a_note_says_what_becomes_of_speeds_and_angles(space: ActionSpace, says: str) -> None:
    notes = car_notes(*of(space))
    assert any(says in note for note in notes), notes
    assert all(note.endswith(".") for note in notes)


def test_a_model_that_a_car_drives_as_trained_gets_the_one_note_on_speeds() -> None:
    assert len(car_notes(*of(action_space("default")))) == 1
    assert len(car_notes(*of(action_space("default"), ("STEREO_CAMERAS",)))) == 3
    assert any("hyperbolic tangent" in note for note in car_notes(*of(action_space("continuous"), is_squashed=True)))


def test_throttle_and_steering_are_shares_of_the_largest() -> None:
    space = table((-24, 0.5), (12, 1), (0, 2))
    np.testing.assert_allclose(steering_share(np.radians([-24, 12, 0]), space), [-1, 0.5, 0], atol=1e-12)
    np.testing.assert_allclose(throttle(np.array([0.0, 0.5, 1.0, 2.0]), space), [0, 0.475, 0.8, 1.0], atol=1e-12)
