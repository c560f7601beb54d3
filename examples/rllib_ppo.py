"""Train with RLlib's PPO on 16 cars, from camera pixels: they are one vector environment, at the core's speed.

pip install 'ray[rllib]' torch
python examples/rllib_ppo.py --steps 50000
"""

import argparse
import time

import gymnasium
import numpy as np
import ray
from gymnasium.vector.utils import batch_space
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune import register_env

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--steps", type=int, default=50_000, help="camera steps")
parser.add_argument("--track", default="oval", help="see 'racecraft tracks'")
parser.add_argument("--cars", type=int, default=16)
options = parser.parse_args()


class Floats(gymnasium.vector.VectorObservationWrapper):
    """RLlib's networks take no bytes."""

    def __init__(self, envs):
        super().__init__(envs)
        self.single_observation_space = gymnasium.spaces.Box(0.0, 1.0, envs.single_observation_space.shape, np.float32)
        self.observation_space = batch_space(self.single_observation_space, envs.num_envs)

    def observations(self, observations):
        return observations.astype(np.float32) / 255.0


def cars(settings):
    return Floats(gymnasium.make_vec("racecraft:Racecraft-v0", **settings))


ray.init(num_cpus=1, include_dashboard=False, object_store_memory=100_000_000)
register_env("racecraft-cars", cars)
rollout = options.cars * 64
config = (
    PPOConfig()
    .environment("racecraft-cars", env_config={"track": options.track})
    .env_runners(
        num_env_runners=0,
        num_envs_per_env_runner=options.cars,
        gym_env_vectorize_mode="vector_entry_point",  # else a car each, one after the other
        rollout_fragment_length=64,
    )
    .training(train_batch_size_per_learner=rollout, minibatch_size=256, num_epochs=2, lr=3e-4)
    .rl_module(
        model_config=DefaultModelConfig(
            conv_filters=[[16, 8, 4], [32, 4, 4], [32, 4, 2]], head_fcnet_hiddens=[64], vf_share_layers=True
        )
    )
    .debugging(seed=1)
)
algorithm = config.build_algo()
begun, done = time.perf_counter(), 0
while done < options.steps:
    found = algorithm.train()
    done = int(found["num_env_steps_sampled_lifetime"])
    reward = found["env_runners"].get("episode_return_mean", float("nan"))
    speed = done / (time.perf_counter() - begun)
    print(f"{done:8,} camera steps  return {reward:7.2f}  {speed:5.0f} steps/s", flush=True)
algorithm.stop()
ray.shutdown()
