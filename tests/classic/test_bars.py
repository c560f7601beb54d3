"""What the plain command's settings must reach, for each seed, within a fixed number of steps; and what must not.

`benchmarks/classic.py` measures the time. A bar is met by 100 greedy episodes that had no part in choosing the policy.
Learning ends here as soon as the bar is reached; the plain command goes on to a goal above it, on the same steps.
Gymnasium's worlds compute the same bits as ever, in a fraction of the time (`quick_worlds.py`).
"""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import cache
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from racecraft.classic import Learned, find_recipe, job, learn
from racecraft.classic.algorithms import find_algorithm
from racecraft.classic.evaluation import play
from racecraft.classic.job import JUDGE, LEARN, view_of, worlds_of

pytestmark = pytest.mark.usefixtures("quickly")

SEEDS = (1, 2, 3)
BARS = {
    ("CartPole-v1", "dqn"): 475.0,
    ("MountainCar-v0", "dqn"): -110.0,
    ("CartPole-v1", "reinforce"): 475.0,
    ("Acrobot-v1", "a2c"): -100.0,
    ("CartPole-v1", "ppo"): 490.0,
    ("Acrobot-v1", "ppo"): -90.0,
    ("Pendulum-v1", "sac"): -180.0,
}
"""Mean return."""
LONG = {("CartPole-v1", "dqn"), ("MountainCar-v0", "dqn"), ("Pendulum-v1", "sac")}
"""Learn for seconds, and so from one seed here; `benchmarks/classic.py` takes as many as are asked for."""
LEARNED = [(*bar, seed) for bar in BARS for seed in (SEEDS[:1] if bar in LONG else SEEDS)]


@cache
def learned_by(environment: str, algorithm: str, seed: int) -> Learned:
    """What the plain command has learned when it reaches the bar, once for all tests."""
    return learn(environment, algorithm, seed=seed, until=f"{BARS[environment, algorithm]:g} return")


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("environment", "algorithm", "seed"), LEARNED)
def test_the_plain_command_reaches_the_bar(environment: str, algorithm: str, seed: int) -> None:
    learned = learned_by(environment, algorithm, seed)
    assert learned.mean_return >= BARS[environment, algorithm]
    recipe = find_recipe(environment, algorithm)
    assert learned.steps <= recipe.settings.steps * 1.01
    assert recipe.goal > BARS[environment, algorithm]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_asynchronous_processes_learn_as_well() -> None:
    # which of the processes comes first is chance: one seed alone may be further off, so its goal is well above the bar
    alone = [learned_by("Acrobot-v1", "a2c", seed).mean_return for seed in SEEDS]
    together = [learn("Acrobot-v1", "a3c", seed=seed, until="-87 return") for seed in SEEDS]
    assert all(one.returns and one.mean_return >= -100.0 for one in together)
    assert np.median([one.mean_return for one in together]) >= np.median(alone) - 10.0


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_table_drives_the_oval(seed: int) -> None:
    learned = learn("Racecraft-v0", "q-table", seed=seed)
    assert learned.steps <= 40_000 + 64
    assert laps(learned) == 20


def laps(learned: Any) -> int:
    """Of 20 greedy episodes, each from its own place on the oval, those that complete the lap."""
    make = {"num_envs": 20, "autoreset_mode": AutoresetMode.DISABLED, **learned.lesson.make}
    cars: Any = gymnasium.make_vec("racecraft:Racecraft-v0", **make)
    seen, _ = cars.reset(seed=1000)
    view = view_of(learned.lesson)(cars.single_observation_space)
    complete = over = np.zeros(20, np.bool_)
    for _ in range(3000):
        seen, _, terminated, truncated, infos = cars.step(learned.policy.act(view(seen)))
        complete = complete | (~over & (infos["status"] == "lap_complete"))
        over = over | terminated | truncated
        if over.all():
            break
        if (terminated | truncated).any():
            seen, _ = cars.reset(options={"reset_mask": terminated | truncated})
    cars.close()
    return int(complete.sum())


class ByLot(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Pays by lot, whatever is done."""

    def step(self, action: Any) -> Any:
        seen, _, terminated, truncated, info = self.env.step(action)
        return seen, float(self.np_random.choice((-1.0, 1.0))), terminated, truncated, info


CONTROLS = {
    ("CartPole-v1", "dqn"): 4_000,
    ("MountainCar-v0", "dqn"): 4_000,
    ("CartPole-v1", "reinforce"): 12_000,
    ("CartPole-v1", "ppo"): 8_000,
    ("Pendulum-v1", "sac"): 4_000,
    ("Acrobot-v1", "a2c"): 5_000,
    ("Acrobot-v1", "ppo"): 5_000,
}
"""Steps; REINFORCE, PPO and SAC reach the bar within so many where they may learn, on CartPole and Pendulum."""


@pytest.fixture
def judged_briefly(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is far below a bar needs no hundred episodes."""
    monkeypatch.setattr(job, "EPISODES", 5)
    monkeypatch.setattr(job, "JUDGED", 5)


@pytest.mark.slow
@pytest.mark.usefixtures("judged_briefly")
@pytest.mark.parametrize(("environment", "algorithm"), list(CONTROLS))
def test_without_a_learning_rate_nothing_reaches_the_bar(environment: str, algorithm: str) -> None:
    still = {"learning_rate": 0.0, **({"critic_learning_rate": 0.0} if algorithm == "reinforce" else {})}
    learned = learn(environment, algorithm, seed=1, settings=still, until="2500 steps")
    assert learned.mean_return < BARS[environment, algorithm]
    worlds = worlds_of(learned.lesson, num_envs=learned.lesson.settings.num_envs, purpose=LEARN)
    begun = find_algorithm(algorithm).begin(worlds, learned.lesson.settings, np.random.default_rng((1, 0)))
    worlds.close()
    for name, array in learned.policy.arrays.items():
        assert np.array_equal(array, begun.arrays[name]), name


@pytest.mark.slow
@pytest.mark.usefixtures("judged_briefly")
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("environment", "algorithm"), list(CONTROLS))
def test_rewards_by_lot_teach_nothing(environment: str, algorithm: str) -> None:
    gymnasium.register("ByLot-v0", lambda **make: ByLot(gymnasium.make(environment, **make)))
    settings = find_recipe(environment, algorithm).settings
    try:
        learned = learn(
            "ByLot-v0",
            algorithm,
            seed=1,
            settings={name: value for name, value in asdict(settings).items() if name != "steps"},
            until=f"{CONTROLS[environment, algorithm]} steps",
        )
    finally:
        del gymnasium.registry["ByLot-v0"]
    judged = worlds_of(replace(learned.lesson, environment=environment), num_envs=20, purpose=JUDGE)
    assert play(judged, learned.policy).mean() < BARS[environment, algorithm]
