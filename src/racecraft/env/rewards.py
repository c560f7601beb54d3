"""Where an environment's reward comes from: a source in its own process, or a callable in this one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RewardError
from racecraft.reward import (
    RewardWorker,
    format_params,
    keeps_state,
    load_reward,
    make_params,
    validate_reward,
)
from racecraft.reward.worker import waypoints_of
from racecraft.reward.worker_process import REWARD_LIMIT, BadRewardError, to_float
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track import Track

RewardFunction = Callable[[dict[str, Any]], float]

_STEPS = ROW_COLUMNS.index("steps")


class RewardSource(Protocol):
    """Gives the rewards of a batch of judged rows; the prepare row of an episode has reward 0."""

    def __call__(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rewards (N,) of rows (N, columns)."""
        ...

    def restart(self, seed: int) -> None:
        """Forget what earlier calls left behind, and draw random numbers from this seed on."""
        ...

    def close(self) -> None:
        """Release what it holds; calling again does nothing."""
        ...


def open_reward(
    reward: str | Path | RewardFunction, *, tracks: Sequence[Track], num_envs: int, num_objects: int = 0
) -> RewardSource:
    """The reward that a user named.

    Args:
        reward: Name of a preset, path of a ``reward_function.py``, or its text (anything with a line break),
            each run in a process of its own; or a trusted callable of AWS's params dict, run in this one.
        tracks: The simulation's tracks.
        num_envs: Cars, N.
        num_objects: On the track besides the car.

    Raises:
        RewardError: It does not exist or is not valid.
    """
    if callable(reward):
        return CallableReward(reward, tracks=tracks)
    if isinstance(reward, str) and "\n" in reward:
        source = reward
    elif isinstance(reward, str | Path):
        source = load_reward(reward)
    else:
        raise RewardError(f"reward is {reward!r}; allowed are a preset's name, a path, source text or a callable.")
    validate_reward(source)
    return IsolatedReward(source, tracks=tracks, num_envs=num_envs, num_objects=num_objects)


class IsolatedReward:
    """A reward function's source in a worker process, which a seeded restart replaces where that matters."""

    def __init__(self, source: str, *, tracks: Sequence[Track], num_envs: int, num_objects: int = 0) -> None:
        self._source, self._tracks = source, tracks
        self._num_objects = num_objects
        has_state = keeps_state(source)
        self._num_cars = num_envs if has_state else 1
        self._remembers = has_state or "random" in source
        self._worker = self._start(seed=0)

    def _start(self, *, seed: int) -> RewardWorker:
        return RewardWorker(
            self._source, self._tracks, seed=seed, num_cars=self._num_cars, num_objects=self._num_objects
        )

    def __call__(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rewards (N,) of rows (N, columns)."""
        return self._worker(rows)

    def restart(self, seed: int) -> None:
        """Replace the process if its function keeps state or draws random numbers."""
        if self._remembers:
            self._worker.close()
            self._worker = self._start(seed=seed)

    @property
    def process_id(self) -> int:
        """Number of the worker process."""
        return self._worker.process_id

    def close(self) -> None:
        """End the process."""
        self._worker.close()


class CallableReward:
    """A Python callable, called in this process: fast to try out, and trusted."""

    def __init__(self, function: RewardFunction, *, tracks: Sequence[Track]) -> None:
        self._function = function
        self._waypoints = waypoints_of(tracks)

    def __call__(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rewards (N,) of rows (N, columns).

        Raises:
            RewardError: A reward is not a finite number within ±1e5. What the callable raises passes through.
        """
        rewards = np.zeros(len(rows))
        for car, row in enumerate(rows.tolist()):
            if row[_STEPS] == 1.0:
                continue
            params = make_params(row, self._waypoints)
            value = self._function(params)
            try:
                rewards[car] = reward = to_float(value)
                if not abs(reward) <= REWARD_LIMIT:
                    raise BadRewardError(f"returned {reward!r}; a reward is a finite number within ±100000")
            except BadRewardError as error:
                raise RewardError(
                    f"The reward callable {error}.\nIt was called with params = {format_params(params)}",
                    row_index=car,
                    params=params,
                ) from None
        return rewards

    def restart(self, seed: int) -> None:
        """Nothing: what a callable remembers is its owner's."""

    def close(self) -> None:
        """Nothing to release."""
