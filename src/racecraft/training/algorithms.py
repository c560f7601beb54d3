"""The algorithms by name, and how one is made for a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from racecraft.extras import needed_for
from racecraft.learn import PPO, SAC, Algorithm, Distill, Environment, Learner, make_cuda_ppo
from racecraft.training.cuda_environment import CudaTrainingEnvironment
from racecraft.training.settings import TrainSettings


def make_algorithm(
    settings: TrainSettings,
    learner: Learner,
    environment: Environment | CudaTrainingEnvironment,
    *,
    open_teacher: Callable[[Learner], Environment],
) -> Algorithm:
    """The algorithm of a run.

    Args:
        settings: Of the run.
        learner: The network that drives; PPO learns with it.
        environment: The cars.
        open_teacher: Makes the cars of a teacher, without a camera.

    Raises:
        ConfigError: It needs a package that is not installed, or does not go with the actions.
    """
    seed, threads = settings.seed, settings.num_threads
    if isinstance(environment, CudaTrainingEnvironment):
        return make_cuda_ppo(settings.ppo, learner, environment, seed=seed)
    if settings.algorithm == "sac":
        torch_sac = _import("torch_sac", "sac")
        state_size = learner.spec.state_size
        backend = torch_sac.TorchSAC(learner.spec, settings.sac, state_size=state_size, seed=seed, num_threads=threads)
        return SAC(settings.sac, backend, learner, environment, seed=seed)
    if settings.algorithm == "distill":
        return Distill(settings.distill, learner, environment, open_teacher, seed=seed, num_threads=threads)
    if settings.algorithm.startswith("sb3:"):
        torch_sb3 = _import("torch_sb3", settings.algorithm)
        name = settings.algorithm.removeprefix("sb3:")
        made: Algorithm = torch_sb3.SB3(name, settings.sb3, learner, environment, seed=seed, num_threads=threads)
        return made
    return PPO(settings.ppo, learner, environment, seed=seed)


def _import(module: str, algorithm: str) -> Any:
    """A backend that takes seconds to import, or may not be there."""
    import importlib

    with needed_for(f"--algorithm {algorithm}"):
        return importlib.import_module(f"racecraft.learn.{module}")
