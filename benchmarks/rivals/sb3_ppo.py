"""Rival: Stable-Baselines3's PPO on our own environment, training steps per second from camera pixels.

    python benchmarks/rivals/sb3_ppo.py

Track, action space and reward are the same as in our own runs, minibatches of 64 and 10 epochs are AWS's, and the
network is the one that `CnnPolicy` brings. A rollout is short, so that a short run holds whole iterations: the time
per step does not depend on it, since every step is learned from ten times.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any

NUM_ENVS = 4
ROLLOUT_STEPS = 64
AWS_SETTINGS = {
    "batch_size": 64,
    "n_epochs": 10,
    "learning_rate": 3e-4,
    "ent_coef": 0.01,
    "gamma": 0.99,
    "gae_lambda": 0.95,
    "clip_range": 0.2,
}


def measure(
    seconds: float = 30.0, *, rollout_steps: int = ROLLOUT_STEPS, num_threads: int | None = None
) -> dict[str, Any]:
    """Training steps per second, rollout and updates included, over whole iterations of at least `seconds` in all.

    Args:
        seconds: When to stop; the iteration under way is finished.
        rollout_steps: Steps of each car in an iteration.
        num_threads: Threads of torch, its own choice by default.
    """
    import stable_baselines3
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import DummyVecEnv

    from racecraft.env import RacecraftEnv

    if num_threads is not None:
        torch.set_num_threads(num_threads)

    class Stopwatch(BaseCallback):
        """Stops the run at the first rollout after the time is over: then the last update is complete."""

        def __init__(self) -> None:
            super().__init__()
            self.start = math.nan
            self.elapsed = math.nan
            self.steps = 0

        def _on_training_start(self) -> None:
            self.start = time.perf_counter()

        def _on_rollout_start(self) -> None:
            self.elapsed = time.perf_counter() - self.start
            self.steps = self.num_timesteps

        def _on_step(self) -> bool:
            return self.steps == 0 or self.elapsed < seconds

    env = DummyVecEnv([lambda: RacecraftEnv("reinvent_2018")] * NUM_ENVS)
    try:
        learner = PPO("CnnPolicy", env, seed=0, device="cpu", n_steps=rollout_steps, **AWS_SETTINGS)
        stopwatch = Stopwatch()
        learner.learn(10**9, callback=stopwatch)
    finally:
        env.close()
    return {
        "name": "Stable-Baselines3 PPO on Racecraft-v0",
        "version": stable_baselines3.__version__,
        "steps_per_second": stopwatch.steps / stopwatch.elapsed,
        "steps": stopwatch.steps,
        "observation": "160x120 grey",
        "num_envs": NUM_ENVS,
        "num_threads": torch.get_num_threads(),
        "settings": {"n_steps": rollout_steps, **AWS_SETTINGS},
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=30.0, help="how long to measure")
    parser.add_argument("--rollout-steps", type=int, default=ROLLOUT_STEPS, help="steps of each car in an iteration")
    given = parser.parse_args()
    print(json.dumps(measure(given.seconds, rollout_steps=given.rollout_steps)))
