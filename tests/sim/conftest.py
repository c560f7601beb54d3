from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from racecraft.sim import STATUS_NAMES, Simulation
from racecraft.track import Track


@pytest.fixture(scope="session")
def road() -> Track:
    """A straight open road along x, 40 m long and 1 m wide, with left and right in plain numbers."""
    x = np.linspace(0.0, 40.0, 81)
    return Track("road", *(np.stack((x, np.full_like(x, y)), axis=1) for y in (0.0, 0.5, -0.5)))


@pytest.fixture(scope="session")
def status() -> Callable[..., str]:
    """The status of a car in its last step, in words."""
    return lambda simulation, env=0: STATUS_NAMES[int(simulation.column("status")[env])]


@pytest.fixture(scope="session")
def choose() -> Callable[..., np.ndarray]:
    """What cars do in a step: mostly gentle, some wild, one in five standing; the same whatever the batch."""

    def choose(step: int, cars: np.ndarray, seed: int = 0) -> np.ndarray:
        actions = np.empty((len(cars), 2), dtype=np.float32)
        for i, car in enumerate(cars.tolist()):
            draw = np.random.default_rng((seed, car, step // 4)).uniform(-1.0, 1.0, 2)
            speed = min(2.0 + 2.5 * draw[1], 4.0)  # rows tell higher ones as they are
            actions[i] = draw[0] * (0.6 if car % 3 == 0 else 0.2), 0.0 if car % 5 == 4 else speed
        return actions

    return choose


@pytest.fixture(scope="session")
def record() -> Callable[..., list[bytes]]:
    """Everything that a step shows of each car, as bytes."""

    def record(simulation: Simulation) -> list[bytes]:
        arrays = [simulation.rows, simulation.state, simulation.frames, simulation.vehicles.T]
        arrays += [simulation.terminated, simulation.truncated]
        return [b"".join(array[env].tobytes() for array in arrays) for env in range(simulation.num_envs)]

    return record
