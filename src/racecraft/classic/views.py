"""What a learner sees of an observation: a vector of numbers for a network, or the number of a cell for a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from racecraft.errors import ConfigError

MAX_CELLS: Final = 1_000_000
"""A table of more would not fill in any time that one waits."""
MAX_NUMBERS: Final = 20_000
"""Of a vector; a picture of Atari has five times as many."""

WIDEST: Final = 1e6
"""Bounds further apart than this are none."""


class View(Protocol):
    """Turns raw observations of N worlds into an array."""

    size: int
    """Numbers of a vector, or cells of a table."""

    def __call__(self, observations: Sequence[Any]) -> NDArray[Any]:
        """Vectors (N, size), or cells (N,)."""
        ...


class VectorView:
    """Numbers for a network: what has bounds is scaled to -1 .. 1, a choice becomes zeros and a one.

    Args:
        space: Of one observation.

    Raises:
        ConfigError: It is no vector, or one of too many numbers.
    """

    def __init__(self, space: gymnasium.Space[Any]) -> None:
        try:
            self.size = spaces.flatdim(space)
        except (NotImplementedError, ValueError) as error:
            raise ConfigError(f"Observations of {space} have no fixed size, so no network takes them.") from error
        if self.size > MAX_NUMBERS:
            raise ConfigError(
                f"An observation has {self.size:,} numbers, more than {MAX_NUMBERS:,}: too many for these networks.",
                hint="For pixels of our car: 'racecraft train'. Atari has its memory instead: --make obs_type=ram.",
            )
        self._space = space
        if isinstance(space, spaces.Box):
            low, high = space.low.reshape(-1).astype(np.float64), space.high.reshape(-1).astype(np.float64)
            with np.errstate(over="ignore", invalid="ignore"):
                is_bounded = (high - low < WIDEST) & (high > low)
            low, high = np.where(is_bounded, low, -1.0), np.where(is_bounded, high, 1.0)
            self._middle = ((high + low) / 2.0).astype(np.float32)
            self._scale = (2.0 / (high - low)).astype(np.float32)

    def __call__(self, observations: Sequence[Any]) -> NDArray[np.float32]:
        """Vectors (N, size)."""
        if isinstance(self._space, spaces.Box):
            numbers = np.asarray(observations, np.float32).reshape(len(observations), self.size)
            return np.asarray((numbers - self._middle) * self._scale)
        if isinstance(self._space, spaces.Discrete):
            vectors = np.zeros((len(observations), self.size), np.float32)
            vectors[np.arange(len(vectors)), np.asarray(observations, np.int64) - int(self._space.start)] = 1.0
            return vectors
        return np.stack([np.asarray(spaces.flatten(self._space, seen), np.float32) for seen in observations])


@dataclass(frozen=True)
class Cut:
    """Where one number of an observation is cut into intervals."""

    column: int
    """Of the observation, flat."""
    edges: tuple[float, ...]
    """Ascending; k edges make k + 1 intervals."""

    @classmethod
    def even(cls, column: int, low: float, high: float, bins: int) -> Cut:
        """Intervals of one length between two bounds; what lies beyond them belongs to the outer ones."""
        return cls(column, tuple(np.linspace(low, high, bins + 1)[1:-1].tolist()))


class CellView:
    """The number of a cell for a table: a choice is one already, numbers are cut into intervals.

    Args:
        space: Of one observation.
        cuts: Of a vector of numbers; every column into `bins` even ones where none are given.
        bins: Intervals of a column.

    Raises:
        ConfigError: There would be too many cells, or a column has no bounds and no cut.
    """

    def __init__(self, space: gymnasium.Space[Any], *, cuts: Sequence[Cut] = (), bins: int = 10) -> None:
        self._space, self.cuts = space, tuple(cuts)
        if isinstance(space, spaces.Box):
            self.cuts = self.cuts or even_cuts(space, bins)
            if any(not 0 <= cut.column < spaces.flatdim(space) for cut in self.cuts):
                raise ConfigError(f"cuts name a column outside of 0 to {spaces.flatdim(space) - 1}.")
            self._sizes = [len(cut.edges) + 1 for cut in self.cuts]
            self._edges = [np.array(cut.edges) for cut in self.cuts]
        else:
            self._choices = choices(space)
            self._sizes = [size for _, size in self._choices]
        self.size = int(np.prod(self._sizes, dtype=object))
        if self.size > MAX_CELLS:
            raise ConfigError(
                f"A table of {self.size:,} cells is too large; allowed are {MAX_CELLS:,}.",
                hint="Fewer bins, or a network: dqn.",
            )

    def __call__(self, observations: Sequence[Any]) -> NDArray[np.int64]:
        """Cells (N,)."""
        if isinstance(self._space, spaces.Box):
            numbers = np.asarray(observations).reshape(len(observations), -1)
            digits = [np.searchsorted(e, numbers[:, c.column]) for c, e in zip(self.cuts, self._edges, strict=True)]
        else:
            rows = [np.hstack(seen) if isinstance(seen, tuple) else seen for seen in observations]
            columns = np.array(rows, np.int64).reshape(len(rows), -1).T
            digits = [column - start for column, (start, _) in zip(columns, self._choices, strict=True)]
        cells = np.zeros(len(observations), np.int64)
        for digit, size in zip(digits, self._sizes, strict=True):
            cells = cells * size + digit
        return cells


def even_cuts(space: spaces.Box, bins: int) -> tuple[Cut, ...]:
    """Every column of a bounded space in as many intervals; a column without bounds is looked at from -3 to 3."""
    if space.dtype is not None and not np.issubdtype(space.dtype, np.floating):
        raise ConfigError(f"Observations of {space} are too many for a table.", hint="Take a network: dqn.")
    low, high = space.low.reshape(-1), space.high.reshape(-1)
    cuts = []
    for column, (a, b) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        is_bounded = b - a < WIDEST
        cuts.append(Cut.even(column, a if is_bounded else -3.0, b if is_bounded else 3.0, bins))
    return tuple(cuts)


def choices(space: gymnasium.Space[Any]) -> list[tuple[int, int]]:
    """First value and number of values of every choice that makes up an observation."""
    if isinstance(space, spaces.Discrete):
        return [(int(space.start), int(space.n))]
    if isinstance(space, spaces.MultiDiscrete):
        return [(0, int(n)) for n in space.nvec.reshape(-1)]
    if isinstance(space, spaces.MultiBinary):
        return [(0, 2)] * int(np.prod(space.shape))
    if isinstance(space, spaces.Tuple) and all(isinstance(part, spaces.Discrete) for part in space.spaces):
        return [pair for part in space.spaces for pair in choices(part)]
    raise ConfigError(f"Observations of {space} have no cells for a table.", hint="Take a network: dqn.")
