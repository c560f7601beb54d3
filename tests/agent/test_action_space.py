import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.agent import PRESETS, ContinuousActionSpace, DiscreteActionSpace, action_space
from racecraft.errors import ConfigError, NonFiniteAction, ShapeError
from racecraft.reward import make_params
from racecraft.reward.worker import waypoints_of
from racecraft.sim import Simulation
from racecraft.track import load_track

angles = st.floats(-30, 30).map(lambda value: round(value, 3))
speeds = st.floats(0.1, 4).map(lambda value: round(value, 3))


@given(st.lists(st.tuples(angles, speeds), min_size=2, max_size=30))
def test_discrete_goes_through_aws_degrees_unchanged(actions):
    document = [{"steering_angle": angle, "speed": speed, "index": i} for i, (angle, speed) in enumerate(actions)]
    space = DiscreteActionSpace.from_aws(document)
    assert space.to_aws() == document
    assert DiscreteActionSpace.from_aws(space.to_aws()) == space
    assert space.size == len(actions) == len(space.labels) == space.space.n


def test_discrete_commands_are_rows_of_the_table():
    space = action_space("default")
    commands = space.to_commands(np.arange(space.size))
    assert commands.shape == (10, 2)
    assert commands.dtype == np.float32
    np.testing.assert_allclose(commands, space.table, rtol=1e-6)
    assert space.to_commands([4])[0].tolist() == [0.0, 1.0]
    assert (space.labels[0], space.labels[4]) == ("right 30° 1 m/s", "straight 1 m/s")
    assert DiscreteActionSpace.from_aws([{"steering_angle": 1, "speed": 1}] * 2).labels[0] == "left 1° 1 m/s"


def test_equal_tables_are_one_space():
    assert len({action_space("default"), action_space("default")}) == 1
    assert hash(action_space("default")) == hash(DiscreteActionSpace.from_aws(action_space("default").to_aws()))


def test_steering_of_45_degrees_is_commanded_and_drives_as_30():
    space = DiscreteActionSpace.from_aws([{"steering_angle": angle, "speed": 0.8} for angle in (45, -45, 30, -30)])
    assert space.to_aws()[0]["steering_angle"] == 45
    cars = Simulation(load_track("oval"), num_envs=4, camera=None, num_threads=1)
    waypoints = waypoints_of(cars.tracks)
    for _ in range(5):
        cars.step(space.to_commands(np.arange(4)))
        seen = [make_params(row, waypoints) for row in cars.rows.tolist()]
        assert [params["steering_angle"] for params in seen] == [45.0, -45.0, 30.0, -30.0]
    wheels = cars.column("actual_steering_angle")
    np.testing.assert_allclose(np.abs(wheels), math.radians(30), atol=0.03)  # the car pulls to the left
    np.testing.assert_array_equal(cars.vehicles[:, :2], cars.vehicles[:, 2:])


def test_nine_metres_a_second_are_commanded_and_drive_as_four():
    space = DiscreteActionSpace.from_aws([{"steering_angle": 0, "speed": speed} for speed in (9, 12, 4, 4)])
    cars = Simulation(load_track("oval"), num_envs=4, camera=None, num_threads=1)
    waypoints = waypoints_of(cars.tracks)
    for _ in range(20):
        cars.step(space.to_commands(np.arange(4)))
        seen = [make_params(row, waypoints) for row in cars.rows.tolist()]
        assert [params["speed"] for params in seen] == [9.0, 12.0, 4.0, 4.0]
    np.testing.assert_array_equal(cars.vehicles[:, :2], cars.vehicles[:, 2:])
    assert 1.0 < cars.vehicles[3].max() < 4.5


def test_grid_is_the_console_generator():
    space = DiscreteActionSpace.grid(30, steering_granularity=5, max_speed=1, speed_granularity=2)
    assert space.to_degrees() == [(a, s) for a in (-30, -15, 0, 15, 30) for s in (0.5, 1.0)]
    assert space == action_space("aws")
    three = DiscreteActionSpace.grid(15, steering_granularity=3, max_speed=3, speed_granularity=3)
    assert three.to_degrees() == [(a, s) for a in (-15, 0, 15) for s in (1.0, 2.0, 3.0)]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"max_steering": 31}, "max_steering is 31; allowed is 1 to 30"),
        ({"max_steering": math.nan}, "max_steering is nan"),
        ({"steering_granularity": 4}, "steering_granularity is 4; allowed is 3, 5 or 7"),
        ({"max_speed": 4.1}, "max_speed is 4.1; allowed is 0.1 to 4"),
        ({"speed_granularity": 0}, "speed_granularity is 0; allowed is 1, 2 or 3"),
        ({"max_speed": 0.2, "speed_granularity": 3}, "speed is 0.0666667; allowed is 0.1 to 4"),
    ],
)
def test_grid_refuses_what_the_console_refuses(change, words):
    settings = {
        "max_steering": 30,
        "steering_granularity": 5,
        "max_speed": 1,
        "speed_granularity": 2,
        **change,
    }
    with pytest.raises(ConfigError) as error:
        DiscreteActionSpace.grid(settings.pop("max_steering"), **settings)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("table", "error"),
    [
        ([[0.0, 1.0]], ConfigError),
        ([[0.0, 1.0]] * 31, ConfigError),
        ([], ShapeError),
        ([[0.0, 1.0, 2.0]] * 3, ShapeError),
        ([["left", "fast"]] * 3, ShapeError),
        ([[0.0, math.nan], [0.0, 1.0]], ConfigError),
        ([[0.0, 13.0], [0.0, 1.0]], ConfigError),
        ([[1.0, 1.0], [0.0, 1.0]], ConfigError),
    ],
)
def test_discrete_refuses_a_bad_table(table, error):
    with pytest.raises(error):
        DiscreteActionSpace(table)


@pytest.mark.parametrize("actions", [[10], [-1], [0.5], [[1]], ["a"], 3, [1, [2]], [1j], None, {}])
def test_discrete_refuses_bad_actions(actions):
    with pytest.raises((ConfigError, ShapeError)):
        action_space("default").to_commands(actions)


def test_table_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        action_space("default").table[0] = 0


@given(angles.filter(lambda a: a < 0), angles.filter(lambda a: a > 0), st.floats(0.1, 2), st.floats(2.01, 4))
def test_continuous_scales_exactly_onto_its_corners(left, right, slow, fast):
    space = ContinuousActionSpace([math.radians(left), slow], [math.radians(right), fast])
    commands = space.to_commands([[-1, -1], [1, 1], [0, 0], [-9, 9]])
    np.testing.assert_array_equal(commands[0], space.low.astype(np.float32))
    np.testing.assert_array_equal(commands[1], space.high.astype(np.float32))
    np.testing.assert_allclose(commands[2], (space.low + space.high) / 2, atol=1e-6)
    np.testing.assert_array_equal(commands[3], np.float32([space.low[0], space.high[1]]))
    assert ContinuousActionSpace.from_aws(space.to_aws()) == space


def test_continuous_refuses_nan_and_shapes():
    space = action_space("continuous")
    with pytest.raises(NonFiniteAction, match=r"action\[1\] = \(nan, 0.0\)"):
        space.to_commands([[0, 0], [math.nan, 0]])
    with pytest.raises(ShapeError):
        space.to_commands([0, 0])
    assert space.to_commands([[math.inf, -math.inf]]).tolist() == [[space.high[0].astype("f4"), 0.5]]
    assert space.space.contains(np.zeros(2, np.float32))


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        ((-31, 1), (30, 2), "steering_angle.low is -31; allowed is -30 to 0"),
        ((5, 1), (30, 2), "steering_angle.low is 5"),
        ((-5, 1), (-1, 2), "steering_angle.high is -1"),
        ((-5, 0.05), (5, 2), "speed.low is 0.05"),
        ((-5, 2), (5, 1), "speed.low is 2.0; allowed is below its high of 1"),
        ((0, 1), (0, 2), "steering_angle.low is 0.0; allowed is below"),
    ],
)
def test_continuous_refuses_bad_limits(low, high, words):
    with pytest.raises(ConfigError) as error:
        ContinuousActionSpace((math.radians(low[0]), low[1]), (math.radians(high[0]), high[1]))
    assert words in str(error.value)


DEGREES = {"low": -30, "high": 30}


@pytest.mark.parametrize(
    ("kind", "given", "words"),
    [
        (DiscreteActionSpace, 5, 'actions is 5; allowed is a list of {"steering_angle": degrees, "speed": m/s}.'),
        (DiscreteActionSpace, [{"speed": 1}], "actions is [{'speed': 1}]; allowed is a list"),
        (DiscreteActionSpace, [{"steering_angle": "left", "speed": 1}] * 2, "'left'"),
        (DiscreteActionSpace, [(30, 1), (-30, 1)], "actions is [(30, 1), (-30, 1)]; allowed"),
        (ContinuousActionSpace, {}, 'limits is {}; allowed is {"low": ..., "high": ...} for "steering_angle" in'),
        (ContinuousActionSpace, {"steering_angle": DEGREES, "speed": {"low": 1}}, "'speed': {'low': 1}}; allowed is"),
        (ContinuousActionSpace, {"steering_angle": DEGREES, "speed": 4}, "'speed': 4}; allowed is"),
        (ContinuousActionSpace, {"steering_angle": DEGREES, "speed": {"low": 1, "high": None}}, "'high': None}}"),
    ],
)
def test_what_is_nothing_of_aws_says_what_is(kind, given, words):
    with pytest.raises(ConfigError) as error:
        kind.from_aws(given)
    assert words in str(error.value)


def test_degrees_where_radians_are_wanted_are_guessed():
    for make in (lambda: DiscreteActionSpace([(30, 1), (-30, 1)]), lambda: ContinuousActionSpace([-30, 1], [30, 2])):
        with pytest.raises(ConfigError, match=r"steering_angle\S* is -?1718\.87") as error:
            make()
        assert error.value.hint == "Angles are in radians here; from_aws takes degrees."
    with pytest.raises(ConfigError, match="is 51") as error:
        DiscreteActionSpace([(0.9, 1), (0.0, 1)])
    assert not error.value.hint


def test_presets_exist_and_a_misspelt_one_is_guessed():
    assert all(action_space(name).size >= 2 for name in PRESETS)
    assert action_space("fast").table[:, 1].max() == 4.0
    with pytest.raises(ConfigError, match="action space is 'fats'; allowed are default") as error:
        action_space("fats")
    assert error.value.hint == "Did you mean 'fast'?"
