"""Drivers of the other cars of a race: frozen policies, an autopilot, whatever turns what it sees into commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.errors import ConfigError, ShapeError
from racecraft.sim import Simulation

Driver = Callable[[NDArray[Any]], NDArray[np.float32]]
"""From what N cars see to commands (N, 2), steering angle in rad and speed in m/s. It sees the frames of the front
camera, uint8 (N, 120, 160); or, where it has an attribute ``sensors``, what this `SensorSuite` reads; or, where its
attribute ``sees`` is ``"state"``, the privileged state, float32 (N, S). One that remembers has a method ``forget``,
which is called when its car begins an episode; it is told the numbers of the cars that it sees for, too, intp (N,)."""

MAX_OPPONENTS = 7


def check_opponents(opponents: Sequence[Driver]) -> tuple[Driver, ...]:
    """The drivers, refused where they are none.

    Raises:
        ConfigError: They are not callables, or too many for one track.
    """
    if callable(opponents) or isinstance(opponents, str) or not isinstance(opponents, Sequence):
        raise ConfigError(f"opponents are {opponents!r}; allowed is a list of drivers, such as [Autopilot()].")
    for opponent in opponents:
        if not callable(opponent):
            raise ConfigError(
                f"An opponent is {opponent!r}; allowed is a driver, called with what it sees.",
                hint="racecraft.race.load_driver('runs/NAME') gives that of a run.",
            )
    if len(opponents) > MAX_OPPONENTS:
        raise ConfigError(f"There are {len(opponents)} opponents; allowed are up to {MAX_OPPONENTS}.")
    return tuple(opponents)


class Opponents:
    """Drives the cars 1 to K - 1 of a race; car 0 is the learner's.

    Args:
        simulation: One race.
        drivers: One for each of the other cars.

    Raises:
        ConfigError: A driver needs a camera that the cars do not have.
    """

    def __init__(self, simulation: Simulation, drivers: Sequence[Driver]) -> None:
        self._drivers = tuple(drivers)
        self._simulation = simulation
        for driver in self._drivers:
            try:
                self._sight(driver)
            except ConfigError as error:
                raise ConfigError(
                    f"An opponent cannot see. {error}",
                    hint="Give the environment the sensors of its opponents, or opponents that see the state.",
                ) from error

    def _sight(self, driver: Driver) -> NDArray[Any]:
        if getattr(driver, "sees", "") == "state":
            return self._simulation.state
        sensors: SensorSuite = getattr(driver, "sensors", FRONT_CAMERA)
        return sensors.read(self._simulation)

    def begin(self, cars: NDArray[np.bool_]) -> None:
        """Let the drivers of these cars, which begin an episode, forget what was before it  (K,)."""
        for car, driver in enumerate(self._drivers, start=1):
            memory = _memory_of(driver)
            if cars[car] and memory is not None:
                memory.forget()

    def commands(self, own: NDArray[np.float32]) -> NDArray[np.float32]:
        """Commands of all cars (K, 2), those of the learner's (1, 2) first.

        Raises:
            ShapeError: A driver does not give one command.
        """
        everyone = np.empty((1 + len(self._drivers), 2), dtype=np.float32)
        everyone[0] = own[0]
        for car, driver in enumerate(self._drivers, start=1):
            seen = self._sight(driver)[car : car + 1]
            memory = _memory_of(driver)
            command = np.asarray(driver(seen) if memory is None else memory(seen, np.array([car])))
            if command.shape != (1, 2):
                raise ShapeError(f"Opponent {car} gave commands of shape {command.shape}, expected (1, 2).")
            everyone[car] = command[0]
        return everyone


def _memory_of(driver: Any) -> Any:
    """The driver itself where it remembers, else None."""
    return driver if callable(getattr(driver, "forget", None)) else None
