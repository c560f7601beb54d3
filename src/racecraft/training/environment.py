"""What PPO drives: simulation, reward worker and action space behind the learner's `Environment` protocol.

actions -> *action space* -> commands -> *simulation* -> rows -> *reward worker* -> rewards
                                              └-> frames, state -> policy
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace
from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.errors import RewardError, RunError
from racecraft.reward.worker import RewardWorker
from racecraft.run import Episode, EpisodeCounter, PrintLog, SimTraceWriter
from racecraft.sim import CudaSimulation, Simulation
from racecraft.sim.camera import CAMERAS
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.track import Track
from racecraft.training.lap_view import NOTHING, LapTeller, LapView
from racecraft.training.nearby_view import NearbyTeller
from racecraft.training.rival_view import tell_rivals
from racecraft.training.settings import TrainSettings

if TYPE_CHECKING:
    from racecraft.training.opponent_pool import OpponentPool

_STATUS: Final = ROW_COLUMNS.index("status")
_LAP_COMPLETE: Final = STATUS_NAMES.index("lap_complete")


class TrainingEnvironment:
    """A batch of cars with rewards; an implementation of `racecraft.learn.Environment`.

    With opponents every race has one car that learns; the others are nobody's business but theirs.

    Args:
        simulation: The cars.
        worker: Pays them.
        action_space: Turns the policy's actions into commands.
        counter: Numbers the episodes.
        sensors: What the policy sees through.
        trace: Logs every step; None for no log.
        prints: Keeps what the reward function prints; None drops it.
        opponents: Drive the other cars of every race; None where each car races alone.
        goes_on: Whether the road goes on behind the finish line for who learns. Who is to be fast must cross it as one
            who drives on, and neither camera nor state says how far it is, so an end there would only look like
            chance: with this a lap's end cuts the episode, and the critic's value stands for what follows.
        lap_view: What of its lap the privileged state ends in.
        tells_nearby: Whether it tells of the nearest object behind that.
        tells_rivals: Whether it tells of the other cars of the race behind that.
        on_step: Called after every step, for who looks at the cars.
    """

    def __init__(
        self,
        simulation: Simulation,
        worker: RewardWorker,
        action_space: ActionSpace,
        *,
        counter: EpisodeCounter,
        sensors: SensorSuite = FRONT_CAMERA,
        trace: SimTraceWriter | None = None,
        prints: PrintLog | None = None,
        opponents: OpponentPool | None = None,
        goes_on: bool = False,
        lap_view: LapView = NOTHING,
        tells_nearby: bool = False,
        tells_rivals: bool = False,
        on_step: Callable[[], None] = lambda: None,
    ) -> None:
        self.simulation = simulation
        self.worker = worker
        self.action_space = action_space
        self.counter = counter
        self.sensors = sensors
        self.trace = trace
        self.prints = prints
        self.opponents = opponents
        self.goes_on = goes_on
        self._lap = LapTeller(lap_view, simulation) if lap_view.size else None
        self._nearby = NearbyTeller(simulation) if tells_nearby else None
        self._tells_rivals = tells_rivals
        self._on_step = on_step
        self._own: slice | NDArray[np.intp] = slice(None) if opponents is None else opponents.own
        self.reward_seconds = 0.0
        self.trace_seconds = 0.0
        self._finished: list[Episode] = []
        self._is_driving = np.ones(self.num_envs, bool)  # not between an episode's end and the next reset

    @property
    def shown(self) -> Simulation:
        """The cars that somebody may watch."""
        return self.simulation

    @property
    def num_envs(self) -> int:
        """N, the number of cars that learn."""
        return self.simulation.num_envs // self.simulation.cars_per_race

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """What the sensors tell, as `SensorSuite.read` has it, and privileged state (N, S) at the current poses."""
        return self.sensors.read(self.simulation)[self._own], self.tell_state()

    def tell_state(self) -> NDArray[np.float32]:
        """The privileged state alone; what it ends in of the lap and of rivals is of the last judged step."""
        return self.tell_states()[self._own]

    def tell_states(self) -> NDArray[np.float32]:
        """The same of all cars, those of opponents, too."""
        told = [self.simulation.state]
        if self._lap is not None:
            told.append(self._lap())
        if self._nearby is not None:
            told.append(self._nearby())
        if self._tells_rivals:
            told.append(tell_rivals(self.simulation))
        return told[0] if len(told) == 1 else np.concatenate(told, axis=1)

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Drive one step: rewards, terminated, truncated, each (N,), the caller's to keep.

        Raises:
            RewardError: The user's function failed.
        """
        simulation = self.simulation
        commands = self.action_space.to_commands(actions)
        simulation.step(commands if self.opponents is None else self.opponents.commands(commands))
        rows = simulation.rows[self._own]
        moved = time.perf_counter()
        try:
            rewards = self.worker(simulation.judged[self._own])
        except RewardError:
            with suppress(RunError):  # the first error is the one to tell
                self._keep_prints()
            raise
        self._keep_prints()
        paid = time.perf_counter()
        terminated, truncated = (flags[self._own].copy() for flags in (simulation.terminated, simulation.truncated))
        done = (terminated | truncated) & self._is_driving
        ended = self.counter.update(rows, rewards, done)
        self._finished += ended
        self._is_driving &= ~done
        if self.trace is not None:
            self.trace.write(rows, actions=actions, rewards=rewards, ended=ended)
        if self.opponents is not None:
            self.opponents.bring_back()
        self.reward_seconds += paid - moved
        self.trace_seconds += time.perf_counter() - paid
        self._on_step()
        if self.goes_on:
            is_lap = terminated & (rows[:, _STATUS] == _LAP_COMPLETE)
            return rewards, terminated & ~is_lap, truncated | is_lap
        return rewards, terminated, truncated

    def _keep_prints(self) -> None:
        if self.prints is not None and (text := self.worker.read_log()):
            self.prints.write(text, lost=self.worker.num_lost)

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Put the cars of the mask (N,) at their next start; what they were driving does not count."""
        self._is_driving |= mask
        self.counter.abandon(mask)
        if self.trace is not None:
            self.trace.abandon(mask)
        self.simulation.reset(np.repeat(mask, self.simulation.cars_per_race))
        if self.opponents is not None:
            self.opponents.draw(mask)

    def take_finished(self) -> list[Episode]:
        """The episodes that ended since the last call."""
        finished, self._finished = self._finished, []
        return finished


def open_simulation(
    settings: TrainSettings, tracks: Sequence[Track], sensors: SensorSuite
) -> Simulation | CudaSimulation:
    """The cars of a training, on its device.

    Raises:
        ConfigError: There is no such device.
    """
    common: dict[str, Any] = {
        "num_envs": settings.num_envs * settings.cars_per_race,
        "cars_per_race": settings.cars_per_race,
        "seed": settings.seed,
        "vehicle": settings.vehicle,
        "start": settings.start,
        "direction": settings.direction,
        "track_order": "random" if len(tracks) > 1 else "fixed",
        "randomize": settings.randomize,
        "objects": settings.objects,
        **sensors.simulation_settings(CAMERAS[settings.camera]),
    }
    if settings.device == "cpu":
        return Simulation(tracks, num_threads=settings.num_threads, **common)
    return CudaSimulation(tracks, device=settings.device, **common)
