"""Seven drivers that need no training, each with a habit: whom does a reward like best?

    print(earnings(reward_function))

To ask them takes a second, and tells what a reward will teach before anything has been learned.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.course.driving import STEPS_PER_SECOND, Driver, drive
from racecraft.race.autopilot import Autopilot
from racecraft.sim.columns import STATE_COLUMNS

_OFFSET, _SINE, _COSINE, _CURVATURE = (
    STATE_COLUMNS.index(name) for name in ("offset", "sin_heading_error", "cos_heading_error", "curvature_0")
)
_CARS: Final = 6
_SECONDS: Final = 10.0


@dataclass(frozen=True)
class Habit:
    """A driver and how it is put down."""

    driver: Callable[[], Driver]
    """Makes it anew: some remember what they did last."""
    is_turned: bool = False
    """Whether it faces against the track's direction."""


def _at(speed: float) -> Callable[[], Driver]:
    return lambda: Autopilot(speed=speed, lateral_acceleration=2.2)


def _weaver() -> Driver:
    """Stays on the road, but swings its wheels from side to side."""
    steps = 0

    def weave(state: NDArray[np.float32]) -> NDArray[Any]:
        nonlocal steps
        commands = Autopilot(speed=1.5)(state)
        side = 1.0 if (steps + 1) // 2 % 2 else -1.0
        steps += 1
        return np.stack([commands[:, 0] + side * 0.35, commands[:, 1]], axis=1)

    return weave


def _border() -> Driver:
    """Drives with two wheels beyond the outer line."""

    def cut(state: NDArray[np.float32]) -> NDArray[Any]:
        moved = state.copy()
        moved[:, _OFFSET] += 1.0
        return Autopilot(speed=1.5)(moved)

    return cut


def _wrong_way() -> Driver:
    """Follows the road well, in the wrong direction."""

    def turn(state: NDArray[np.float32]) -> NDArray[Any]:
        seen = state.copy()
        for column in (_OFFSET, _SINE, _COSINE):
            seen[:, column] = -state[:, column]
        seen[:, _CURVATURE:] = -state[:, _CURVATURE : _CURVATURE + 1]
        return Autopilot(speed=1.5)(seen)

    return turn


DRIVERS: Final[Mapping[str, Habit]] = {
    "slow": Habit(_at(0.5)),
    "steady": Habit(_at(1.0)),
    "brisk": Habit(_at(1.5)),
    "quick": Habit(_at(2.0)),
    "weaving": Habit(_weaver),
    "on the border": Habit(_border),
    "wrong way": Habit(_wrong_way, is_turned=True),
}
"""The first four hold the middle of the road at 0.5, 1, 1.5 and 2 m/s; the others drive at 1.5 m/s."""


def earnings(reward: Callable[[dict[str, Any]], float] | str, track: str = "oval") -> dict[str, float]:
    """What a reward function pays each of `DRIVERS` in a second, while it drives.

    Args:
        reward: A function of AWS's params, or the name of a preset.
        track: Where they drive.

    Raises:
        RewardError: It returns something that is no reward.
    """
    paid = {}
    for name, habit in DRIVERS.items():
        drives = drive(
            habit.driver(), track, cars=_CARS, seconds=_SECONDS, is_turned=habit.is_turned, seed=1,
            reward=reward, action_space="continuous",
        )  # fmt: skip
        paid[name] = float(np.nanmean(drives.rewards) * STEPS_PER_SECOND)
    return paid
