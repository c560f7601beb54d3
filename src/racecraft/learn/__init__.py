"""How a policy improves from a rollout: networks by name, PPO, and the learner that holds the weights.

Nothing here imports torch unless ``make_learner`` is asked for the torch backend.
"""

from collections.abc import Callable
from typing import Any

from racecraft.checks import check_choice
from racecraft.extras import needed_for
from racecraft.learn.algorithm import Algorithm
from racecraft.learn.distill import Distill, DistillConfig
from racecraft.learn.learner import Learner, Minibatch, NetworkSpec, Objective, UpdateStats
from racecraft.learn.networks import (
    INITIAL_WEIGHTS,
    forward_operations,
    glorot_weights,
    initial_weights,
    network_names,
    parameter_count,
)
from racecraft.learn.ppo import PPO, Environment, IterationStats, PPOConfig
from racecraft.learn.sac import SAC, SACConfig


def make_learner(
    spec: NetworkSpec,
    *,
    seed: int | None = 0,
    initial_weights: str = "orthogonal",
    num_threads: int = 0,
    backend: str = "auto",
    device: str = "cpu",
    native: Callable[..., Learner] | None = None,
) -> Learner:
    """The learner for this machine.

    Args:
        spec: The network.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        initial_weights: Of which kind they are, one of `racecraft.learn.networks.INITIAL_WEIGHTS`.
        num_threads: Threads for forward and backward passes; 0 takes every core the process may use.
        backend: ``"native"``, ``"torch"`` (the reference, needs the extra ``torch``), or ``"auto"``: native.
        device: ``"cpu"``, or a GPU such as ``"cuda"``, which needs the extra ``cuda``.
        native: Makes a learner on the native core of spec, seed and num_threads; by default `NativeLearner` does.

    Raises:
        ConfigError: There is no such backend or kind of weights, or torch is not installed.
    """
    check_choice("initial_weights", initial_weights, INITIAL_WEIGHTS)
    if initial_weights == "glorot" and seed is not None:
        learner = make_learner(spec, seed=None, num_threads=num_threads, backend=backend, device=device, native=native)
        learner.load_weights(glorot_weights(spec, seed=seed))
        return learner
    if device != "cpu":
        with needed_for(f"Device {device!r}"):
            from racecraft.learn.torch_cuda_learner import CudaLearner  # takes seconds
        return CudaLearner(spec, seed=seed, device=device)
    check_choice("backend", backend, ("auto", "native", "torch"))
    if backend != "torch":
        from racecraft.learn.native_learner import NativeLearner  # loads the native core

        return (native or NativeLearner)(spec, seed=seed, num_threads=num_threads)
    with needed_for("The torch backend"):
        from racecraft.learn.torch_learner import TorchLearner  # takes seconds
    return TorchLearner(spec, seed=seed, num_threads=num_threads)


def make_cuda_ppo(config: PPOConfig, learner: Learner, environment: Any, *, seed: int = 0) -> PPO:
    """PPO whose rollout stays on the learner's device.

    Args:
        config: Settings.
        learner: Made by ``make_learner`` for a device.
        environment: A ``racecraft.learn.torch_cuda_ppo.DeviceEnvironment``.
        seed: Decides all sampling and shuffling, together with the number of the iteration.

    Raises:
        ConfigError: The settings do not fit.
    """
    from racecraft.learn.torch_cuda_learner import CudaLearner
    from racecraft.learn.torch_cuda_ppo import CudaPPO

    assert isinstance(learner, CudaLearner)
    return CudaPPO(config, learner, environment, seed=seed)


__all__ = [
    "PPO",
    "SAC",
    "Algorithm",
    "Distill",
    "DistillConfig",
    "Environment",
    "IterationStats",
    "Learner",
    "Minibatch",
    "NetworkSpec",
    "Objective",
    "PPOConfig",
    "SACConfig",
    "UpdateStats",
    "forward_operations",
    "initial_weights",
    "make_cuda_ppo",
    "make_learner",
    "network_names",
    "parameter_count",
]
