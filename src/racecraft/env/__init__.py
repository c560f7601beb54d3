"""Gymnasium environments: one car, or many stepped together. Adapters over the simulation, nothing more.

import gymnasium, racecraft.env

env = gymnasium.make("Racecraft-v0", track="oval")
envs = gymnasium.make_vec("Racecraft-v0", num_envs=64, track="oval")
"""

from racecraft.env.observation import STATE_BOUNDS
from racecraft.env.racecraft_env import RacecraftEnv
from racecraft.env.registration import ENV_ID, register_environments
from racecraft.env.vector_env import RacecraftVectorEnv

__all__ = ["ENV_ID", "STATE_BOUNDS", "RacecraftEnv", "RacecraftVectorEnv", "register_environments"]

register_environments()
