"""Train with Stable-Baselines3's PPO, from the state so that it takes a minute and not an hour; then drive.

pip install stable-baselines3
python examples/stable_baselines3_ppo.py --steps 50000
"""

import argparse

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from racecraft.env import RacecraftEnv

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--steps", type=int, default=50_000, help="training steps")
parser.add_argument("--track", default="oval", help="see 'racecraft tracks'")
parser.add_argument("--observation", default="state", choices=["state", "camera", "both"])
options = parser.parse_args()
policy = {"state": "MlpPolicy", "camera": "CnnPolicy", "both": "MultiInputPolicy"}[options.observation]


def make_env() -> RacecraftEnv:
    return RacecraftEnv(options.track, observation=options.observation, max_episode_steps=1000)


envs = VecMonitor(DummyVecEnv([make_env] * 8))
learner = PPO(policy, envs, n_steps=128, batch_size=256, gamma=0.98, ent_coef=0.01, seed=0, device="cpu", verbose=1)
learner.learn(options.steps)
envs.close()


with RacecraftEnv(options.track, observation=options.observation, start="fixed", max_episode_steps=1000) as env:
    observation, info = env.reset(seed=1)
    terminated = truncated = False
    while not (terminated or truncated):
        action, _ = learner.predict(observation, deterministic=True)
        observation, reward, terminated, truncated, info = env.step(action)
print(f"{info['status']} after {info['progress']:.1%} of a lap and {info['time']:.2f} s")
