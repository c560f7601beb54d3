"""Rewards of an environment: sources in a process that ends with it, callables in this one."""

from __future__ import annotations

import numpy as np
import pytest

from alive_processes import is_alive
from racecraft.env import RacecraftEnv, RacecraftVectorEnv
from racecraft.env.rewards import IsolatedReward, open_reward
from racecraft.errors import RewardError
from racecraft.reward import load_preset
from racecraft.track import load_track

SOURCE = "def reward_function(params):\n    return params['speed'] + params['progress'] / 100\n"
OVAL = [load_track("oval")]


def rewards_of(reward, *, steps=8, seed=0):
    with RacecraftEnv("oval", observation="state", reward=reward) as env:
        env.reset(seed=seed)
        return [env.step(5)[1] for _ in range(steps)]


def test_text_file_preset_and_callable_say_the_same(tmp_path):
    file = tmp_path / "reward_function.py"
    file.write_text(SOURCE)
    expected = rewards_of(lambda params: params["speed"] + params["progress"] / 100)
    assert expected[0] == pytest.approx(2.0, abs=0.01)
    for reward in (SOURCE, file, str(file)):
        assert rewards_of(reward) == expected
    assert rewards_of("racing") == rewards_of(load_preset("racing"))


def test_closing_ends_the_process_and_may_be_repeated():
    env = RacecraftEnv("oval", observation="state")
    envs = RacecraftVectorEnv("oval", num_envs=2, observation="state")
    for either in (env, envs):
        process_id = either._task._reward.process_id
        assert is_alive(process_id)
        either.close()
        assert not is_alive(process_id)
        either.close()


def test_a_forgotten_environment_leaves_no_process():
    env = RacecraftEnv("oval", observation="state")
    process_id = env._task._reward.process_id
    del env
    assert not is_alive(process_id)


def test_a_failing_reward_names_its_line_and_params():
    source = "def reward_function(params):\n    return 1.0 / params['speed'] / 0\n"
    with RacecraftEnv("oval", observation="state", reward=source) as env:
        env.reset(seed=0)
        with pytest.raises(RewardError, match="line 2") as caught:
            env.step(5)
    assert caught.value.params["speed"] == 2.0


@pytest.mark.parametrize("value", [None, "1.0", float("nan"), 1e6, [1.0, 2.0]])
def test_a_callable_must_return_a_reward(value):
    with RacecraftEnv("oval", observation="state", reward=lambda params: value) as env:
        env.reset(seed=0)
        with pytest.raises(RewardError, match="params"):
            env.step(5)


def test_what_a_callable_raises_passes_through():
    def broken(params):
        raise KeyError("spede")

    with RacecraftEnv("oval", observation="state", reward=broken) as env:
        env.reset(seed=0)
        with pytest.raises(KeyError, match="spede"):
            env.step(5)


@pytest.mark.parametrize(
    "source",
    [
        "import random\n\ndef reward_function(params):\n    return random.random()\n",
        "calls = []\n\ndef reward_function(params):\n    calls.append(1)\n    return float(len(calls))\n",
    ],
    ids=["random", "stateful"],
)
def test_a_seeded_reset_begins_anew_also_for_rewards_that_remember(source):
    with RacecraftEnv("oval", observation="state", reward=source) as env:
        runs = []
        for _ in range(2):
            env.reset(seed=4)
            runs.append([env.step(5)[1] for _ in range(3)])
        env.reset()
        assert env.step(5)[1] not in runs[0]
    assert runs[0] == runs[1]


def test_every_car_of_a_batch_has_its_own_memory():
    source = "calls = []\n\ndef reward_function(params):\n    calls.append(1)\n    return float(len(calls))\n"
    envs = RacecraftVectorEnv("oval", num_envs=3, observation="state", reward=source)
    envs.reset(seed=0)
    assert [envs.step(np.full(3, 5))[1].tolist() for _ in range(3)] == [[n] * 3 for n in (1, 2, 3)]
    envs.close()


def test_prepare_rows_have_no_reward_and_are_not_shown():
    seen = []
    isolated = open_reward("def reward_function(params):\n    return 5.0\n", tracks=OVAL, num_envs=2)
    local = open_reward(lambda params: seen.append(params["steps"]) or 5.0, tracks=OVAL, num_envs=2)
    assert isinstance(isolated, IsolatedReward)
    rows = np.zeros((2, 24))
    rows[:, 1] = (1, 2)
    for reward in (isolated, local):
        assert reward(rows).tolist() == [0.0, 5.0]
        reward.close()
    assert seen == [2.0]
