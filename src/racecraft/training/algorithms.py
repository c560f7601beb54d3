"""The algorithms by name, and how one is made for a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import ActionSpace
from racecraft.extras import needed_for
from racecraft.learn import PPO, SAC, Algorithm, Distill, Environment, Learner, make_cuda_ppo
from racecraft.learn.distill import TEACHER_PPO
from racecraft.reward import RewardWorker, keeps_state
from racecraft.run import EpisodeCounter
from racecraft.sim import Simulation
from racecraft.track import Track
from racecraft.training.cuda_environment import CudaTrainingEnvironment
from racecraft.training.environment import TrainingEnvironment
from racecraft.training.settings import TrainSettings

TEACHER_SEED: Final = 0x74656163
"""The teacher's starts are not its student's."""


def make_algorithm(
    settings: TrainSettings,
    learner: Learner,
    environment: Environment | CudaTrainingEnvironment,
    *,
    open_teacher: Callable[[], Environment],
) -> Algorithm:
    """The algorithm of a run.

    Args:
        settings: Of the run.
        learner: The network that drives; PPO learns with it.
        environment: The cars.
        open_teacher: Makes cars without a camera, for a teacher.

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
        return Distill(settings.distill, learner, environment, open_teacher(), seed=seed, num_threads=threads)
    if settings.algorithm.startswith("sb3:"):
        torch_sb3 = _import("torch_sb3", settings.algorithm)
        name = settings.algorithm.removeprefix("sb3:")
        made: Algorithm = torch_sb3.SB3(name, settings.sb3, learner, environment, seed=seed, num_threads=threads)
        return made
    return PPO(settings.ppo, learner, environment, seed=seed)


class _WithoutCamera(TrainingEnvironment):
    """Cars that tell their state only."""

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """No frames, and the privileged state (N, S)."""
        return np.zeros((self.num_envs, 0), np.uint8), self.tell_state()


def teacher_environment(
    settings: TrainSettings,
    source: str,
    tracks: Sequence[Track],
    action_space: ActionSpace,
    stack: ExitStack,
    *,
    foreign: bool = False,
) -> TrainingEnvironment:
    """Cars for a teacher: the run's tracks, car and reward function, no camera, no logs.

    Args:
        settings: Of the run.
        source: Its reward function.
        tracks: Its tracks.
        action_space: Its actions.
        stack: Closes the reward's process.
        foreign: The reward function is somebody else's.
    """
    num_envs = TEACHER_PPO.num_envs
    simulation = Simulation(
        list(tracks),
        num_envs=num_envs,
        seed=(settings.seed + TEACHER_SEED) % 2**32,
        vehicle=settings.vehicle,
        camera=None,
        start=replace(settings.start, spread=True),
        direction=settings.direction,
        track_order="random" if len(tracks) > 1 else "fixed",
        objects=settings.objects,
        num_threads=settings.num_threads,
    )
    worker = stack.enter_context(
        RewardWorker(
            source,
            list(tracks),
            seed=settings.seed,
            num_cars=num_envs if keeps_state(source) else 1,
            num_objects=settings.objects.count,
            foreign=foreign,
        )
    )
    return _WithoutCamera(
        simulation,
        worker,
        action_space,
        counter=EpisodeCounter(num_envs),
        goes_on=True,
        lap_view=settings.lap_view,
    )


def _import(module: str, algorithm: str) -> Any:
    """A backend that takes seconds to import, or may not be there."""
    import importlib

    with needed_for(f"--algorithm {algorithm}"):
        return importlib.import_module(f"racecraft.learn.{module}")
