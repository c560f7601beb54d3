"""What a training needs of an algorithm, whichever it is."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any, Protocol

from numpy.typing import NDArray

from racecraft.learn.learner import NetworkSpec
from racecraft.learn.ppo import IterationStats


class Algorithm(Protocol):
    """Drives cars and improves a policy; what it saves as ``weights/`` drives them in evaluations and races."""

    total_steps: int
    """Camera steps since the start of training."""
    prefers_average: bool
    """Whether averaged weights drive, where the algorithm keeps such."""

    @property
    def spec(self) -> NetworkSpec:
        """The network that drives."""

    def iterate(self) -> IterationStats:
        """Drive a little and improve the policy; TrainingError when that is no longer possible."""

    def driving(self) -> AbstractContextManager[None]:
        """Within, the learner the algorithm was made with holds the weights that are to drive."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything a checkpoint holds: plain arrays by name, ``weights/`` first of all."""

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what `state` gave; CheckpointError where it belongs to another run."""
