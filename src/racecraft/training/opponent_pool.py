"""Who drives the other cars of a race while a policy learns: its own past selves, or other runs.

learner's weights --now and then--> pool --drawn for every car and race--> commands of the other cars
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import CheckpointError
from racecraft.learn import Algorithm, Learner
from racecraft.learn.learner import Weights
from racecraft.race.policy import NetworkPolicy, load_driver
from racecraft.race.seeing import learner_of
from racecraft.sim import Simulation
from racecraft.training.opponents import Opponents

BESIDE_REACH: Final = 0.75
"""m that the other car of a race is at most ahead or behind where both begin beside each other: a place of the grid."""
BESIDE_SPEED: Final = 2.5
"""m/s that both then drive at most."""
CURRENT: Final = -1
"""Number of the policy that learns, among those of a pool."""
_PURPOSE: Final = 0x706F6F6C  # the draws of a pool never coincide with others of the same seed
_POLICY: Final = "policy."  # all that a past self needs of its weights


class OpponentPool:
    """Drives every car of a batch of races but one in each, the learner's.

    The learner is car ``i % K`` of race ``i``, so that it meets every place of the grid and every colour.

    Args:
        opponents: Who drives.
        simulation: The races.
        policy: The one that learns.
        seed: With the number of a race it decides who drives in it.
        num_threads: Of the policies.
        make_learner: Makes a past self's network, of the spec, with its weights to be loaded.

    Raises:
        RunError: A run does not exist.
        CheckpointError: A run has no checkpoint that can be read.
        ConfigError: A run sees with sensors that the cars do not have.
    """

    def __init__(
        self,
        opponents: Opponents,
        simulation: Simulation,
        policy: NetworkPolicy,
        *,
        seed: int,
        num_threads: int = 0,
        make_learner: Callable[..., Learner] = learner_of,
    ) -> None:
        self._settings = opponents
        self._simulation = simulation
        self._seed = seed
        self._num_threads = num_threads
        self._make_learner = make_learner
        size = simulation.cars_per_race
        races = np.arange(simulation.num_envs // size)
        self.own: NDArray[np.intp] = races * size + races % size
        """The learner's cars  (races,)."""
        self._others = np.setdiff1d(np.arange(simulation.num_envs), self.own)
        self._current = policy
        self._policies = [] if opponents.is_self else [load_driver(Path(run)) for run in opponents.drivers]
        for driver in self._policies:
            driver.sensors.read(simulation)
        self._steps: list[int] = []  # of the snapshots, rising
        self._interval = opponents.snapshot_every
        is_closed = all(track.is_closed for track in simulation.tracks)
        self._has_room = size == 2 and is_closed and simulation.objects.count == 0  # to begin beside each other
        self._drivers = np.full(simulation.num_envs, CURRENT, dtype=np.int32)  # by car
        self.draw(np.ones(len(races), dtype=np.bool_))

    def draw(self, races: NDArray[np.bool_]) -> None:
        """Choose who drives in the masked races (races,), which have just begun, and which of them begin rolling."""
        size, known = self._simulation.cars_per_race, len(self._policies)
        numbers = self._simulation.column("episode")[self.own].astype(np.int64)
        for race in np.flatnonzero(races).tolist():
            rng = np.random.default_rng([self._seed, _PURPOSE, race, int(numbers[race])])
            chance, choice = rng.random(size), rng.random(size)
            is_current = (chance < self._settings.current_share) if self._settings.is_self else np.zeros(size, np.bool_)
            drawn = np.minimum((choice * known).astype(np.int32), known - 1)
            self._drivers[race * size : (race + 1) * size] = np.where(is_current, CURRENT, drawn)
            if self._has_room and rng.random() < self._settings.beside_share:
                self._start_beside(race, rng)

    def _start_beside(self, race: int, rng: np.random.Generator) -> None:
        """Put the two cars of a race side by side, about where the learner stands, and let them roll."""
        simulation, own = self._simulation, int(self.own[race])
        gap, speed = rng.uniform(-BESIDE_REACH, BESIDE_REACH), rng.uniform(0.0, BESIDE_SPEED)
        place, offset = (float(simulation.column(name)[own]) for name in ("projection_distance", "offset"))
        lane = math.copysign(0.25 * simulation.driven_track(own).mean_width, offset)
        simulation.place(own, place, offset=lane, speed=speed)
        simulation.place(int(self._others[race]), place + gap, offset=-lane, speed=speed)

    def commands(self, own: NDArray[np.float32]) -> NDArray[np.float32]:
        """Commands of all cars (N, 2), from those of the learner's (races, 2)."""
        everyone = np.empty((self._simulation.num_envs, 2), dtype=np.float32)
        everyone[self.own] = own
        drivers = self._drivers[self._others]
        sights: dict[SensorSuite, NDArray[np.uint8]] = {}
        for driver in np.unique(drivers).tolist():
            cars = self._others[drivers == driver]
            policy = self._current if driver == CURRENT else self._policies[driver]
            if policy.sensors not in sights:
                sights[policy.sensors] = policy.sensors.read(self._simulation)
            everyone[cars] = policy(sights[policy.sensors][cars])
        return everyone

    def bring_back(self) -> None:
        """Put opponents whose episode is over back into races that go on."""
        simulation = self._simulation
        over = simulation.terminated | simulation.truncated
        goes_on = ~over[self.own]
        mask = over & np.repeat(goes_on, simulation.cars_per_race)
        if mask.any():
            simulation.reset(mask)

    # ---- past selves

    def learn_from(self, algorithm: Algorithm, *, step: int) -> None:
        """Take a snapshot of what is to drive, where one is due.

        Args:
            algorithm: What improves it.
            step: Camera steps of training so far.
        """
        if self.is_due(step):
            with algorithm.driving():
                self.keep(step)

    def is_due(self, step: int) -> bool:
        """Whether there is to be a snapshot now."""
        return self._settings.is_self and step >= (self._steps[-1] if self._steps else 0) + self._interval

    def keep(self, step: int) -> None:
        """Take it of the weights that the policy has, and make room when there are too many."""
        if len(self._steps) == self._settings.pool_size:
            self._thin()
        self._add(self._current.learner.weights(), step)

    def _add(self, weights: Weights, step: int) -> None:
        current = self._current
        learner = self._make_learner(current.learner.spec, seed=None, num_threads=self._num_threads)
        blank = learner.weights()
        learner.load_weights({**blank, **{name: weights[name] for name in weights if name.startswith(_POLICY)}})
        self._policies.append(NetworkPolicy(learner, current.action_space, sensors=current.sensors))
        self._steps.append(step)

    def _thin(self) -> None:
        """Forget every second snapshot, the newest excepted; who raced as one races on as the next newer."""
        kept = list(range(len(self._steps) - 1, -1, -2))[::-1]
        newer = np.array([min(i for i, old in enumerate(kept) if old >= before) for before in range(len(self._steps))])
        is_past = self._drivers >= 0
        self._drivers[is_past] = newer[self._drivers[is_past]]
        self._policies = [self._policies[old] for old in kept]
        self._steps = [self._steps[old] for old in kept]
        self._interval *= 2

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything the next step depends on, for a checkpoint."""
        arrays: dict[str, NDArray[Any]] = {
            "opponents/drivers": self._drivers.copy(),
            "opponents/steps": np.array([self._interval, *self._steps], np.int64),
        }
        if self._settings.is_self:
            for i, policy in enumerate(self._policies):
                for name, array in policy.learner.weights().items():
                    if name.startswith(_POLICY):
                        arrays[f"opponents/{i}/{name}"] = array
        return arrays

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue from what `state` gave.

        Raises:
            CheckpointError: It is of other races, or damaged.
        """
        try:
            drivers, numbers = state["opponents/drivers"], state["opponents/steps"].tolist()
        except KeyError as error:
            raise CheckpointError(f"The training state has no entry {error}.") from None
        known = len(numbers) - 1 if self._settings.is_self else len(self._policies)
        if drivers.shape != self._drivers.shape or drivers.min() < CURRENT or drivers.max() >= max(known, 1):
            raise CheckpointError("The training state is of other races: its opponents do not fit.")
        if self._settings.is_self:
            self._policies, self._steps = [], []
            for i, step in enumerate(numbers[1:]):
                prefix = f"opponents/{i}/"
                weights = {name.removeprefix(prefix): state[name] for name in state if name.startswith(prefix)}
                self._add(weights, int(step))
        self._interval = int(numbers[0])
        self._drivers[:] = drivers
