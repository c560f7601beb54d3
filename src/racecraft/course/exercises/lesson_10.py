"""PPO's clipped gain, and a bug that says nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.course.verdict import Verdict, right, wrong

CLIP: Final = 0.2
RATIOS: Final = np.array([0.5, 0.9, 1.0, 1.5, 0.5, 1.1, 1.5])
ADVANTAGES: Final = np.array([1.0, 2.0, -1.0, 2.0, -1.0, -2.0, -2.0])


def check_gain(gain: Callable[..., Any]) -> Verdict:
    """What PPO makes as large as it can, for good and bad actions that became likelier or less."""
    found = np.asarray(gain(RATIOS.copy(), ADVANTAGES.copy(), CLIP), np.float64)
    if found.shape != RATIOS.shape:
        return wrong(f"It has shape {found.shape}; there are {len(RATIOS)} steps: return a number for each.")
    free, held = RATIOS * ADVANTAGES, np.clip(RATIOS, 1.0 - CLIP, 1.0 + CLIP) * ADVANTAGES
    if np.allclose(found, np.minimum(free, held)):
        return right("It counts what is gained within the limits, and all that is lost.")
    if np.allclose(found, free):
        return wrong(
            f"A good action that became 1.5 times as likely counts {found[3]:g}: nothing holds the policy. Beyond 1 + "
            f"{CLIP} no more is to be gained; np.clip(ratio, 1 - clip, 1 + clip) does it."
        )
    if np.allclose(found, held):
        return wrong(
            f"A bad action that became 1.5 times as likely counts {found[6]:g}, clipped: so it would never be mended. "
            "Take the smaller of the clipped and the unclipped product."
        )
    if np.allclose(found, np.maximum(free, held)):
        return wrong(
            f"A good action that became 1.5 times as likely counts {found[3]:g}: you take the larger of the two, the "
            "hopeful one. PPO takes the smaller one, and is careful."
        )
    step = int(np.flatnonzero(~np.isclose(found, np.minimum(free, held)))[0])
    return wrong(
        f"A ratio of {RATIOS[step]:g} with an advantage of {ADVANTAGES[step]:g} should count "
        f"{min(free[step], held[step]):g} and counts {found[step]:g}: the smaller of the clipped and the unclipped "
        "product, and both limits clip."
    )


SURPRISE: Final = np.array([[1.0, 0.0], [2.0, 4.0], [8.0, 2.0]])
OVER: Final = np.array([[False, False], [True, False], [False, False]])
FADE: Final = 0.5


def check_repair(accumulate: Callable[..., Any]) -> Verdict:
    """Two worlds, of which one begins a new episode after the second step."""
    found = np.asarray(accumulate(SURPRISE.copy(), OVER.copy(), FADE), np.float64)
    if found.shape != SURPRISE.shape:
        return wrong(f"It has shape {found.shape}; it must stay (T, N), {SURPRISE.shape}: time by worlds.")
    if np.allclose(found, _summed(lambda t, following: np.where(OVER[t], 0.0, following))):
        return right("The end of an episode holds. Nothing had stopped, and nothing had said a word.")
    if np.allclose(found, _summed(lambda t, following: following)):
        return wrong(
            f"In the first world an episode ends with the second step, and that step still gets {found[1, 0]:g} "
            f"instead of {SURPRISE[1, 0]:g}: it is praised for what the next episode brought. Where is_over is not "
            "looked at, it leaks."
        )
    if np.allclose(found[1, 0], 0.0) or np.allclose(found[0, 0], SURPRISE[0, 0]):
        return wrong(
            f"Now the first world has {found[:, 0].tolist()}: the end cuts off too much. The step that ends an episode "
            "keeps its own surprise and leads back to those before it; only what comes *after* it is dropped, where "
            "is_over[t]."
        )
    if np.allclose(found[:, 1], np.cumsum(SURPRISE[::-1, 1])[::-1]):
        return wrong("Nothing leaks any more, but nothing fades either: what comes a step later counts fade of it.")
    return wrong(
        f"The second world has no end in it, and {SURPRISE[:, 1].tolist()} with fade {FADE} make [2.5, 5.0, 2.0] "
        f"there; it made {found[:, 1].tolist()}."
    )


def _summed(kept: Callable[[int, NDArray[np.float64]], NDArray[np.float64]]) -> NDArray[np.float64]:
    found, following = np.zeros_like(SURPRISE), np.zeros(SURPRISE.shape[1])
    for t in reversed(range(len(SURPRISE))):
        following = found[t] = SURPRISE[t] + FADE * kept(t, following)
    return found


CHECKS = {"gain": check_gain, "repair": check_repair}
