"""A teacher's cars: no camera, the user's reward, and a finish line that is not the end of the road."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest

from racecraft.agent import action_space
from racecraft.learn import NetworkSpec
from racecraft.learn.native_state_learner import NativeStateLearner
from racecraft.reward import load_reward
from racecraft.sim import Simulation, Start
from racecraft.sim.columns import STATE_COLUMNS, STATUS_NAMES
from racecraft.track import Sketch, draw_road, load_track
from racecraft.training.opponents import Opponents
from racecraft.training.rival_view import RIVAL_COLUMNS, tell_rivals
from racecraft.training.settings import TrainSettings
from racecraft.training.teacher import TeachersEnvironment, teacher_environment

RACE = TrainSettings(
    track="oval", num_threads=1, algorithm="distill", opponents=Opponents(cars=3, snapshot_every=256, pool_size=2)
)
OFFSET, ERROR, AHEAD = (STATE_COLUMNS.index(name) for name in ("offset", "sin_heading_error", "curvature_1"))


def teacher_of(settings: TrainSettings) -> NativeStateLearner:
    return NativeStateLearner(NetworkSpec(num_actions=2, is_discrete=False, state_size=settings.state_size), seed=1)


@pytest.fixture
def race() -> Iterator[TeachersEnvironment]:
    with ExitStack() as stack:
        space, source = action_space("continuous"), load_reward("duel")
        yield teacher_environment(RACE, source, [load_track("oval")], space, stack, teacher_of(RACE))


def test_in_a_race_a_teacher_meets_what_it_is_and_what_it_was(race: TeachersEnvironment) -> None:
    assert (race.num_envs, race.simulation.num_envs) == (128, 384)
    assert race.opponents is not None
    kept = []
    for _ in range(9):
        states = race.observe()[1]
        assert states.shape == (128, RACE.state_size)
        np.testing.assert_array_equal(states, race.tell_states()[race.opponents.own])
        rewards, terminated, truncated = race.step(np.full((128, 2), [0.1, 0.5], np.float32))
        assert rewards.shape == (128,)
        race.reset(terminated | truncated)
        kept.append(race.opponents.state()["opponents/steps"].tolist()[1:])
    assert kept == [[], [256], [256], [256, 512], [256, 512], [512, 768], [512, 768], [512, 768], [512, 768]]
    assert (race.simulation.column("progress").reshape(128, 3) > 0).any(axis=0).all()  # everybody drives
    drivers = race.opponents.state()["opponents/drivers"].reshape(128, 3)
    assert set(drivers.ravel().tolist()) <= {-1, 0, 1}


def test_the_others_of_a_teachers_race_drive_by_its_weights(race: TeachersEnvironment) -> None:
    """Weights that say full lock to the left, whatever the state: all others do so, the learner's cars do not."""
    assert race.opponents is not None
    learner = race.opponents._current.learner
    weights = {name: np.zeros_like(array) for name, array in learner.weights().items()}
    weights["policy.head.bias"][:2] = [1.0, 1.0]
    learner.load_weights(weights)
    race.step(np.full((128, 2), [-1.0, 1.0], np.float32))
    angles = race.simulation.column("steering_angle")
    own = np.zeros(384, bool)
    own[race.opponents.own] = True
    assert (angles[own] < -0.4).all()
    assert (angles[~own] > 0.4).all()


def test_it_is_told_of_the_nearest_other_car(race: TeachersEnvironment) -> None:
    simulation = race.simulation
    length, width = simulation.tracks[0].length, simulation.tracks[0].mean_width
    for car, (place, offset, speed) in enumerate(((0.2, 0.1, 1.0), (length - 0.3, -0.2, 2.0), (3.2, 0.0, 0.0))):
        simulation.place(car, place, offset=offset, speed=speed)
    race.step(np.zeros((128, 2), np.float32))  # rows are of the poses before
    told = race.tell_states()[:3, -len(RIVAL_COLUMNS) :]
    expected = [[1 / 1.5, np.tanh(-1.0), -0.3 / (width / 2), 0.25], [1 / 1.5, np.tanh(1.0), 0.3 / (width / 2), -0.25]]
    np.testing.assert_allclose(told[:2], expected, atol=0.02)
    np.testing.assert_allclose(told[2], [1 / 4.0, -1.0, 0.1 / (width / 2), 0.25], atol=0.02)


def test_on_an_open_road_nobody_is_told_of_a_way_round() -> None:
    sketch = Sketch(points=((0, 0), (4, 0), (8, 0)), widths=(0.8, 0.8, 0.8), is_closed=False)
    road = draw_road(sketch, name="road")
    cars = Simulation([load_track("oval"), road], num_envs=4, cars_per_race=2, start=Start(spread=True))
    for race, length in enumerate(track.length for track in cars.tracks):
        cars.place(2 * race, 0.1 * length, offset=0.0, speed=1.0)
        cars.place(2 * race + 1, 0.8 * length, offset=0.0, speed=1.0)
    cars.step(np.zeros((4, 2), np.float32))
    places = tell_rivals(cars)[:, RIVAL_COLUMNS.index("rival_place")]
    assert (np.sign(places) == [-1.0, 1.0, 1.0, -1.0]).all()


def test_a_completed_lap_cuts_the_episode_and_leaving_the_road_ends_it() -> None:
    track, space = load_track("oval"), action_space("continuous")
    settings = TrainSettings(track="oval", num_threads=1)
    seen = set()
    with ExitStack() as stack:
        cars = teacher_environment(settings, load_reward("lap_time"), [track], space, stack, teacher_of(settings))
        is_careful = np.arange(cars.num_envs) % 2 == 0
        total = np.zeros(cars.num_envs)
        for _ in range(400):
            frames, states = cars.observe()
            assert frames.size == 0
            steering = 0.5 * states[:, AHEAD] - 1.5 * states[:, ERROR] - 0.5 * states[:, OFFSET]
            actions = np.stack([np.where(is_careful, steering.clip(-1, 1), 1.0), np.full(len(states), -0.5)], 1)
            rewards, terminated, truncated = cars.step(actions.astype(np.float32))
            total += rewards
            for car in np.flatnonzero(terminated | truncated):
                status = STATUS_NAMES[int(cars.simulation.column("status")[car])]
                seen.add((status, bool(is_careful[car]), bool(terminated[car]), bool(truncated[car])))
                if status == "lap_complete":
                    assert 0.9 * track.length < total[car] < 1.1 * track.length
                total[car] = 0.0
            cars.reset(terminated | truncated)
    assert seen == {("lap_complete", True, False, True), ("off_track", False, True, False)}
