"""Stable-Baselines3: its checker says nothing, and its algorithms take the environment as it is."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from racecraft.env import RacecraftEnv

pytestmark = pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="stable-baselines3 is not installed")


@pytest.mark.parametrize("action_space", ["default", "continuous"])
@pytest.mark.parametrize("observation", ["camera", "state", "both"])
def test_its_checker_has_nothing_to_say(observation, action_space):
    from stable_baselines3.common.env_checker import check_env

    with RacecraftEnv("oval", observation=observation, action_space=action_space) as env:
        check_env(env)


@pytest.mark.costly
@pytest.mark.parametrize(
    ("policy", "observation"),
    [("CnnPolicy", "camera"), ("MlpPolicy", "state"), ("MultiInputPolicy", "both")],
)
def test_ppo_takes_a_few_steps(policy, observation):
    from stable_baselines3 import PPO

    with RacecraftEnv("oval", observation=observation) as env:
        PPO(policy, env, n_steps=16, batch_size=16, n_epochs=1, device="cpu").learn(16)
