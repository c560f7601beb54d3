"""A teacher's cars: the run's, without camera and logs; in a race its opponents are what it was itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import ActionSpace
from racecraft.agent.sensor_suite import SensedCars, SensorSuite
from racecraft.learn import Learner
from racecraft.learn.distill import TEACHER_PPO
from racecraft.learn.native_state_learner import NativeStateLearner
from racecraft.race.policy import NetworkPolicy
from racecraft.reward import RewardWorker, keeps_state
from racecraft.run import EpisodeCounter
from racecraft.sim import Simulation
from racecraft.track import Track
from racecraft.training.environment import TrainingEnvironment
from racecraft.training.opponent_pool import OpponentPool
from racecraft.training.opponents import SELF
from racecraft.training.settings import TrainSettings

TEACHER_SEED: Final = 0x74656163
"""The teacher's starts are not its student's."""


class TeachersEnvironment(TrainingEnvironment):
    """Cars that tell their state only."""

    num_steps = 0
    """Of all cars that learn, so far."""

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """No frames, and the privileged state (N, S)."""
        return np.zeros((self.num_envs, 0), np.uint8), self.tell_state()

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """As of every training; past selves follow by themselves, as no job looks after them."""
        paid = super().step(actions)
        self.num_steps += self.num_envs
        if self.opponents is not None and self.opponents.is_due(self.num_steps):
            self.opponents.keep(self.num_steps)
        return paid


@dataclass(frozen=True, kw_only=True, eq=False)
class _States(SensorSuite):
    """What a teacher sees by in place of its student's sensors."""

    tell: Callable[[], NDArray[np.float32]]

    def read(self, simulation: SensedCars) -> NDArray[Any]:
        """The states of all cars  (N, S)."""
        return self.tell()


def teacher_environment(
    settings: TrainSettings,
    source: str,
    tracks: Sequence[Track],
    action_space: ActionSpace,
    stack: ExitStack,
    teacher: Learner,
    *,
    foreign: bool = False,
) -> TeachersEnvironment:
    """Cars for a teacher: the run's tracks, car and reward function.

    In a race every one of them meets the teacher and what it was before, whoever its student will meet.

    Args:
        settings: Of the run.
        source: Its reward function.
        tracks: Its tracks.
        action_space: Its actions.
        stack: Closes the reward's process.
        teacher: Who learns.
        foreign: The reward function is somebody else's.
    """
    num_envs, seed, threads = TEACHER_PPO.num_envs, settings.seed, settings.num_threads
    races = settings.opponents
    simulation = Simulation(
        list(tracks),
        num_envs=num_envs * settings.cars_per_race,
        cars_per_race=settings.cars_per_race,
        seed=(seed + TEACHER_SEED) % 2**32,
        vehicle=settings.vehicle,
        camera=None,
        start=replace(settings.start, spread=True) if races is None else settings.start,
        direction=settings.direction,
        track_order="random" if len(tracks) > 1 else "fixed",
        objects=settings.objects,
        num_threads=threads,
    )
    worker = stack.enter_context(
        RewardWorker(
            source,
            list(tracks),
            seed=seed,
            num_cars=num_envs if keeps_state(source) else 1,
            num_objects=settings.num_objects,
            foreign=foreign,
        )
    )
    opponents = None
    if races is not None:
        policy = NetworkPolicy(teacher, action_space, sensors=_States(tell=lambda: environment.tell_states()))
        opponents = OpponentPool(
            replace(races, drivers=(SELF,)),
            simulation,
            policy,
            seed=seed,
            num_threads=threads,
            make_learner=NativeStateLearner,
        )
    environment = TeachersEnvironment(
        simulation,
        worker,
        action_space,
        counter=EpisodeCounter(num_envs),
        opponents=opponents,
        goes_on=True,
        lap_view=settings.lap_view,
        tells_nearby=settings.tells_nearby,
        tells_rivals=settings.tells_rivals,
    )
    return environment
