"""The one account of episodes: what every car has been paid since its episode began, and in how many steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Ended(NamedTuple):
    """An episode that is over."""

    car: int
    total: float
    """Undiscounted sum of its rewards."""
    length: int
    """Steps."""


class EpisodeLedger:
    """Adds up the steps of N cars, which drive side by side, into episodes.

    Args:
        num_envs: N.
    """

    def __init__(self, num_envs: int) -> None:
        self.totals = np.zeros(num_envs)
        """Sum of rewards of the episode under way  (N,)."""
        self.lengths = np.zeros(num_envs, np.int64)
        """Steps of the same  (N,)."""

    def add(
        self, rewards: NDArray[Any], done: NDArray[np.bool_], *, is_counted: NDArray[np.bool_] | bool = True
    ) -> list[Ended]:
        """Enter one step of every car.

        Args:
            rewards: (N,)
            done: Which episodes end with this step, terminated or truncated  (N,).
            is_counted: Which cars' episodes are told when they end; of the others they are forgotten  (N,).

        Returns:
            The episodes that ended, by car.
        """
        self.totals += rewards
        self.lengths += 1
        cars = np.flatnonzero(done & is_counted)
        ended = list(map(Ended, cars.tolist(), self.totals[cars].tolist(), self.lengths[cars].tolist()))
        self.forget(done)
        return ended

    def forget(self, cars: NDArray[np.bool_]) -> None:
        """Begin anew for the cars of the mask (N,)."""
        self.totals[cars], self.lengths[cars] = 0.0, 0
