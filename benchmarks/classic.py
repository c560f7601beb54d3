"""What the tuned pairs of `racecraft learn` reach and how long they take, with Stable-Baselines3 beside them.

    python benchmarks/classic.py --seeds 3 --json
    python benchmarks/classic.py --only CartPole-v1 --no-rival

Each run is a process of its own on one thread (A3C: as many as it starts). Time counts from the first step to the end
of learning, evaluations included, for both; imports do not count. `seconds` is wall clock, `cpu_seconds` processor time
of the process and its children: on one thread the same thing on a machine with nothing else to do, and what can still
be compared on a busy one. The rival learns with its PPO, A2C, DQN or SAC and the settings that its zoo of tuned agents
publishes, or its defaults, is evaluated as often on as many episodes at once, and stops at the same return; `share` is
our median processor time by its.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from typing import Any

BARS = {
    ("FrozenLake-v1", "q-table"): (0.70, 10.0),
    ("CliffWalking-v1", "q-table"): (-13.0, 10.0),
    ("CliffWalking-v1", "sarsa"): (-13.0, 10.0),
    ("Racecraft-v0", "q-table"): (None, 1.0),
    ("CartPole-v1", "dqn"): (475.0, 60.0),
    ("MountainCar-v0", "dqn"): (-110.0, 180.0),
    ("CartPole-v1", "reinforce"): (475.0, 60.0),
    ("Acrobot-v1", "a2c"): (-100.0, 60.0),
    ("Acrobot-v1", "a3c"): (-100.0, 60.0),
    ("CartPole-v1", "ppo"): (490.0, 60.0),
    ("Acrobot-v1", "ppo"): (-90.0, 60.0),
    ("Pendulum-v1", "sac"): (-180.0, 60.0),
}
"""Mean return of 100 greedy episodes, and seconds."""
RIVALS: dict[tuple[str, str], dict[str, Any]] = {
    ("CartPole-v1", "dqn"): {
        "kind": "DQN", "learning_rate": 2.3e-3, "batch_size": 64, "buffer_size": 100_000, "learning_starts": 1000,
        "target_update_interval": 10, "train_freq": 256, "gradient_steps": 128, "exploration_fraction": 0.16,
        "exploration_final_eps": 0.04, "policy_kwargs": {"net_arch": [256, 256]},
    },
    ("MountainCar-v0", "dqn"): {
        "kind": "DQN", "learning_rate": 4e-3, "batch_size": 128, "buffer_size": 10_000, "learning_starts": 1000,
        "gamma": 0.98, "target_update_interval": 600, "train_freq": 16, "gradient_steps": 8,
        "exploration_fraction": 0.2, "exploration_final_eps": 0.07, "policy_kwargs": {"net_arch": [256, 256]},
    },
    ("CartPole-v1", "ppo"): {
        "kind": "PPO", "num_envs": 8, "n_steps": 32, "batch_size": 256, "gae_lambda": 0.8, "gamma": 0.98,
        "n_epochs": 20, "learning_rate": 1e-3,
    },
    ("Acrobot-v1", "ppo"): {"kind": "PPO", "num_envs": 16, "n_steps": 256, "gae_lambda": 0.94, "n_epochs": 4},
    ("Acrobot-v1", "a2c"): {"kind": "A2C", "num_envs": 16},
    ("Pendulum-v1", "sac"): {"kind": "SAC", "learning_rate": 1e-3},
}  # fmt: skip
RIVAL_STEPS = {"MountainCar-v0": 120_000, "Pendulum-v1": 20_000}


def cpu() -> float:
    """s that this process and the children that it has waited for have computed."""
    mine, theirs = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return mine.ru_utime + mine.ru_stime + theirs.ru_utime + theirs.ru_stime


def ours(environment: str, algorithm: str, seed: int) -> dict[str, Any]:
    """One run of the plain command."""
    from racecraft.classic import learn

    begun = cpu()
    learned = learn(environment, algorithm, seed=seed)
    return {
        "cpu_seconds": cpu() - begun,  # before the last evaluation, which nobody has asked for yet
        "seconds": learned.wall_seconds,
        "learning_seconds": learned.learning_seconds,
        "steps": learned.steps,
        "mean_return": learned.mean_return,
        "training_return": learned.training_return,
        "reason": learned.reason,
    }


def rival(environment: str, algorithm: str, seed: int) -> dict[str, Any]:
    """The same pair with Stable-Baselines3, stopped at the bar."""
    import gymnasium
    import numpy as np
    import stable_baselines3
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.evaluation import evaluate_policy

    from racecraft.classic import find_recipe

    torch.set_num_threads(1)
    recipe = find_recipe(environment, algorithm)
    settings = dict(RIVALS[environment, algorithm])
    kind = getattr(stable_baselines3, settings.pop("kind"))
    worlds = make_vec_env(environment, n_envs=settings.pop("num_envs", 1), seed=seed)

    def judge(model: Any, episodes: int, first: int) -> float:
        judged = make_vec_env(environment, n_envs=episodes, seed=first)  # all at once, as ours
        mean, _ = evaluate_policy(model, judged, n_eval_episodes=episodes, warn=False)
        return float(np.mean(mean))

    class Stop(BaseCallback):
        asked = 0
        reason = "steps"

        def _on_step(self) -> bool:
            if self.num_timesteps - self.asked < recipe.evaluate_every:
                return True
            self.asked = self.num_timesteps
            is_done = judge(self.model, 20, 1000 + self.asked) >= recipe.goal
            is_done = is_done and judge(self.model, 100, 5_000_000 + self.asked) >= recipe.goal
            self.reason = "return" if is_done else "steps"
            return not is_done

    model, stop = kind("MlpPolicy", worlds, seed=seed, device="cpu", **settings), Stop()
    steps = RIVAL_STEPS.get(environment, recipe.settings.steps)
    started, begun = time.perf_counter(), cpu()
    model.learn(steps, callback=stop)
    seconds, cpu_seconds = time.perf_counter() - started, cpu() - begun
    assert gymnasium.spec(environment) is not None
    return {
        "cpu_seconds": cpu_seconds,
        "seconds": seconds,
        "steps": model.num_timesteps,
        "mean_return": judge(model, 100, 9_000_000),
        "reason": stop.reason,
    }


def measure(who: str, environment: str, algorithm: str, seed: int) -> dict[str, Any]:
    """One run in a process of its own."""
    variables = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"}
    command = [sys.executable, __file__, "--one", who, environment, algorithm, str(seed)]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return {"error": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "it failed"}
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default="", help="environment or algorithm, or both joined by a comma")
    parser.add_argument("--no-rival", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        who, environment, algorithm, seed = options.one
        print(json.dumps({"ours": ours, "rival": rival}[who](environment, algorithm, int(seed))))
        return
    wanted = set(filter(None, options.only.split(",")))
    rows = []
    for (environment, algorithm), (bar, limit) in BARS.items():
        if not wanted <= {environment, algorithm}:
            continue
        row: dict[str, Any] = {"environment": environment, "algorithm": algorithm, "bar": bar, "limit_seconds": limit}
        for who in ("ours", "rival"):
            if who == "rival" and (options.no_rival or (environment, algorithm) not in RIVALS):
                continue
            row[who] = [measure(who, environment, algorithm, seed) for seed in range(1, options.seeds + 1)]
            told = [run for run in row[who] if "error" not in run]
            line = ", ".join(
                f"{run['mean_return']:.2f} in {run['cpu_seconds']:.1f} ({run['seconds']:.1f}) s" for run in told
            )
            row[f"{who}_cpu_seconds"] = statistics.median(run["cpu_seconds"] for run in told) if told else None
            median = "failed" if not told else f"{row[f'{who}_cpu_seconds']:6.1f} s"
            print(f"{environment:16} {algorithm:10} {who:6} median {median}   {line}", file=sys.stderr, flush=True)
        if row.get("ours_cpu_seconds") and row.get("rival_cpu_seconds"):
            row["share"] = row["ours_cpu_seconds"] / row["rival_cpu_seconds"]
        rows.append(row)
    if options.json:
        print(
            json.dumps({"machine": platform.processor() or platform.machine(), "cores": os.cpu_count(), "rows": rows})
        )


if __name__ == "__main__":
    main()
