"""Several agents on one track: PettingZoo's own tests, who leaves when, and one car against frozen opponents."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from racecraft.env import RacecraftEnv, RacecraftParallelEnv
from racecraft.errors import ConfigError, ResetNeeded, ShapeError
from racecraft.race import Autopilot
from racecraft.sim import Bots, Objects, Start
from racecraft.sim.simulation import MAX_STEERING

with warnings.catch_warnings():  # it imports a game of its own, in a way that it has deprecated
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import parallel_api_test
    from pettingzoo.test.seed_test import parallel_seed_test

SHORT = {"track": "oval", "max_episode_steps": 60}


def drive_straight(frames):
    assert frames.dtype == np.uint8
    return np.tile(np.float32([0.0, 1.0]), (len(frames), 1))


# --- PettingZoo


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize(
    "settings",
    [
        {"num_cars": 4, "observation": "state"},
        {"num_cars": 2, "observation": "both", "action_space": "continuous"},
        {"num_cars": 1, "observation": "state", "objects": Objects(bots=Bots())},
    ],
)
def test_pettingzoos_own_tests(settings):
    env = RacecraftParallelEnv(**SHORT, **settings)
    parallel_api_test(env, num_cycles=80)
    env.close()
    parallel_seed_test(lambda: RacecraftParallelEnv(**SHORT, **settings), num_cycles=20)


def test_agents_leave_as_they_are_done_and_the_race_ends_without_them():
    env = RacecraftParallelEnv(track="oval", num_cars=3, observation="state", action_space="continuous")
    env.reset(seed=1)
    left = np.float32([1.0, 0.5])
    ahead = np.float32([0.0, -1.0])
    seen = []
    while env.agents:
        before = list(env.agents)
        results = env.step({agent: left if agent == "car_1" else ahead for agent in before})
        for result in results:
            assert list(result) == before
        seen.append(len(before))
    assert seen[0] == 3
    assert 2 in seen  # somebody left before the others
    with pytest.raises(ResetNeeded):
        env.step({})
    env.reset()
    assert env.agents == ["car_0", "car_1", "car_2"]
    env.close()


def test_the_reward_of_an_agent_sees_the_others_as_objects():
    seen = []

    def reward(params):
        seen.append(len(params["objects_location"]))
        return 1.0

    env = RacecraftParallelEnv(
        track="oval", num_cars=3, observation="state", reward=reward, objects=Objects(bots=Bots())
    )
    env.reset(seed=1)
    rewards = env.step(dict.fromkeys(env.agents, 0))[1]
    assert rewards == dict.fromkeys(env.agents, 1.0)
    assert seen == [5] * 3  # three bots and two others
    env.close()


def test_no_reward_is_asked_for_cars_that_have_left_the_race():
    asked = []
    env = RacecraftParallelEnv(
        track="oval",
        num_cars=3,
        observation="state",
        action_space="continuous",
        reward=lambda params: asked.append(params["y"]) or 1.0,
    )
    env.reset(seed=1)
    left = 0
    while env.agents:
        racing, _ = list(env.agents), asked.clear()
        rewards = env.step({agent: np.float32([agent == "car_1", -1.0]) for agent in racing})[1]
        assert rewards == dict.fromkeys(racing, 1.0)
        assert len(asked) == len(racing)
        left = max(left, 3 - len(racing))
    assert left
    env.close()


def test_every_agent_keeps_its_own_memory_of_a_reward_when_others_leave():
    source = "calls = []\n\ndef reward_function(params):\n    calls.append(1)\n    return float(len(calls))\n"
    env = RacecraftParallelEnv(
        track="oval", num_cars=3, observation="state", action_space="continuous", reward=source, max_episode_steps=60
    )
    env.reset(seed=1)
    steps = 0
    while env.agents:
        steps += 1
        racing = list(env.agents)
        rewards = env.step({agent: np.float32([agent == "car_0", -1.0]) for agent in racing})[1]
        assert rewards == dict.fromkeys(racing, float(steps))
    env.close()


def test_every_race_draws_its_conditions_from_the_seed():
    def first_pictures(seed, **settings):
        env = RacecraftParallelEnv(track="oval", num_cars=2, start="fixed", **settings)
        pictures = [env.reset(seed=seed)[0]["car_1"], env.reset()[0]["car_1"]]
        env.close()
        return np.stack(pictures)

    plain, drawn = first_pictures(1), first_pictures(1, randomize="strong")
    assert np.array_equal(*plain)
    assert not np.array_equal(*drawn)
    assert np.array_equal(drawn, first_pictures(1, randomize="strong"))
    assert not np.array_equal(drawn, first_pictures(2, randomize="strong"))


def test_mistakes_of_a_caller_are_said():
    wrong = (
        {"num_cars": 0},
        {"num_cars": 9},
        {"num_cars": "2"},
        {"render_mode": "human"},
        {"seat": 1},
        {"opponents": []},
    )
    for settings in wrong:
        with pytest.raises(ConfigError):
            RacecraftParallelEnv(track="oval", **settings)
    env = RacecraftParallelEnv(track="oval", observation="state")
    with pytest.raises(ResetNeeded):
        env.step({"car_0": 0, "car_1": 0})
    env.reset(seed=2)
    with pytest.raises(ConfigError, match="actions is 5; use a dict of agents and their actions"):
        env.step(5)
    with pytest.raises(ConfigError, match="actions lack car_1"):
        env.step({"car_0": 0})
    with pytest.raises(ConfigError, match="seed"):
        env.reset(seed=-1)
    with pytest.raises(ShapeError, match=r"different shapes, \{'car_0': \(\), 'car_1': \(1,\)\}"):
        env.step({"car_0": 0, "car_1": [0]})
    with pytest.raises(ShapeError, match="not an array of numbers"):
        env.step({"car_0": 0, "car_1": [0, [1]]})
    env.close()


def test_what_a_car_is_told_that_has_left_the_race_means_nothing():
    env = RacecraftParallelEnv(track="oval", observation="state", action_space="continuous")
    env.reset(seed=1)
    while len(env.agents) > 1:
        env.step({agent: np.float32([agent == "car_1", -1.0]) for agent in env.agents})
    assert env.agents == ["car_0"]
    for nonsense in (np.float32([np.nan, 0.0]), None, "left"):
        assert env.step({"car_1": nonsense, "car_0": np.float32([0.0, -1.0])})[1].keys() == {"car_0"}
    env.close()


def test_a_picture_shows_the_race():
    env = RacecraftParallelEnv(track="oval", num_cars=2, observation="state", render_mode="rgb_array")
    alone = RacecraftParallelEnv(track="oval", num_cars=1, observation="state", render_mode="rgb_array")
    for each in (env, alone):
        each.reset(seed=1)
    assert env.render().shape == (480, 640, 3)
    assert (env.render() != alone.render()).mean() > 0.001
    env.close()
    alone.close()


# --- one car against others


@pytest.mark.parametrize("track", ["oval", "straight"])
def test_a_picture_is_of_the_foremost_wherever_it_began(track):
    env = RacecraftParallelEnv(
        track=track,
        num_cars=3,
        observation="state",
        action_space="continuous",
        render_mode="rgb_array",
        start=Start(mode="fixed"),
    )
    env.reset(seed=1)
    frame = env._renderer.frame
    assert np.array_equal(env.render(), frame(0))  # in front on the grid
    for _ in range(8):  # those behind are faster, and still behind
        env.step({"car_0": np.float32([0.0, -1.0]), "car_1": np.float32([0.0, -0.8]), "car_2": np.float32([0.0, -0.8])})
    progress = env._task.simulation.column("progress")
    assert (progress[0] < progress[1]) == (track == "oval")  # on a circuit everybody's lap begins in the grid
    assert np.array_equal(env.render(), frame(0))
    assert not np.array_equal(env.render(), frame(1))
    env.close()


@pytest.mark.parametrize("objects", [None, Objects(bots=Bots(count=2))])
def test_a_picture_shows_all_cars_at_the_same_moment(objects, monkeypatch):
    env = RacecraftParallelEnv(
        track="oval",
        num_cars=3,
        observation="state",
        action_space="continuous",
        render_mode="rgb_array",
        objects=objects,
    )
    env.reset(seed=1)
    for _ in range(10):
        env.step({agent: np.float32([0.0, 0.0]) for agent in env.agents})
    shown = []
    monkeypatch.setattr("racecraft.sim.views.View.draw", lambda *_, cars, **__: shown.extend(cars))
    env._renderer.frame(1)
    itself, *others = shown
    vehicles = env._task.simulation.vehicles
    assert [(car.x, car.y, car.heading) for car in (itself, *others[-2:])] == [
        tuple(vehicles[:3, number].tolist()) for number in (1, 0, 2)
    ]
    assert len(others) == (2 if objects is None else 4)
    env.close()


def test_one_car_against_frozen_opponents_is_a_gymnasium_environment():
    env = gymnasium.make("racecraft.env:Racecraft-v0", opponents=[drive_straight, Autopilot()], **SHORT)
    check_env(env.unwrapped, skip_render_check=True)
    results = []
    for _ in range(2):
        observation, info = env.reset(seed=5)
        results.append([(observation, info), *(env.step(2 * (i % 3)) for i in range(15))])
    assert data_equivalence(results[0], results[1], exact=True)
    env.close()


def test_opponents_come_back_and_the_car_runs_into_one_that_stands():
    class Stands:
        sees = "state"

        def __call__(self, state):
            return np.zeros((len(state), 2), np.float32)

    env = RacecraftEnv(
        track="oval",
        observation="state",
        action_space="continuous",
        start=Start(mode="fixed", shuffle=True),
        opponents=[Stands()] * 3,
    )
    statuses = set()
    for seed in range(12):
        env.reset(seed=seed)
        done = False
        steps = 0
        while not done and steps < 40:
            *_, terminated, truncated, info = env.step(np.float32([0.0, -0.5]))
            done, steps = terminated or truncated, steps + 1
        statuses.add(info["status"])
    assert "crashed" in statuses
    assert "in_progress" in statuses or "off_track" in statuses  # where it started in front
    env.close()


def test_an_opponent_that_remembers_begins_every_episode_anew():
    class Tires:
        sees = "state"
        steps = 0

        def __call__(self, state, cars):
            assert cars.tolist() == [1]
            self.steps += 1
            return np.float32([[0.5, 1.0 + 0.01 * self.steps]])

        def forget(self):
            self.steps = 0

    env = RacecraftEnv(track="oval", observation="state", start=Start(mode="fixed"), opponents=[Tires()])

    def drive(seed):
        env.reset(seed=seed)
        return np.array([np.append(env.step(4)[0], env._task.simulation.vehicles[:, 1]) for _ in range(25)])

    assert (drive(1) == drive(1)).all()
    simulation = env._task.simulation
    assert simulation.column("episode")[1] > 0  # the opponent has left the road and come back
    assert env._opponents._drivers[0].steps == simulation.column("steps")[1] - 1
    env.close()


FAST_IS_A_MISTAKE = "def reward_function(params):\n    return 1.0 / (params['speed'] < 3)\n"


@pytest.mark.parametrize("reward", [FAST_IS_A_MISTAKE, lambda params: 1.0 / (params["speed"] < 3)])
def test_no_reward_is_asked_for_opponents(reward):
    class Hurries:
        sees = "state"

        def __call__(self, state):
            return np.tile(np.float32([0.0, 4.0]), (len(state), 1))

    env = RacecraftEnv(track="oval", observation="state", reward=reward, opponents=[Hurries()])
    env.reset(seed=1)
    assert [env.step(4)[1] for _ in range(5)] == [1.0] * 5
    env.close()


def test_a_lap_of_an_opponent_gives_the_car_no_lap_time():
    env = RacecraftEnv(
        track="oval",
        observation="state",
        action_space="continuous",
        start=Start(mode="fixed"),
        laps=2,
        opponents=[Autopilot(speed=1.5)],
    )
    driver, lap_times, is_over = Autopilot(speed=2.0), [], False
    state, _ = env.reset(seed=1)
    while not is_over:
        ((steering, speed),) = driver(state[None])
        state, _, terminated, truncated, info = env.step(np.float32([steering / MAX_STEERING, (speed - 2.25) / 1.75]))
        is_over = terminated or truncated
        lap_times += [info["lap_time"]] if "lap_time" in info else []
    assert info["status"] == "lap_complete"
    assert len(lap_times) == 2  # the opponent has completed one, too
    assert min(lap_times) > 5
    env.close()


@pytest.mark.parametrize("opponents", [drive_straight, "runs/one", [1], [drive_straight] * 8, 3])
def test_opponents_that_are_no_drivers_are_refused(opponents):
    with pytest.raises(ConfigError, match="pponent"):
        RacecraftEnv(track="oval", opponents=opponents)


def test_opponents_that_cannot_see_or_drive_are_refused():
    with pytest.raises(ConfigError, match="cannot see"):
        RacecraftEnv(track="oval", observation="state", opponents=[drive_straight])
    env = RacecraftEnv(track="oval", opponents=[lambda frames: np.zeros(2, np.float32)])
    env.reset(seed=1)
    with pytest.raises(ShapeError, match="Opponent 1"):
        env.step(0)
    env.close()
