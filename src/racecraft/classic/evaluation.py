"""How a policy does when it means it: whole episodes without exploration, one in each of many worlds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.policy import Policy
from racecraft.classic.worlds import Worlds


def play(worlds: Worlds, policy: Policy) -> NDArray[np.float64]:
    """Returns of one episode in every world (N,), from where the worlds stand at the beginning of an episode."""
    returns = np.zeros(worlds.num_envs)
    is_going = np.ones(worlds.num_envs, np.bool_)
    while is_going.any():
        step = worlds.step(policy.act(worlds.observations), among=is_going)
        returns += np.where(is_going, step.rewards, 0.0)
        is_going &= ~step.over
    return returns
