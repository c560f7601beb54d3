"""Returns of an episode, and one step up the policy's gradient on a row of slot machines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from racecraft.course.verdict import Verdict, right, wrong

REWARDS: Final = np.array([1.0, 0.0, 2.0, 4.0])
GAMMA: Final = 0.5
RETURNS: Final = np.array([2.0, 2.0, 4.0, 4.0])


def check_returns(returns: Callable[..., Any]) -> Verdict:
    """What each step of an episode of four led to."""
    found = np.asarray(returns(REWARDS.copy(), GAMMA), np.float64)
    if found.shape != REWARDS.shape:
        return wrong(f"It has shape {found.shape}; there are four steps: return a number for each, (4,).")
    if np.allclose(found, RETURNS):
        return right("Every action answers for what came after it, and for nothing else.")
    if np.allclose(found, found[0]):
        return wrong(
            f"It gives {found[0]:g} to every step: the last action is praised for rewards that came before it. Each "
            "step's return begins with its own reward."
        )
    if np.allclose(found, np.cumsum(REWARDS[::-1])[::-1]):
        return wrong(
            f"It makes {found[0]:g} of the first step: all rewards count alike. One that comes a step later counts "
            f"gamma = {GAMMA} of it."
        )
    if np.isclose(found[0], REWARDS[0]):
        return wrong(
            f"The first step got {found[0]:g}, its own reward alone or what came before: go through the episode from "
            "its end, and keep what follows."
        )
    return wrong(
        f"Rewards {REWARDS.tolist()} with gamma = {GAMMA} make {RETURNS.tolist()}, and it made {found.tolist()}: G of "
        "a step is its reward plus gamma times the next step's G."
    )


PREFERENCES: Final = np.array([0.0, 1.0, 0.5])
ACTION, REWARD, BASELINE, RATE = 0, 3.0, 1.0, 0.1


def check_step(step: Callable[..., Any]) -> Verdict:
    """A step for one pull of one of three machines."""
    answer = step(PREFERENCES.copy(), ACTION, REWARD, BASELINE, RATE)
    if answer is None:
        return wrong("It returns nothing: return the new preferences, one for each machine.")
    found = np.asarray(answer, np.float64)
    if found.shape != PREFERENCES.shape:
        return wrong(f"It has shape {found.shape}; there are three machines: return three preferences.")
    chances = np.exp(PREFERENCES) / np.exp(PREFERENCES).sum()
    direction = np.eye(3)[ACTION] - chances
    moved = found - PREFERENCES
    if np.allclose(moved, RATE * (REWARD - BASELINE) * direction):
        return right("What was better than expected becomes likelier, and everything else less.")
    if np.allclose(moved, -RATE * (REWARD - BASELINE) * direction):
        return wrong(
            f"The pull brought {REWARD - BASELINE:g} more than expected, and it became less likely: the sign is the "
            "wrong way round. Go up the gradient."
        )
    if np.allclose(moved, RATE * REWARD * direction):
        return wrong(
            "It praises with the whole reward. Only what is better than expected deserves praise: reward - baseline."
        )
    if np.allclose(moved, 0.0):
        return wrong("The preferences are as they were: the machine that was pulled should become likelier here.")
    if np.allclose(np.delete(moved, ACTION), 0.0):
        return wrong(
            "Only the machine that was pulled changes. Chances sum to one, so the others fall: the gradient of the "
            "logarithm is 1 for the one that was pulled, less the chance of each."
        )
    expected = RATE * (REWARD - BASELINE) * direction
    return wrong(
        f"The preferences moved by {np.round(moved, 3).tolist()} and should have moved by "
        f"{np.round(expected, 3).tolist()}: rate * (reward - baseline) * (1 for the one pulled, less the chances)."
    )


CHECKS = {"returns": check_returns, "step": check_step}
