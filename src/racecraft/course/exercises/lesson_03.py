"""Exploration and exploitation: a strategy for a row of slot machines, judged by what it lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.course.verdict import Verdict, right, wrong

Choose = Callable[[NDArray[np.float64], NDArray[np.int64], np.random.Generator], Any]
ARMS: Final = 5
PULLS: Final = 600
PLAYERS: Final = 60
BAR: Final = 70.0
"""Regret that is good enough: the best constant ε, 0.07, loses 79, one that fades 61, UCB 39."""


def check_choose(choose: Choose) -> Verdict:
    """Regret over 600 pulls, mean of 60 players with machines of their own."""
    regrets, shares = np.zeros(PLAYERS), np.zeros(PLAYERS)
    tried = np.zeros(PLAYERS)
    for player in range(PLAYERS):
        rng = np.random.default_rng((3, player))
        means = rng.normal(size=ARMS)
        values, counts = np.zeros(ARMS), np.zeros(ARMS, np.int64)
        late = np.zeros(ARMS)
        for pull in range(PULLS):
            arm = choose(values.copy(), counts.copy(), rng)
            if isinstance(arm, bool | np.bool_) or not isinstance(arm, int | np.integer) or not 0 <= arm < ARMS:
                return wrong(f"It chose {arm!r}; it must return the number of a machine, 0 to {ARMS - 1}.")
            counts[arm] += 1
            values[arm] += (means[arm] + rng.normal() - values[arm]) / counts[arm]
            late[arm] += pull >= PULLS // 2
            regrets[player] += means.max() - means[arm]
        shares[player] = late[means.argmax()] / late.sum()
        tried[player] = (counts > 0).sum()
    regret, share = float(regrets.mean()), float(shares.mean())
    if regret <= BAR:
        return right(f"It loses {regret:.0f}, less than any constant ε.")
    told = f"It loses {regret:.0f} against the best machine; the bar is {BAR:.0f}. "
    if tried.mean() < ARMS - 0.5:
        return wrong(
            told + f"Of {ARMS} machines it tries {tried.mean():.1f}: it settles for the first that pays. "
            "Whoever never looks elsewhere does not learn that it is better there."
        )
    if share < 1.5 / ARMS:
        return wrong(
            told + f"Even late it plays the best machine in only {100 * share:.0f} of 100 pulls, no more than by lot: "
            "use what has been learned. values.argmax() knows it."
        )
    if share < 0.72:
        return wrong(
            told + f"Late it still plays another in {100 - 100 * share:.0f} of 100 pulls. Explore less and less: "
            "counts.sum() tells how far the game has come."
        )
    return wrong(told + "Close. Explore a little less late, or a little more early: ε of about 10 / (10 + pulls) does.")


CHECKS = {"choose": check_choose}
