"""What DQN learns towards, held against worked numbers, and the memory that it draws from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from racecraft.course.verdict import Verdict, right, wrong

GAMMA: Final = 0.9
REWARDS: Final = np.array([1.0, 2.0, -1.0])
TERMINATED: Final = np.array([False, False, True])
ONLINE: Final = np.array([[1.0, 4.0], [6.0, 2.0], [3.0, 5.0]])
"""What the network that learns says of the next states."""
TARGET: Final = np.array([[3.0, 2.0], [1.0, 7.0], [8.0, 9.0]])
"""What the one that stands still says of them."""


def check_targets(targets: Callable[..., Any]) -> Verdict:
    """Three steps, of which the last ends its episode."""
    found = np.asarray(targets(REWARDS.copy(), TERMINATED.copy(), ONLINE.copy(), TARGET.copy(), GAMMA))
    if found.shape != REWARDS.shape:
        return wrong(f"It has shape {found.shape}, and there are three steps: return one number for each, (3,).")
    future = TARGET.max(axis=1)
    if np.allclose(found, REWARDS + GAMMA * np.where(TERMINATED, 0.0, future)):
        return right("The network that stands still says what comes, and nothing comes after the end.")
    if np.allclose(found[:2], (REWARDS + GAMMA * future)[:2]):
        return wrong(
            f"Right for the first two; the third ended its episode for good, and it made {found[2]:g} of a reward of "
            f"{REWARDS[2]:g}: nothing comes after the end, but the reward counts. Leave out what comes, and only that: "
            "np.where(terminated, 0.0, ...)."
        )
    if np.allclose(found[:2], (REWARDS + GAMMA * ONLINE.max(axis=1))[:2]):
        return wrong(
            f"It made {found[0]:g} of the first: that asks the network that learns, whose answer moves with every "
            "update that it causes. Ask the one that stands still: target."
        )
    if np.allclose(found[:2], (REWARDS + future)[:2]):
        return wrong(f"It made {found[0]:g} of the first: what comes a step later counts gamma = {GAMMA} of it.")
    step = 0 if not np.isclose(found[0], REWARDS[0] + GAMMA * future[0]) else 1
    return wrong(
        f"It made {found[step]:g} of step {step + 1}, and it should be {REWARDS[step] + GAMMA * future[step]:g}: its "
        f"reward {REWARDS[step]:g}, plus gamma = {GAMMA} times the best of {TARGET[step].tolist()}."
    )


CAPACITY: Final = 4


def check_remember(remember: Callable[..., Any]) -> Verdict:
    """Ten steps in a memory of four."""
    memory: list[int] = []
    for step in range(10):
        before = len(memory)
        remember(memory, step, CAPACITY)
        if step not in memory:
            return wrong(f"Step {step} is not in the memory: {memory}. Change the list in place: append, pop, del.")
        if len(memory) > CAPACITY:
            return wrong(
                f"After {step + 1} steps it holds {len(memory)}, and there is room for {CAPACITY}: something must go."
            )
        if len(memory) < min(before + 1, CAPACITY):
            return wrong(
                f"After {step + 1} steps it holds only {memory}: what was seen before is what replay is for. Forget "
                "one step, and only when the memory is full."
            )
    if sorted(memory) != [6, 7, 8, 9]:
        return wrong(
            f"After steps 0 to 9 it holds {memory}: it forgot the wrong ones. The oldest goes, since it was seen by "
            "the worst driver."
        )
    return right("The newest takes the oldest one's place.")


CHECKS = {"targets": check_targets, "remember": check_remember}
