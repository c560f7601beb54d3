"""What PPO drives: simulation, reward worker and action space behind the learner's small `Environment` protocol.

    actions -> *action space* -> commands -> *simulation* -> rows -> *reward worker* -> rewards
                                                  └-> frames, state -> policy
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace
from racecraft.reward.worker import RewardWorker
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.simulation import Simulation

_STEPS, _PROGRESS, _STATUS, _EPISODE, _TIME = (
    ROW_COLUMNS.index(name) for name in ("steps", "progress", "status", "episode", "time")
)


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """A finished training episode of one car."""

    car: int
    """Which car of the batch."""
    episode: int
    """Number of the car's episode, from 0."""
    total_reward: float
    """Sum of the rewards."""
    progress: float
    """Fraction of a lap driven, 0 to 1."""
    status: int
    """How it ended, index into STATUS_NAMES."""
    duration: float
    """Simulated seconds."""


class Trace(Protocol):
    """Where judged steps are logged."""

    def add(
        self,
        rows: NDArray[np.float64],
        actions: NDArray[Any],
        rewards: NDArray[np.float64],
        done: NDArray[np.bool_],
    ) -> None:
        """Log one step of the traced cars, arrays (N, ...)."""


class TrainingEnvironment:
    """A batch of cars with rewards; an implementation of `racecraft.learn.Environment`.

    Args:
        simulation: The cars.
        worker: Pays them.
        action_space: Turns the policy's actions into commands.
        trace: Logs the steps of the first `traced_cars` cars; None for no log.
        traced_cars: How many cars of the batch are logged.
    """

    def __init__(
        self,
        simulation: Simulation,
        worker: RewardWorker,
        action_space: ActionSpace,
        *,
        trace: Trace | None = None,
        traced_cars: int = 0,
    ) -> None:
        self.simulation = simulation
        self.worker = worker
        self.action_space = action_space
        self.trace = trace
        self.traced_cars = traced_cars
        self.finished: list[EpisodeRecord] = []
        self.reward_seconds = 0.0
        self._totals = np.zeros(simulation.num_envs)

    @property
    def num_envs(self) -> int:
        """N, the number of cars."""
        return self.simulation.num_envs

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Frames (N, H, W) and privileged state (N, S) at the current poses, views."""
        return self.simulation.frames, self.simulation.state

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Drive one step: rewards, terminated, truncated, each (N,), the caller's to keep.

        Raises:
            RewardError: The user's function failed.
        """
        simulation = self.simulation
        simulation.step(self.action_space.to_commands(actions))
        rewards = self.worker(simulation.rows)
        terminated, truncated = simulation.terminated.copy(), simulation.truncated.copy()
        done = terminated | truncated
        self._totals += rewards
        if self.trace is not None:
            cars = slice(self.traced_cars)
            self.trace.add(simulation.rows[cars], actions[cars], rewards[cars], done[cars])
        for car in np.flatnonzero(done).tolist():
            row = simulation.rows[car]
            self.finished.append(
                EpisodeRecord(
                    car=car,
                    episode=int(row[_EPISODE]),
                    total_reward=float(self._totals[car]),
                    progress=float(min(max(row[_PROGRESS], 0.0), 1.0)),
                    status=int(row[_STATUS]),
                    duration=float(row[_TIME]),
                )
            )
            self._totals[car] = 0.0
        return rewards, terminated, truncated

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Put the cars of the mask (N,) at their next start."""
        self._totals[mask] = 0.0
        self.simulation.reset(mask)

    def take_finished(self) -> list[EpisodeRecord]:
        """The episodes that ended since the last call."""
        finished, self.finished = self.finished, []
        return finished

    def save(self) -> dict[str, NDArray[Any]]:
        """Everything the next step depends on, for `load`; globals of the user's reward function excepted."""
        return {"simulation": self.simulation.save(), "totals": self._totals.copy()}

    def load(self, saved: dict[str, NDArray[Any]]) -> None:
        """Continue from what `save` gave."""
        self.simulation.load(saved["simulation"])
        self._totals[:] = saved["totals"]
