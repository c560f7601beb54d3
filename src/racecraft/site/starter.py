"""The car that drives on the page before anybody has trained one: the starter ``quick`` as numbers."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import ContinuousActionSpace
from racecraft.learn.flat_weights import join_weights
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER

SHOWN: Final = "quick"


def told_starter() -> tuple[dict[str, Any], NDArray[np.float16]]:
    """Its lowest and highest command, steering angle in rad and speed in m/s (2, 2), and its weights, flat  (P,).

    Halves of numbers are a quarter of all that the page loads before something moves; whole ones would be half.
    """
    policy = load_policy(RunFolder(FOLDER / SHOWN), num_threads=1)[1]
    space = policy.action_space
    assert isinstance(space, ContinuousActionSpace)
    table = np.stack([space.low, space.high]).astype(np.float64)
    weights = join_weights(policy.learner.weights(), policy.learner.spec)
    return {"table": table.ravel().tolist()}, weights.astype(np.float16)
