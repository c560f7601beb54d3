"""One car, then 64, driven through Gymnasium. Random actions: replace them by your own policy.

python examples/gymnasium_loop.py --steps 300
"""

import argparse
import time

import gymnasium

import racecraft.env  # noqa: F401 - makes the id known

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--steps", type=int, default=300, help="steps of each of the two loops")
parser.add_argument("--track", default="reinvent_2018", help="see 'racecraft tracks'")
options = parser.parse_args()


# One car. Its observation is what its camera sees, (120, 160, 1) uint8; the reward is the preset "racing".
env = gymnasium.make("Racecraft-v0", track=options.track)
env.action_space.seed(0)
observation, info = env.reset(seed=0)
total_reward = 0.0
for _ in range(options.steps):
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    total_reward += reward
    if terminated or truncated:
        share = info["progress"]
        print(f"episode {info['episode_number']}: {info['status']} after {share:.1%} of a lap, {total_reward:.2f}")
        observation, info = env.reset()
        total_reward = 0.0
env.close()


# 64 cars in one batch, stepped by the native core; each begins its next episode by itself.
envs = gymnasium.make_vec("Racecraft-v0", num_envs=64, track=options.track)
envs.action_space.seed(0)
observations, infos = envs.reset(seed=0)
actions = [envs.action_space.sample() for _ in range(options.steps)]
start = time.perf_counter()
for action in actions:
    observations, rewards, terminations, truncations, infos = envs.step(action)
seconds = time.perf_counter() - start
print(f"{envs.num_envs * options.steps / seconds:,.0f} camera steps/s with {envs.num_envs} cars, reward included")
envs.close()
