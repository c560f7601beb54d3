"""From the rows of many cars at once to a sequence of whole episodes, as a single car would have driven them.

AWS's logs and metrics number episodes one after the other on one simulated clock. Here cars drive side by
side, so an episode gets its number and its place on the clock when it ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.learn.ledger import EpisodeLedger
from racecraft.sim import CONTROL_DT
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES

_STEPS, _PROGRESS, _STATUS, _TIME = (ROW_COLUMNS.index(name) for name in ("steps", "progress", "status", "time"))


@dataclass(frozen=True)
class Episode:
    """How an episode went."""

    number: int
    """From 0, in the order in which the episodes of the run ended."""
    env: int
    """The car that drove it."""
    steps: int
    """Steps, with the first one that only prepares."""
    reward: float
    """Sum of its rewards."""
    progress: float
    """Share of the lap at the end, 0 to 1."""
    status: str
    """Why it ended, of STATUS_NAMES; ``in_progress`` when it was cut."""
    start_time: float
    """On the run's simulated clock, s."""
    duration: float
    """Simulated s."""

    @property
    def end_time(self) -> float:
        """On the run's simulated clock, s."""
        return self.start_time + self.duration


class EpisodeCounter:
    """Numbers the episodes of N cars and places them on one clock.

    Args:
        num_envs: N.
        number: Number of the next episode; a resumed run goes on counting.
        clock: Simulated time at which it begins, s.
    """

    def __init__(self, num_envs: int, *, number: int = 0, clock: float = 0.0) -> None:
        self.number = number
        self.clock = clock
        self._ledger = EpisodeLedger(num_envs)

    @property
    def rewards(self) -> NDArray[np.float64]:
        """Sums of the episodes under way  (N,), to be written to when a run is resumed."""
        return self._ledger.totals

    def update(self, rows: NDArray[np.float64], rewards: ArrayLike, done: NDArray[np.bool_]) -> list[Episode]:
        """Count one step of every car and return the episodes it ended.

        Args:
            rows: The judged rows of the step   (N, len(ROW_COLUMNS)).
            rewards: Their rewards   (N,).
            done: Which episodes end with this step, terminated or truncated   (N,).
        """
        ended = self._ledger.add(np.asarray(rewards, np.float64), done)
        return [self.end(car, rows[car], reward=total) for car, total, _ in ended]

    def abandon(self, mask: NDArray[np.bool_]) -> None:
        """Forget the episodes that the cars of the mask (N,) have under way; they get no number."""
        self._ledger.forget(mask)

    def place(self, duration: float) -> float:
        """Put something of this duration, an evaluation episode say, on the clock; returns when it starts."""
        start = self.clock
        self.clock = start + duration + CONTROL_DT
        return start

    def end(self, env: int, row: NDArray[np.float64], *, reward: float) -> Episode:
        """Number an episode by its last judged row and the sum of its rewards."""
        duration = float(row[_TIME])
        episode = Episode(
            number=self.number,
            env=env,
            steps=int(row[_STEPS]),
            reward=reward,
            progress=float(row[_PROGRESS]),
            status=STATUS_NAMES[int(row[_STATUS])],
            start_time=self.place(duration),
            duration=duration,
        )
        self.number += 1
        return episode
