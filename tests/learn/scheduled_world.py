"""A world without chance: how long every episode is stands in a table, so that sums and counts are known by hand."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

STANDING = 1000.0  # what a car is paid that was not reset after its episode, which ends in every step: it means nothing


def ticking() -> Callable[[], float]:
    """A clock for `time.perf_counter` that is a second later whenever it is looked at."""
    return map(float, itertools.count()).__next__


class ScheduledWorld:
    """Cars that are paid `rewards[car]` a step, whatever they do; their episodes last what the table says.

    Args:
        lengths: Steps of each car's episodes, one after the other, and then from the first again.
        rewards: Of each car, a step.
        cars_cut: Cars whose episodes are truncated; the others' are terminated.
    """

    def __init__(
        self, lengths: Sequence[Sequence[int]], rewards: Sequence[float], *, cars_cut: Sequence[int] = ()
    ) -> None:
        self.num_envs = len(lengths)
        self.begun = np.zeros(self.num_envs, int)  # resets
        self._lengths, self._rewards = lengths, np.array(rewards)
        self._cut = np.isin(np.arange(self.num_envs), cars_cut)
        self._age = np.zeros(self.num_envs, int)
        self._ends = np.array([schedule[0] for schedule in lengths])

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        frames = np.zeros((self.num_envs, 120, 160), np.uint8)
        return frames, np.stack([self._age, self.begun], 1).astype(np.float32)

    def step(self, actions):
        stands = self._age >= self._ends
        self._age += 1
        done = self._age >= self._ends
        return np.where(stands, STANDING, self._rewards), done & ~self._cut, done & self._cut

    def reset(self, mask) -> None:
        for car in np.flatnonzero(mask):
            self._ends[car] = self._lengths[car][self.begun[car] % len(self._lengths[car])]
            self._age[car] = 0
            self.begun[car] += 1
