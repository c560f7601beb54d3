"""Rival: Gymnasium's CarRacing-v3, steps per second with its pixels.

    python benchmarks/rivals/carracing.py

It is the camera racing environment that most people know: 96 x 96 RGB, one car, Box2D, one process.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from typing import Any

NUM_ACTIONS = 1000
NUM_PARTS = 5


def measure(seconds: float = 5.0) -> dict[str, Any]:
    """Median steps per second over five parts of `seconds`; actions are made beforehand, resets are included."""
    import gymnasium

    env = gymnasium.make("CarRacing-v3").unwrapped
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(NUM_ACTIONS)]
    env.reset(seed=0)
    env.step(actions[0])  # the first step builds what later ones reuse

    rates = []
    num_steps = 0
    for _ in range(NUM_PARTS):
        start = time.perf_counter()
        begin = num_steps
        while time.perf_counter() - start < seconds / NUM_PARTS:
            _, _, terminated, truncated, _ = env.step(actions[num_steps % NUM_ACTIONS])
            num_steps += 1
            # The bare environment knows no time limit; its registered one is 1000 steps.
            if terminated or truncated or num_steps % 1000 == 0:
                env.reset()
        rates.append((num_steps - begin) / (time.perf_counter() - start))
    env.close()
    return {
        "name": "Gymnasium CarRacing-v3",
        "version": gymnasium.__version__,
        "steps_per_second": statistics.median(rates),
        "steps": num_steps,
        "observation": "96x96 RGB",
        "num_envs": 1,
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, help="how long to measure")
    print(json.dumps(measure(parser.parse_args().seconds)))
