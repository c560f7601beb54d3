"""Worlds and what is seen of them: bounds, cells, resets, seeds, and everything that cannot be made."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from racecraft.classic.evaluation import play
from racecraft.classic.policy import Table
from racecraft.classic.recipes import find_recipe
from racecraft.classic.views import CellView, Cut, VectorView
from racecraft.classic.worlds import Worlds, to_bounds
from racecraft.errors import ConfigError, TrainingError


def worlds(name: str, **more: Any) -> Worlds:
    return Worlds(name, **{"num_envs": 3, "seed": 1, "view": VectorView, **more})


def test_numbers_with_bounds_are_scaled_and_others_are_not() -> None:
    space = spaces.Box(np.array([0.0, -np.inf]), np.array([10.0, np.inf]), dtype=np.float64)
    view = VectorView(space)
    assert view.size == 2
    assert view([np.array([0.0, 7.0]), np.array([10.0, -7.0])]).tolist() == [[-1.0, 7.0], [1.0, -7.0]]


def test_choices_become_zeros_and_a_one() -> None:
    assert VectorView(spaces.Discrete(3, start=5))([5, 7]).tolist() == [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    mixed = spaces.Tuple((spaces.Discrete(2), spaces.Discrete(3)))
    assert VectorView(mixed)([(1, 2), (0, 0)]).tolist() == [[0, 1, 0, 0, 1], [1, 0, 1, 0, 0]]


def test_every_cell_has_its_number() -> None:
    view = CellView(spaces.Box(-1.0, 1.0, (2,)), bins=4)
    assert view.size == 16
    grid = [np.array([x, y]) for x in (-0.75, -0.25, 0.25, 0.75) for y in (-0.75, -0.25, 0.25, 0.75)]
    assert view(grid).tolist() == list(range(16))
    assert view([np.array([-9.0, 9.0])]).tolist() == [3]
    own = CellView(spaces.Box(-1.0, 1.0, (3,)), cuts=(Cut(2, (0.0,)), Cut(0, (-0.5, 0.5))))
    assert own(np.array([[0.6, 0.0, -1.0], [-0.6, 0.0, 1.0]])).tolist() == [2, 3]
    mixed = CellView(spaces.Tuple((spaces.Discrete(2), spaces.Discrete(3, start=1))))
    assert mixed([(a, b) for a in (0, 1) for b in (1, 2, 3)]).tolist() == list(range(6))
    assert CellView(spaces.MultiDiscrete([2, 3]))(np.array([[1, 2]])).tolist() == [5]


@pytest.mark.parametrize(
    ("space", "says"),
    [
        (spaces.Box(-1.0, 1.0, (12,)), "1,000,000,000,000 cells is too large"),
        (spaces.Box(0, 255, (4, 4), np.uint8), "too many for a table"),
        (spaces.Dict({"a": spaces.Discrete(2)}), "have no cells"),
    ],
)
def test_what_no_table_holds(space: Any, says: str) -> None:
    with pytest.raises(ConfigError, match=says) as refused:
        CellView(space)
    assert "dqn" in refused.value.hint


def test_what_no_network_takes() -> None:
    with pytest.raises(ConfigError, match="100,800 numbers"):
        VectorView(spaces.Box(0, 255, (210, 160, 3), np.uint8))
    with pytest.raises(ConfigError, match="no fixed size"):
        VectorView(spaces.Sequence(spaces.Discrete(2)))


def test_actions_reach_the_bounds() -> None:
    space = spaces.Box(np.array([-2.0, 0.0]), np.array([2.0, 1.0]), dtype=np.float64)
    assert to_bounds(np.array([[-1.0, 1.0], [0.0, 0.0], [9.0, -9.0]]), space).tolist() == [[-2, 1], [0, 0.5], [2, 0]]


def test_actions_without_bounds_stay_as_they_are() -> None:
    space = spaces.Box(-np.inf, np.inf, (2,), np.float32)
    assert to_bounds(np.array([[0.5, -3.0]]), space).tolist() == [[0.5, -3.0]]


def test_environments_are_closed_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = list[Any]()
    close = gymnasium.Wrapper.close
    monkeypatch.setattr(gymnasium.Wrapper, "close", lambda self: (closed.append(self.unwrapped), close(self))[1])
    Worlds("FrozenLake-v1", num_envs=3, seed=1, view=CellView).close()
    assert len(set(map(id, closed))) == 3


def test_a_world_begins_anew_and_still_tells_what_came_last() -> None:
    made = worlds("CartPole-v1")
    begun = made.observations.copy()
    for _ in range(200):
        step = made.step(np.ones(3, np.int64))
        if step.over.any():
            break
    world = int(np.flatnonzero(step.over)[0])
    assert abs(step.successors[world, 2]) > 0.45  # fallen: past 0.2095 rad of the bound 0.4189
    assert abs(made.observations[world, 2]) < 0.2
    assert (made.observations[~step.over] == step.successors[~step.over]).all()
    assert made.returns == [made.steps / 3.0] * int(step.over.sum())
    assert step.terminated[world]
    assert not (made.observations[world] == begun[world]).all()


def test_seeds() -> None:
    first, same, other = worlds("CartPole-v1"), worlds("CartPole-v1"), worlds("CartPole-v1", seed=2)
    assert (first.observations == same.observations).all()
    assert not (first.observations == other.observations).any()
    assert len({tuple(row) for row in first.observations.tolist()}) == 3  # no two worlds alike
    for _ in range(30):
        assert (first.step(np.zeros(3, np.int64)).successors == same.step(np.zeros(3, np.int64)).successors).all()


@pytest.mark.costly
def test_our_own_cars_are_the_same_alone_and_together() -> None:
    from racecraft.classic.recipes import MAKE

    make = dict(MAKE["Racecraft-v0"])
    made = worlds("Racecraft-v0", num_envs=4, make=make)
    singles = [gymnasium.make("racecraft.env:Racecraft-v0", **make) for _ in range(4)]
    seeds = [int(key) for key in np.random.SeedSequence(1).generate_state(4, np.uint32)]
    for car, single in enumerate(singles):
        seen, _ = single.reset(seed=seeds[car])
        assert made.observations[car] == pytest.approx(made.view([seen])[0])
    over = 0
    for turn in range(60):
        actions = (np.arange(4) + turn) % 5
        step = made.step(actions)
        for car, single in enumerate(singles):
            seen, reward, terminated, truncated, _ = single.step(int(actions[car]))
            assert step.successors[car] == pytest.approx(made.view([seen])[0])
            assert (step.rewards[car], step.terminated[car]) == (pytest.approx(reward), terminated)
            assert step.over[car] == (terminated or truncated)
            if step.over[car]:
                over += 1
                seen, _ = single.reset()
            assert made.observations[car] == pytest.approx(made.view([seen])[0])
    assert over > 0
    made.close()


def test_every_world_plays_one_episode() -> None:
    """Short episodes must not count more often than long ones."""
    made = Worlds("FrozenLake-v1", num_envs=30, seed=1, view=CellView)
    returns = play(made, Table(16, 4))
    assert returns.shape == (30,)
    assert set(returns.tolist()) <= {0.0, 1.0}
    made = Worlds("CartPole-v1", num_envs=10, seed=1, view=CellView)
    lengths = play(made, Table(made.view.size, 2))  # always left: falls
    assert ((lengths >= 7) & (lengths <= 12)).all()


def test_an_episode_without_a_limit_is_cut_off() -> None:
    returns = play(Worlds("CliffWalking-v1", num_envs=2, seed=1, view=CellView), Table(48, 4))  # up, for ever
    assert returns.tolist() == [-1000.0, -1000.0]


class Broken(gymnasium.Env[Any, Any]):
    """Fails, or pays what is no number."""

    observation_space, action_space = spaces.Box(-1.0, 1.0, (1,)), spaces.Discrete(2)

    def __init__(self, at: str) -> None:
        self.at = at

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        if self.at == "reset":
            raise AttributeError("no such\nthing")
        return np.zeros(1, np.float32), {}

    def step(self, action: Any) -> Any:
        if self.at == "step":
            raise KeyError("wheel")
        return np.zeros(1, np.float32), float(self.at), True, False, {}


@pytest.mark.parametrize(
    ("at", "says"),
    [
        ("reset", "Broken-v0 has failed while it was played: AttributeError: no such thing"),
        ("step", "Broken-v0 has failed while it was played: KeyError: 'wheel'"),
        ("nan", "Broken-v0 has given a reward that is no finite number"),
        ("-inf", "Broken-v0 has given a reward that is no finite number"),
    ],
)
def test_an_environment_that_fails_is_named(at: str, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gymnasium.envs.registration, "registry", {**gymnasium.registry})
    gymnasium.register("Broken-v0", Broken)
    with pytest.raises(TrainingError, match=says):
        worlds("Broken-v0", make={"at": at}).step(np.zeros(3, np.int64))


@pytest.mark.parametrize(
    ("name", "make", "says"),
    [
        ("CartPole-v9", {}, "There is no environment 'CartPole-v9'"),
        ("CartPoel-v1", {}, "There is no environment"),
        ("", {}, "There is no environment"),
        ("nowhere:CartPole-v1", {}, "There is no environment"),
        ("CartPole-v1", {"wheels": 4}, "CartPole-v1 cannot be made with wheels=4"),
        ("FrozenLake-v1", {"map_name": "5x5"}, "FrozenLake-v1 cannot be made"),
        ("Racecraft-v0", {"track": "ovla"}, "ovla"),
        ("Racecraft-v0", {"wheels": 4}, "cannot be made with wheels=4"),
        ("Ant-v5", {}, "needs more than is installed"),
    ],
)
def test_what_cannot_be_made_is_told_in_one_sentence(name: str, make: dict[str, Any], says: str) -> None:
    from racecraft.errors import RacecraftError

    with pytest.raises(RacecraftError, match="(?s)" + says.replace("(", r"\(")):
        worlds(name, make=make)


def test_atari_names_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.util

    if importlib.util.find_spec("ale_py") is not None:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match="ALE/Pong-v5 is a game of Atari and needs ale_py") as refused:
        worlds("ALE/Pong-v5")
    assert "racecraft[atari]" in refused.value.hint


@pytest.mark.parametrize("algorithm", ["dqn", "ppo"])
def test_atari_is_learned_from_memory_and_judged_seldom(algorithm: str) -> None:
    pong, other = find_recipe("ALE/Pong-v5", algorithm), find_recipe("Taxi-v4", algorithm)
    assert pong.make == {"obs_type": "ram"}
    assert pong.evaluate_every == 10 * other.evaluate_every
