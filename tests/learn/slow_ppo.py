"""PPO's loop in NumPy, row by row as it is told in papers: what the core's loop must give to the bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from racecraft import _native
from racecraft.learn import Learner, Minibatch, PPOConfig, distributions


def iterate(config: PPOConfig, learner: Learner, world: Any, *, seed: int, iteration: int, memory: dict) -> int:
    """One iteration; `memory` keeps the camera steps and the returns' mean and spread. How many steps were driven."""
    rng = np.random.default_rng([seed, iteration])
    cars, episodes, spec = config.num_envs, config.episodes_per_iteration, learner.spec
    quota = np.full(cars, 2**60)
    budget, rows = config.num_steps * cars, config.num_steps
    if episodes:
        quota = np.array([episodes // cars + (car < episodes % cars) for car in range(cars)])
        budget = config.max_steps_per_iteration
        rows = -(-budget // min(cars, episodes))
        world.reset(np.ones(cars, bool))
    mean, spread = memory.get("scale", (0.0, 1.0))

    def value_of(observations, states):
        return (learner.values(observations, states).astype(float) * spread + mean).astype(np.float32)

    steps = []
    while budget > 0 and quota.any() and len(steps) < rows:
        frames, states = world.observe()
        step = {"observations": learner.encode(frames), "states": states[:, : spec.state_size].copy()}
        outputs = learner.policy(step["observations"])
        if config.exploration == "e-greedy":
            share = min(memory["steps"] / config.epsilon_steps, 1.0) if config.epsilon_steps else 1.0
            epsilon = config.epsilon_start + (config.epsilon_end - config.epsilon_start) * share
            is_random = rng.random(cars) < epsilon
            actions = np.where(is_random, rng.integers(spec.num_actions, size=cars), outputs.argmax(1))
        else:
            noise = distributions.noise_for(cars, num_actions=spec.num_actions, is_discrete=spec.is_discrete, rng=rng)
            actions = distributions.sample(outputs, noise, is_discrete=spec.is_discrete)
        step["log_probs"] = distributions.log_prob(outputs, actions, is_discrete=spec.is_discrete)
        step["actions"], step["is_valid"] = actions, quota > 0
        rewards, terminated, truncated = world.step(actions if spec.is_discrete else actions.clip(-1.0, 1.0))
        step |= {"rewards": rewards.astype(np.float32), "terminated": terminated, "cut": truncated & ~terminated}
        frames, states = world.observe()
        step["next"] = value_of(learner.encode(frames), states[:, : spec.state_size].copy())
        steps.append(step)
        done, driving = terminated | truncated, step["is_valid"]
        budget -= driving.sum()
        memory["steps"] += int(driving.sum())
        if episodes:
            quota = quota - (done & driving)
        if (done & (quota > 0)).any():
            world.reset(done & (quota > 0))

    table = {name: np.stack([step[name] for step in steps]) for name in steps[0]}
    flat = {name: np.concatenate(column) for name, column in table.items()}
    values = value_of(flat["observations"], flat["states"]).reshape(table["rewards"].shape)
    advantages, carried = np.zeros_like(values), np.zeros(cars, np.float32)
    gamma, decay = np.float32(config.gamma), np.float32(config.gamma * config.gae_lambda)
    for t in reversed(range(len(steps))):
        is_last = t == len(steps) - 1
        following = table["next"][t] if is_last else np.where(table["cut"][t], table["next"][t], values[t + 1])
        following = np.where(table["terminated"][t], np.float32(0), following)
        delta = table["rewards"][t] + gamma * following - values[t]
        carried = delta + decay * np.where(table["terminated"][t] | table["cut"][t], np.float32(0), carried)
        advantages[t] = carried
    returns, advantages = (advantages + values).ravel(), advantages.ravel()
    used = np.flatnonzero(flat["is_valid"])
    if config.normalize_returns:
        seen = _native.moments(returns[used])
        seen = np.array([seen[0], max(seen[1], 1e-6)])
        memory["scale"] = seen if iteration == 0 else 0.9 * np.array([mean, spread]) + 0.1 * seen
        mean, spread = memory["scale"]
    centre, scale = _native.moments(advantages[used])
    minibatch = Minibatch(
        **{name: flat[name] for name in ("observations", "states", "actions", "log_probs")},
        advantages=(advantages - np.float32(centre)) / np.float32(scale + 1e-8),
        returns=((returns.astype(float) - mean) / spread).astype(np.float32),
    )
    objective = config.objective
    if config.rate_steps:
        objective = replace(objective, learning_rate=config.learning_rate / (1 + memory["steps"] / config.rate_steps))
    size = min(config.minibatch_size, len(used))
    for _ in range(config.update_epochs):
        order = rng.permutation(used)
        for start in range(0, len(used) - size + 1, size):
            learner.update(replace(minibatch, rows=order[start : start + size]), objective)
    return len(used)
