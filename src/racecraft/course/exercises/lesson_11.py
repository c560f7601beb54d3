"""A rule that steers by three numbers, judged by the laps that it drives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.course.driving import drive
from racecraft.course.verdict import Verdict, right, wrong
from racecraft.sim.columns import CURVATURE_AHEAD, STATE_COLUMNS

_OFFSET, _HALF_WIDTH, _SINE, _CURVATURE = (
    STATE_COLUMNS.index(name) for name in ("offset", "half_width", "sin_heading_error", "curvature_0")
)
TRACK: Final = "reinvent_2018"
CARS: Final = 8
AHEAD: Final = 0.6
"""m over which a bend is told."""
_LARGEST: Final = 0.53
"""rad, 30 degrees: the wheels turn no further."""


def check_steer(steer: Callable[..., Any]) -> Verdict:
    """Signs first, then laps."""
    straight, left, turned, bend = (_asked(steer, *seen) for seen in ((0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.4)))
    answers = (straight, left, turned, bend)
    if not all(np.isfinite(answers)) or abs(straight) > 0.1:
        return wrong(
            f"In the middle of a straight road, pointing along it, it steers {straight:g} rad: nothing to do there."
        )
    if max(map(abs, answers)) > 1.6:
        return wrong(
            f"It answers {max(answers, key=abs):g}: the angle is in rad, and the wheels turn no further than 0.52, "
            "which is 30 degrees."
        )
    if left > 0.0 or turned > 0.0:
        where = "20 cm left of the middle" if left > 0.0 else "Pointing 0.2 rad to the left"
        return wrong(f"{where}, it steers further to the left. Steer against what is wrong: a minus.")
    if bend < 0.0:
        return wrong("Before a bend to the left it steers to the right: go with the bend, against the errors.")

    def driver(state: NDArray[np.float32]) -> NDArray[Any]:
        near = [index for index, ahead in enumerate(CURVATURE_AHEAD) if ahead <= AHEAD]
        bends = AHEAD * state[:, [_CURVATURE + index for index in near]].mean(axis=1)
        rows = zip(state[:, _OFFSET] * state[:, _HALF_WIDTH], np.arcsin(state[:, _SINE]), bends, strict=True)
        angles = [_asked(steer, *(float(number) for number in row)) for row in rows]
        return np.stack([np.clip(angles, -_LARGEST, _LARGEST), np.ones(len(state))], axis=1)

    drives = drive(driver, TRACK, cars=CARS, seconds=40.0, seed=3, action_space="continuous")
    told = f"It drives {drives.laps} of {CARS} laps. "
    if drives.laps == CARS:
        return right(told + "Three numbers, one line, and one can say what each of them is for.")
    if left == 0.0:
        return wrong(told + "It does not look at the offset, so what it is off once it stays off.")
    if abs(left) < 0.06:
        return wrong(told + "The signs are right, but it steers too gently to come back before the road ends.")
    return wrong(
        told + "The signs are right. Try about 1 rad for a metre of offset, 0.8 for a rad of angle, 0.45 for a bend."
    )


def _asked(steer: Callable[..., Any], offset: float, turn: float, bend: float) -> float:
    return float(steer(offset, turn, bend))


CHECKS = {"steer": check_steer}
