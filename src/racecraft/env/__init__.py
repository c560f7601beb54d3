"""Gymnasium environments: one car, or many stepped together. Adapters over the simulation, nothing more.

import gymnasium, racecraft.env

env = gymnasium.make("Racecraft-v0", track="oval")
envs = gymnasium.make_vec("Racecraft-v0", num_envs=64, track="oval")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from racecraft.env.registration import ENV_ID, register_environments

if TYPE_CHECKING:
    from racecraft.env.observation import STATE_BOUNDS
    from racecraft.env.parallel_env import RacecraftParallelEnv
    from racecraft.env.racecraft_env import RacecraftEnv
    from racecraft.env.vector_env import RacecraftVectorEnv

__all__ = [
    "ENV_ID",
    "STATE_BOUNDS",
    "RacecraftEnv",
    "RacecraftParallelEnv",
    "RacecraftVectorEnv",
    "register_environments",
]

_ON_FIRST_USE = {
    "STATE_BOUNDS": "observation",
    "RacecraftEnv": "racecraft_env",
    "RacecraftParallelEnv": "parallel_env",
    "RacecraftVectorEnv": "vector_env",
}


def __getattr__(name: str) -> Any:
    """Import the environments on first use, so that registering their ids costs nothing."""
    if name in _ON_FIRST_USE:
        return getattr(import_module(f"racecraft.env.{_ON_FIRST_USE[name]}"), name)
    raise AttributeError(f"module 'racecraft.env' has no attribute {name!r}")


register_environments()
