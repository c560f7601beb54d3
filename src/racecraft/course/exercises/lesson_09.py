"""Advantages of a few steps, held against worked numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from racecraft.course.verdict import Verdict, right, wrong

REWARDS: Final = np.array([1.0, 2.0, 0.0, 4.0])
VALUES: Final = np.array([3.0, 1.0, 2.0, 5.0])
AFTERWARDS: Final = np.array([1.0, 2.0, 5.0, 6.0])
"""What the critic says of the state that each step led to."""
TERMINATED: Final = np.array([False, True, False, False])
GAMMA, LAMBDA = 0.5, 0.5


def check_advantages(advantages: Callable[..., Any]) -> Verdict:
    """Four steps of one world, whose episode ends for good with the second."""
    found = np.asarray(_asked(advantages, LAMBDA), np.float64)
    if found.shape != REWARDS.shape:
        return wrong(f"It has shape {found.shape}; there are four steps: return an advantage for each, (4,).")
    if np.allclose(found, _truth(LAMBDA)):
        quick, slow = _asked(advantages, 0.0), _asked(advantages, 1.0)
        if np.allclose(quick, _truth(0.0)) and np.allclose(slow, _truth(1.0)):
            return right("It believes the critic as far as lambda says, and never beyond the end of an episode.")
        return wrong(f"Right for lambda = {LAMBDA}, but not for 0 and 1: use the argument lam, not a number.")
    if np.allclose(found, _truth(0.0)):
        return wrong(
            "These are the surprises of single steps, as lambda = 0 has them. Add what comes after: gamma * lam times "
            "the next step's advantage."
        )
    if any(np.allclose(found, _truth(LAMBDA, value_ends=False, advantage_ends=ends)) for ends in (False, True)):
        return wrong(
            f"The second step ended its episode, and it made {found[1]:g} of it: neither a value nor an advantage "
            "comes from beyond the end. Leave both out where terminated."
        )
    if np.allclose(found, _truth(LAMBDA, advantage_ends=False)):
        return wrong(
            "The second step ended its episode: its value is left out, but the advantage of the next episode leaks "
            f"into it ({found[1]:g}). Begin anew where terminated."
        )
    if np.allclose(found, _truth(LAMBDA) + VALUES):
        return wrong(
            f"It made {found[3]:g} of the last: that is what the step was worth. Less what was expected, values."
        )
    if np.allclose(found, _truth(1.0)):
        return wrong(
            "It waits for everything that really happens, as lambda = 1 does: fade by gamma * lam, not by gamma."
        )
    late = [t for t in range(3) if not np.isclose(found[t], _truth(LAMBDA)[t])]
    if np.isclose(found[3], _truth(LAMBDA)[3]):
        return wrong(
            f"The last step is right. Step {late[-1] + 1} should get {_truth(LAMBDA)[late[-1]]:g} and gets "
            f"{found[late[-1]]:g}: its own surprise is {_truth(0.0)[late[-1]]:g}, and gamma * lam times the next "
            "step's advantage comes on top, unless the episode ends with it."
        )
    return wrong(
        f"The last step paid {REWARDS[3]:g}, the critic had expected {VALUES[3]:g} and now expects {AFTERWARDS[3]:g} "
        f"more: its surprise is {_truth(0.0)[3]:g}, and it made {found[3]:g}. Begin there and go backwards."
    )


def _asked(advantages: Callable[..., Any], fade: float) -> Any:
    return advantages(REWARDS.copy(), VALUES.copy(), AFTERWARDS.copy(), TERMINATED.copy(), GAMMA, fade)


def _truth(fade: float, *, value_ends: bool = True, advantage_ends: bool = True) -> np.ndarray[Any, Any]:
    is_going, always = np.where(TERMINATED, 0.0, 1.0), np.ones(4)
    surprises = REWARDS + GAMMA * (is_going if value_ends else always) * AFTERWARDS - VALUES
    kept = is_going if advantage_ends else always
    found, following = np.zeros(4), 0.0
    for t in reversed(range(4)):
        following = found[t] = surprises[t] + GAMMA * fade * kept[t] * following
    return found


CHECKS = {"advantages": check_advantages}
