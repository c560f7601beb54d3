"""The algorithms by name: what each is, and for which actions it is made.

Every one is a file with settings, ``begin`` (a policy that knows nothing) and ``learn`` (an iterator that improves it
in place, a little with every turn, and ends when the steps are done).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces

from racecraft.checks import check_choice
from racecraft.classic import a2c, a3c, dqn, ppo, q_table, reinforce, sac, sarsa
from racecraft.classic.settings import Settings
from racecraft.classic.worlds import Worlds
from racecraft.errors import ConfigError


@dataclass(frozen=True)
class Algorithm:
    """One of them."""

    settings: type[Settings]
    begin: Callable[..., Any]
    """Worlds, settings, random numbers → policy."""
    learn: Callable[[Worlds, Any, Any, np.random.Generator], Iterator[None]]
    """Worlds, policy, settings, random numbers → turns."""
    actions: tuple[type[gymnasium.Space[Any]], ...]
    """Spaces of actions that it is made for."""
    has_table: bool = False
    """Whether it sees cells rather than numbers."""


CHOICE, ANY, NUMBERS = (spaces.Discrete,), (spaces.Discrete, spaces.Box), (spaces.Box,)
ALGORITHMS: Final[dict[str, Algorithm]] = {
    "q-table": Algorithm(q_table.TableSettings, q_table.begin, q_table.learn, CHOICE, has_table=True),
    "sarsa": Algorithm(sarsa.TableSettings, sarsa.begin, sarsa.learn, CHOICE, has_table=True),
    "dqn": Algorithm(dqn.DQNSettings, dqn.begin, dqn.learn, CHOICE),
    "reinforce": Algorithm(reinforce.ReinforceSettings, reinforce.begin, reinforce.learn, ANY),
    "a2c": Algorithm(a2c.ActorCriticSettings, a2c.begin, a2c.learn, ANY),
    "a3c": Algorithm(a3c.A3CSettings, a3c.begin, a3c.learn, ANY),
    "ppo": Algorithm(ppo.PPOSettings, ppo.begin, ppo.learn, ANY),
    "sac": Algorithm(sac.SACSettings, sac.begin, sac.learn, NUMBERS),
}


def find_algorithm(name: str) -> Algorithm:
    """An algorithm by its name.

    Raises:
        ConfigError: There is none.
    """
    check_choice("algorithm", name, ALGORITHMS)
    return ALGORITHMS[name]


def check_fit(name: str, environment: str, space: gymnasium.Space[Any]) -> None:
    """Refuse an algorithm that is not made for the environment's actions.

    Raises:
        ConfigError: It is not; the sentence says which are.
    """
    is_choice, is_vector = isinstance(space, spaces.Discrete), isinstance(space, spaces.Box) and len(space.shape) == 1
    fitting = [
        other for other, made in ALGORITHMS.items() if isinstance(space, made.actions) and (is_choice or is_vector)
    ]
    if name not in fitting:
        kind = "choices" if is_choice else "numbers" if is_vector else str(space)
        which = f"{', '.join(fitting)} are made for them" if fitting else "no algorithm here is made for them"
        raise ConfigError(f"{name} does not fit {environment}: its actions are {kind}, and {which}.")
