"""How a policy improves from a rollout: networks by name, PPO, and the learner that holds the weights.

Nothing here imports torch until ``make_learner`` is called.
"""

from racecraft.learn.learner import Learner, Minibatch, NetworkSpec, Objective, UpdateStats
from racecraft.learn.networks import forward_operations, initial_weights, network_names, parameter_count
from racecraft.learn.ppo import PPO, Environment, IterationStats, PPOConfig


def make_learner(spec: NetworkSpec, *, seed: int = 0, num_threads: int = 0) -> Learner:
    """The learner for this machine.

    Args:
        spec: The network.
        seed: Decides the initial weights.
        num_threads: Threads for forward and backward passes; 0 takes every core the process may use.
    """
    from racecraft.learn.torch_learner import (
        TorchLearner,
    )  # takes seconds: only when something is to be learned

    return TorchLearner(spec, seed=seed, num_threads=num_threads)


__all__ = [
    "PPO",
    "Environment",
    "IterationStats",
    "Learner",
    "Minibatch",
    "NetworkSpec",
    "Objective",
    "PPOConfig",
    "UpdateStats",
    "forward_operations",
    "initial_weights",
    "make_learner",
    "network_names",
    "parameter_count",
]
