"""Check the reward function beside this file, try it on the situations of a track, then drive with it.

    python examples/custom_reward/try_reward.py
    racecraft train --reward examples/custom_reward/reward_function.py \\
        --model-metadata examples/custom_reward/model_metadata.json \\
        --hyperparameters examples/custom_reward/hyperparameters.json
"""

import argparse
from pathlib import Path

from racecraft.env import RacecraftEnv
from racecraft.reward import check_reward, dry_run, load_reward
from racecraft.track import load_track

HERE = Path(__file__).parent

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--steps", type=int, default=100, help="steps to drive")
parser.add_argument("--track", default="reinvent_2018", help="see 'racecraft tracks'")
options = parser.parse_args()

source = load_reward(HERE / "reward_function.py")
for problem in check_reward(source):
    print(problem)
for outcome in dry_run(source, load_track(options.track)):
    result = f"{outcome.reward:8.4f}" if outcome.error is None else str(outcome.error)
    print(f"{outcome.situation.name:16} {result}")

metadata = HERE / "model_metadata.json"
with RacecraftEnv(options.track, reward=source, action_space=metadata, observation="state") as env:
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(options.steps):
        _, reward, terminated, truncated, info = env.step(env.action_space.sample())
        print(f"progress {info['progress']:6.1%}  speed {info['speed']:.1f} m/s  reward {reward:.4f}")
        if terminated or truncated:
            print(info["status"])
            env.reset()
