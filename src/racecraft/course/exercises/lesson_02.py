"""Find the picture that does not belong to the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from racecraft.course.frames import small, taken
from racecraft.course.verdict import Verdict, right, wrong

PILES: Final = 8
SIZE: Final = 40
"""Pictures of a pile."""


def check_odd(odd_one: Callable[..., Any]) -> Verdict:
    """Piles of pictures of the road, with one in each whose car stands across it."""
    found, asked, ordinary, bright = [], [], 0, 0
    for pile in range(PILES):
        rng = np.random.default_rng((2, pile))
        odd = int(rng.integers(SIZE))
        turns = np.where(np.arange(SIZE) == odd, 1.3 * rng.choice([-1, 1]), rng.normal(0.0, 0.05, SIZE))
        images = small(taken("oval", rng.uniform(0.0, 1.0, SIZE), rng.normal(0.0, 0.05, SIZE), turns))
        answer = odd_one(images.copy())
        if isinstance(answer, bool | np.bool_) or not isinstance(answer, int | np.integer) or not 0 <= answer < SIZE:
            return wrong(f"It returned {answer!r}; it must be the place of one picture in the pile, 0 to {SIZE - 1}.")
        distance = ((images - images.mean(axis=0)) ** 2).sum(axis=(1, 2))
        ordinary += int(answer) == int(distance.argmin())
        bright += int(answer) == int(images.mean(axis=(1, 2)).argmax())
        found.append(int(answer) == odd)
        asked.append(int(answer))
    if sum(found) >= PILES - 1:
        return right(f"It finds {sum(found)} of {PILES}, and nobody told it what is odd about them.")
    told = f"It finds {sum(found)} of {PILES}. "
    if len(set(asked)) == 1:
        return wrong(told + f"It always returns {asked[0]}: look at the pictures, images[i] is the i-th of them.")
    if ordinary > PILES // 2:
        return wrong(told + "That is the most ordinary picture, the one nearest to the mean: argmax, not argmin.")
    if bright > PILES // 2:
        return wrong(told + "That is the brightest picture. Odd is what differs from the others, not what is bright.")
    return wrong(told + "Measure how far every picture is from the mean of all, pixel by pixel, squared and summed.")


CHECKS = {"odd": check_odd}
