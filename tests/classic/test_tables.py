"""Tables against dynamic programming, and against updates worked out by hand."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from racecraft.classic import learn
from racecraft.classic.policy import Table
from racecraft.classic.q_table import TableSettings, epsilon, epsilon_greedy, learning_rate
from racecraft.classic.q_table import learn as q_learn
from racecraft.classic.sarsa import learn as sarsa_learn

pytestmark = pytest.mark.usefixtures("quickly")

Floats = np.ndarray[Any, Any]


def model(name: str) -> tuple[Floats, Floats, Floats]:
    """Chances (states, actions, next), rewards (states, actions), and whether the step ends it, as `chances`."""
    env: Any = gymnasium.make(name).unwrapped
    n, m = env.observation_space.n, env.action_space.n
    going, rewards, ending = np.zeros((n, m, n)), np.zeros((n, m)), np.zeros((n, m, n))
    for state, actions in env.P.items():
        for action, outcomes in actions.items():
            for chance, successor, reward, is_end in outcomes:
                (ending if is_end else going)[state, action, successor] += chance
                rewards[state, action] += chance * reward
    return going, rewards, ending


def optimal(name: str, gamma: float) -> Floats:
    """Q* by value iteration."""
    going, rewards, _ = model(name)
    values = np.zeros_like(rewards)
    for _ in range(5000):
        values = rewards + gamma * going @ values.max(axis=1)
    return values


def success(policy: Floats, *, steps: int = 100) -> float:
    """Exact return of a greedy policy on FrozenLake from its first state within Gymnasium's time limit."""
    going, rewards, _ = model("FrozenLake-v1")
    place, total = np.eye(len(policy))[0], 0.0
    rows = np.arange(len(policy))
    for _ in range(steps):
        total += place @ rewards[rows, policy]
        place = place @ going[rows, policy]
    return float(total)


def test_the_optimum_is_what_the_literature_says() -> None:
    assert success(optimal("FrozenLake-v1", 0.99).argmax(axis=1)) == pytest.approx(0.744, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_q_learning_crosses_the_frozen_lake(seed: int) -> None:
    learned = learn("FrozenLake-v1", "q-table", seed=seed)
    table: Any = learned.policy
    assert learned.steps == 300_000
    assert success(table.values.argmax(axis=1)) >= 0.70  # exactly; a hundred episodes are off by 0.04


@pytest.mark.slow
def test_beside_the_cliff_q_learning_walks_along_the_edge_and_sarsa_does_not() -> None:
    careful, bold = (learn("CliffWalking-v1", algorithm, seed=1) for algorithm in ("sarsa", "q-table"))
    assert np.mean(careful.returns[-1000:]) == pytest.approx(-17.0, abs=2.0)
    assert np.mean(bold.returns[-1000:]) == pytest.approx(-17.0, abs=2.0)
    assert bold.mean_return == -13.0
    assert -17.0 <= careful.mean_return < -13.0


def stumbling(share: float) -> tuple[float, float]:
    """Exact return beside the cliff of the best that takes this share of its steps by lot, and of it without them."""
    going, rewards, ending = model("CliffWalking-v1")
    values = np.zeros_like(rewards)
    for _ in range(500):
        values = rewards + going @ ((1.0 - share) * values.max(axis=1) + share * values.mean(axis=1))
    place, start, steps, is_over = 36, values[36], 0, False
    while not is_over and steps < 100:
        action = int(values[place].argmax())
        is_over, steps = bool(ending[place, action].any()), steps + 1
        place = int(going[place, action].argmax())
    return (1.0 - share) * float(start.max()) + share * float(start.mean()), float(-steps)


def test_who_stumbles_enough_to_earn_minus_17_keeps_off_the_edge() -> None:
    """What SARSA would end at if it were exact: -17 while learning and -13 without exploring are two walkers."""
    exact = {share: stumbling(share) for share in (0.0, 0.007, 0.01, 0.03, 0.04, 0.07, 0.2)}
    assert exact[0.0] == (-13.0, -13.0)
    assert [greedy for _, greedy in exact.values()] == [-13.0, -13.0, -15.0, -15.0, -15.0, -15.0, -17.0]
    assert [round(earned, 1) for earned, _ in exact.values()] == [-13.0, -15.1, -15.4, -16.4, -17.0, -18.7, -28.6]


@pytest.mark.slow
@pytest.mark.parametrize(("environment", "algorithm"), [("FrozenLake-v1", "q-table"), ("CliffWalking-v1", "sarsa")])
def test_without_learning_nothing_is_learned(environment: str, algorithm: str) -> None:
    still = {"learning_rate": 0.0, "final_learning_rate": 0.0}
    learned = learn(environment, algorithm, seed=1, settings=still, until="20000 steps")
    assert learned.mean_return < (0.2 if environment == "FrozenLake-v1" else -90.0)


class Corridor(gymnasium.Env[Any, Any]):
    """Cells 0 to 3; right leads on, left back; the end pays 1. A step limit may cut it off."""

    def __init__(self, *, limit: int = 0) -> None:
        self.observation_space, self.action_space = spaces.Discrete(4), spaces.Discrete(2)
        self.limit, self.place, self.taken = limit, 0, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.place = self.taken = 0
        return 0, {}

    def step(self, action: Any) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.place = max(self.place + (1 if action == 1 else -1), 0)
        self.taken += 1
        is_end = self.place == 3
        return self.place, float(is_end), is_end, not is_end and self.taken == self.limit, {}


@pytest.fixture(autouse=True)
def _corridor() -> Any:
    gymnasium.register("Corridor-v0", Corridor)
    yield
    del gymnasium.registry["Corridor-v0"]


@pytest.mark.parametrize("algorithm", ["q-table", "sarsa"])
def test_a_corridor_is_valued_as_dynamic_programming_does(algorithm: str) -> None:
    settings = {"gamma": 0.5, "epsilon": 1.0, "final_epsilon": 0.0, "exploration": 0.9, "learning_rate": 0.5}
    learned = learn("Corridor-v0", algorithm, seed=1, until="8000 steps", settings={**settings, "num_envs": 2})
    table: Any = learned.policy
    assert table.values[2] == pytest.approx([table.values[1].max() * 0.5, 1.0], abs=0.13)
    assert table.values.argmax(axis=1)[:3].tolist() == [1, 1, 1]
    if algorithm == "q-table":
        assert table.values[:3] == pytest.approx(np.array([[0.125, 0.25], [0.125, 0.5], [0.25, 1.0]]), abs=1e-3)


def test_a_time_limit_is_not_an_end() -> None:
    """With an episode cut off after two steps, what lies beyond still counts: the value of cell 0 is not 0."""
    learned = learn(
        "Corridor-v0", "q-table", seed=1, until="6000 steps", make={"limit": 4}, settings={"gamma": 0.5, "epsilon": 0.5}
    )
    table: Any = learned.policy
    assert table.values[0, 1] == pytest.approx(0.25, abs=0.01)
    assert table.values[1, 0] == pytest.approx(0.125, abs=0.01)


class Scripted:
    """Worlds whose next step is written down."""

    num_envs = 1

    def __init__(self, steps: list[tuple[int, float, bool, bool]]) -> None:
        self.script, self.steps, self.observations = steps, 0, np.array([0])

    def step(self, actions: Floats) -> Any:
        from racecraft.classic.worlds import Step

        successor, reward, terminated, over = self.script[self.steps]
        self.steps += 1
        self.observations = np.array([0 if over else successor])
        return Step(np.array([reward], np.float32), np.array([terminated]), np.array([over]), np.array([successor]))


@pytest.mark.parametrize("learner", [q_learn, sarsa_learn])
def test_one_step_moves_a_value_by_alpha_times_the_surprise(learner: Any) -> None:
    settings = TableSettings(
        steps=2, gamma=0.5, epsilon=0.0, final_epsilon=0.0, learning_rate=0.1, final_learning_rate=0.1
    )
    table = Table(3, 2)
    table.values[:] = [[1.0, 0.0], [0.0, 4.0], [7.0, 7.0]]
    worlds: Any = Scripted([(1, 3.0, False, False), (2, -1.0, True, True)])
    for _ in learner(worlds, table, settings, np.random.default_rng()):
        pass
    assert table.values[0] == pytest.approx([1.0 + 0.1 * (3.0 + 0.5 * 4.0 - 1.0), 0.0])
    assert table.values[1] == pytest.approx([0.0, 4.0 + 0.1 * (-1.0 - 4.0)])


def test_sarsa_learns_from_the_action_that_it_takes() -> None:
    """Half of the time the next action is the bad one, and its value is what counts; Q-learning sees only the good."""
    settings = TableSettings(
        steps=2, gamma=1.0, epsilon=1.0, final_epsilon=1.0, learning_rate=1.0, final_learning_rate=1.0
    )
    learned: dict[Any, set[float]] = {sarsa_learn: set(), q_learn: set()}
    for learner, found in learned.items():
        for seed in range(20):
            table = Table(2, 2)
            table.values[:] = [[0.0, 0.0], [10.0, -10.0]]
            worlds = Scripted([(1, 0.0, False, False), (1, 0.0, False, True)])
            next(learner(worlds, table, settings, np.random.default_rng(seed)))
            found.add(float(table.values[0].sum()))
    assert learned == {sarsa_learn: {10.0, -10.0}, q_learn: {10.0}}


def test_exploration_draws_as_often_as_it_should() -> None:
    rng = np.random.default_rng(1)
    values = np.tile([0.0, 5.0, 1.0], (30_000, 1))
    shares = np.bincount(epsilon_greedy(values, 0.3, rng), minlength=3) / 30_000
    assert shares == pytest.approx([0.1, 0.8, 0.1], abs=0.01)


def test_schedules() -> None:
    settings = TableSettings(
        epsilon=1.0, final_epsilon=0.2, exploration=0.5, learning_rate=0.4, final_learning_rate=0.2
    )
    assert [epsilon(settings, share) for share in (0.0, 0.25, 0.5, 1.0)] == pytest.approx([1.0, 0.6, 0.2, 0.2])
    assert [learning_rate(settings, share) for share in (0.0, 0.5, 1.0)] == pytest.approx([0.4, 0.3, 0.2])
    assert epsilon(TableSettings(exploration=0.0, final_epsilon=0.1), 0.0) == pytest.approx(0.1)
