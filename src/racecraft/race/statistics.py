"""How sure an evaluation can be: intervals for a rate and a mean from a handful of trials. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from racecraft.checks import require


class Interval(NamedTuple):
    """A confidence interval."""

    low: float
    high: float


def wilson_interval(successes: int, trials: int, *, confidence: float = 0.95) -> Interval:
    """Wilson's score interval for the probability of success.

    It stays within 0 and 1 and keeps its width when every trial succeeds: 5 of 5 laps say 57 % to 100 %.

    Args:
        successes: How many trials succeeded.
        trials: How many there were; with none, nothing is known: 0 to 1.
        confidence: Probability that the interval holds the truth.

    Raises:
        ConfigError: More successes than trials, a negative number, or a confidence outside 0 to 1.
    """
    require("successes", successes, 0 <= successes <= trials, f"0 to the number of trials, {trials}")
    z = NormalDist().inv_cdf(0.5 + _checked(confidence) / 2)
    if trials == 0:
        return Interval(0.0, 1.0)
    rate = successes / trials
    scale = 1.0 + z * z / trials
    middle = (rate + z * z / (2 * trials)) / scale
    half = z / scale * float(np.sqrt(rate * (1.0 - rate) / trials + z * z / (4 * trials * trials)))
    # the ends are exact where they must be, whatever the rounding of the sum
    return Interval(0.0 if successes == 0 else middle - half, 1.0 if successes == trials else middle + half)


def mean_interval(
    values: Sequence[float], *, low: float = -np.inf, high: float = np.inf, confidence: float = 0.95
) -> Interval:
    """Student's interval for a mean, cut to what the values can be.

    Args:
        values: Independent measurements; a single one tells nothing, so its interval is `low` to `high`.
        low: Smallest possible value.
        high: Largest possible value.
        confidence: Probability that the interval holds the true mean, if the values are about normal.

    Raises:
        ConfigError: The confidence is outside 0 to 1.
    """
    probability = 0.5 + _checked(confidence) / 2
    count = len(values)
    if count < 2:
        return Interval(low, high)
    samples = np.asarray(values, dtype=np.float64)
    mean = float(samples.mean())
    half = float(_student_quantile(count - 1, probability) * samples.std(ddof=1) / np.sqrt(count))
    return Interval(max(low, mean - half), min(high, mean + half))


def _student_quantile(freedom: int, probability: float) -> float:
    """The value that Student's t with `freedom` degrees stays below with a probability of 0.5 or more.

    By bisection of the angle whose tangent is t / √freedom: for whole degrees of freedom the distribution is a finite
    sum over it (Abramowitz and Stegun, 26.7.3 and 26.7.4).
    """
    low, high = 0.0, math.pi / 2
    for _ in range(60):  # halves: the last bit of a float64
        angle = (low + high) / 2
        is_below = 0.5 + _student_within(freedom, angle) / 2 < probability
        low, high = (angle, high) if is_below else (low, angle)
    return math.sqrt(freedom) * math.tan(low)


def _student_within(freedom: int, angle: float) -> float:
    """Probability that |t| stays below √freedom · tan(angle)."""
    sine, cosine = math.sin(angle), math.cos(angle)
    is_odd = freedom % 2 == 1
    term, total = (cosine, 0.0) if is_odd else (1.0, 0.0)
    for index in range(freedom // 2):
        total += term
        term *= cosine * cosine * ((2 * index + 2) / (2 * index + 3) if is_odd else (2 * index + 1) / (2 * index + 2))
    return 2.0 / math.pi * (angle + sine * total) if is_odd else sine * total


def _checked(confidence: float) -> float:
    require("confidence", confidence, 0.0 < confidence < 1.0, "between 0 and 1, usually 0.95")
    return confidence
