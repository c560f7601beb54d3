"""What the plain command must reach, for three seeds, within a fixed number of steps; and what must not reach it.

`benchmarks/classic.py` measures the time. A bar is met by 100 greedy episodes that had no part in choosing the policy.
"""

from __future__ import annotations

import pytest

from racecraft.classic import find_recipe, learn

SEEDS = (1, 2, 3)
BARS = {
    ("CartPole-v1", "reinforce"): 475.0,
    ("Acrobot-v1", "a2c"): -100.0,
    ("CartPole-v1", "ppo"): 490.0,
    ("Acrobot-v1", "ppo"): -90.0,
    ("Pendulum-v1", "sac"): -180.0,
}
"""Mean return."""


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("environment", "algorithm"), list(BARS))
def test_the_plain_command_reaches_the_bar(environment: str, algorithm: str, seed: int) -> None:
    learned = learn(environment, algorithm, seed=seed)
    assert learned.mean_return >= BARS[environment, algorithm]
    assert learned.steps <= find_recipe(environment, algorithm).settings.steps * 1.01


CONTROLS = {
    ("CartPole-v1", "reinforce"): 20_000,
    ("CartPole-v1", "ppo"): 20_000,
    ("Pendulum-v1", "sac"): 4_000,
    ("Acrobot-v1", "a2c"): 20_000,
    ("Acrobot-v1", "ppo"): 20_000,
}
"""Steps."""


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("environment", "algorithm"), list(CONTROLS))
def test_without_a_learning_rate_nothing_reaches_the_bar(environment: str, algorithm: str) -> None:
    still = {"learning_rate": 0.0, **({"critic_learning_rate": 0.0} if algorithm == "reinforce" else {})}
    until = f"{CONTROLS[environment, algorithm]} steps"
    assert learn(environment, algorithm, seed=1, settings=still, until=until).mean_return < BARS[environment, algorithm]
