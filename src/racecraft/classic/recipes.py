"""Settings that are known to work, for pairs of environment and algorithm: what the plain command finds.

`benchmarks/classic.py` measures them, and Stable-Baselines3 beside them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import gymnasium

from racecraft.checks import check_type
from racecraft.classic.a2c import ActorCriticSettings
from racecraft.classic.a3c import A3CSettings
from racecraft.classic.algorithms import ALGORITHMS, find_algorithm
from racecraft.classic.dqn import DQNSettings
from racecraft.classic.ppo import PPOSettings
from racecraft.classic.q_table import TableSettings
from racecraft.classic.reinforce import ReinforceSettings
from racecraft.classic.sac import SACSettings
from racecraft.classic.settings import Settings
from racecraft.classic.views import Cut
from racecraft.env import ENV_ID
from racecraft.env.observation import STATE_BOUNDS
from racecraft.errors import ConfigError, printable


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How an algorithm learns in an environment."""

    settings: Settings
    """Of the algorithm."""
    goal: float = math.inf
    """Mean return of greedy episodes with which learning is done; infinity goes on until the steps are."""
    make: Mapping[str, Any] = field(default_factory=dict)
    """Arguments of ``gymnasium.make``."""
    evaluate_every: int = 5_000
    """Steps between two evaluations."""


def _column(name: str) -> int:
    return list(STATE_BOUNDS).index(name)


CAR_IN_A_TABLE: Final = (
    Cut(_column("offset"), (-0.6, -0.3, -0.1, 0.1, 0.3, 0.6)),
    Cut(_column("sin_heading_error"), (-0.4, -0.2, -0.07, 0.07, 0.2, 0.4)),
    Cut(_column("curvature_2"), (-0.3, 0.3)),
)
"""What a car must know to stay on a road: where across it, at what angle to it, and how it bends half a metre ahead."""

MIDDLE: Final = """
def reward_function(params):
    return 1.0 - 2.0 * params["distance_from_center"] / params["track_width"]
"""
"""A reward for a table: 1 in the middle of the road, 0 at its border. Every step towards the middle pays at once, where
bands of equal reward leave a cell's actions alike."""

MAKE: Final[Mapping[str, Mapping[str, Any]]] = {
    ENV_ID: {"track": "oval", "observation": "state", "action_space": "steady"},
}
"""Arguments for an environment, whatever the algorithm."""

ATARI_EVERY: Final = 50_000
"""Steps between two evaluations in a game of Atari: twenty games take as long as ten thousand steps of learning."""

RECIPES: Final[Mapping[tuple[str, str], Recipe]] = {
    ("FrozenLake-v1", "q-table"): Recipe(
        settings=TableSettings(
            steps=300_000, num_envs=16, learning_rate=0.3, final_learning_rate=0.01, final_epsilon=0.1
        ),
        evaluate_every=50_000,
    ),
    ("CliffWalking-v1", "q-table"): Recipe(
        settings=TableSettings(
            steps=60_000, gamma=1.0, learning_rate=0.5, final_learning_rate=0.5, epsilon=0.1, final_epsilon=0.01
        ),
        evaluate_every=10_000,
    ),
    ("CliffWalking-v1", "sarsa"): Recipe(
        settings=TableSettings(
            steps=60_000, gamma=1.0, learning_rate=0.5, final_learning_rate=0.05, epsilon=0.1, final_epsilon=0.03
        ),
        evaluate_every=10_000,
    ),
    (ENV_ID, "q-table"): Recipe(
        settings=TableSettings(
            steps=40_000,
            num_envs=64,
            gamma=0.9,
            exploration=1.0,
            learning_rate=0.5,
            final_learning_rate=0.02,
            initial=6.0,
            cuts=CAR_IN_A_TABLE,
        ),
        make={"reward": MIDDLE},
        evaluate_every=40_000,
    ),
    ("CartPole-v1", "dqn"): Recipe(
        settings=DQNSettings(steps=80_000, steps_per_update=2, target_every=50, reward_scale=0.02),
        goal=490.0,
        evaluate_every=2_500,
    ),
    ("MountainCar-v0", "dqn"): Recipe(
        settings=DQNSettings(
            steps=300_000,
            hidden=(64, 64),
            gamma=0.98,
            learning_rate=4e-3,
            batch=128,
            steps_per_update=8,
            reward_scale=0.05,
            target_every=150,
            exploration=0.3,
            final_epsilon=0.02,
            hold=30,
        ),
        goal=-105.0,
    ),
    ("CartPole-v1", "reinforce"): Recipe(settings=ReinforceSettings(steps=300_000), goal=490.0),
    ("Acrobot-v1", "a2c"): Recipe(
        settings=ActorCriticSettings(
            steps=300_000, length=16, learning_rate=3e-3, gae_lambda=0.98, entropy=0.003, reward_scale=0.02
        ),
        goal=-90.0,
        evaluate_every=10_000,
    ),
    ("Acrobot-v1", "a3c"): Recipe(
        settings=A3CSettings(
            steps=300_000, length=16, learning_rate=1e-3, gae_lambda=0.98, entropy=0.003, reward_scale=0.02
        ),
        goal=-90.0,
        evaluate_every=10_000,
    ),
    ("CartPole-v1", "ppo"): Recipe(settings=PPOSettings(steps=200_000), goal=497.0),
    ("Acrobot-v1", "ppo"): Recipe(
        settings=PPOSettings(steps=150_000, num_envs=16, batch=256, learning_rate=2e-3, reward_scale=0.02),
        goal=-86.0,
        evaluate_every=10_000,
    ),
    ("ALE/Pong-v5", "ppo"): Recipe(
        settings=PPOSettings(
            steps=2_000_000,
            num_envs=16,
            hidden=(128, 128),
            learning_rate=5e-4,
            length=128,
            batch=256,
            entropy=0.01,
        ),
        evaluate_every=ATARI_EVERY,
    ),
    ("Pendulum-v1", "sac"): Recipe(settings=SACSettings(steps=20_000), goal=-165.0, evaluate_every=1_000),
}
"""By id and algorithm."""


def find_recipe(environment: str, algorithm: str) -> Recipe:
    """What is known to work; for other pairs the algorithm's own settings, and Gymnasium's threshold for a goal.

    Raises:
        ConfigError: There is no such algorithm, or the environment is no id.
    """
    check_type("environment", environment, str, "use an id of Gymnasium, such as 'CartPole-v1'")
    made = find_algorithm(algorithm)
    name = environment.rpartition(":")[2]
    is_atari = name.startswith("ALE/")
    make = {"obs_type": "ram"} if is_atari else MAKE.get(name, {})
    recipe = RECIPES.get((name, algorithm))
    if recipe is not None:
        return Recipe(
            settings=recipe.settings,
            goal=recipe.goal,
            make={**make, **recipe.make},
            evaluate_every=recipe.evaluate_every,
        )
    spec = gymnasium.registry.get(name)
    threshold = spec.reward_threshold if spec is not None else None
    return Recipe(
        settings=made.settings(),
        goal=math.inf if threshold is None else float(threshold),
        make=make,
        evaluate_every=ATARI_EVERY if is_atari else Recipe.evaluate_every,
    )


def default_algorithm(environment: str) -> str:
    """The first that is tuned for an environment.

    Raises:
        ConfigError: None is, or the environment is no id.
    """
    check_type("environment", environment, str, "use an id of Gymnasium, such as 'CartPole-v1'")
    name = environment.rpartition(":")[2]
    for tuned, algorithm in RECIPES:
        if tuned == name:
            return algorithm
    raise ConfigError(
        f"No algorithm was named, and none is tuned for {printable(environment)!r}.",
        hint="Choose one: --algorithm " + ", ".join(ALGORITHMS) + ".",
    )
