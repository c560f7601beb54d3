"""What is remembered of steps, and what they are said to have been worth, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from racecraft.classic.reinforce import Episode
from racecraft.classic.replay import Memory
from racecraft.classic.rollout import collect
from racecraft.classic.worlds import Step


def test_a_memory_gives_back_what_was_put_in_and_forgets_the_oldest() -> None:
    memory = Memory(6, (2,), (), np.int64)
    for pair in np.arange(8).reshape(4, 2):  # a step of two worlds; of eight steps the last six are left
        seen = np.stack([pair, pair + 0.25], axis=1).astype(np.float32)
        memory.add(seen, pair + 100, Step(np.float32(10 * pair), pair % 2 == 1, pair % 2 == 1, seen + 0.5))
    assert len(memory) == 6
    observations, actions, rewards, terminated, successors = memory.sample(200, np.random.default_rng(1))
    which = observations[:, 0].astype(int)
    assert set(which.tolist()) == {2, 3, 4, 5, 6, 7}
    assert (observations[:, 1] == which + 0.25).all()
    assert (actions == which + 100).all()
    assert (rewards == which * 10).all()
    assert (terminated == (which % 2 == 1)).all()
    assert (successors == observations + 0.5).all()


def test_the_return_of_every_step_of_an_episode() -> None:
    episode = Episode()
    episode.rewards = [1.0, 2.0, 4.0]
    assert episode.returns(0.5).tolist() == [3.0, 4.0, 4.0]
    episode.tail = 8.0
    assert episode.returns(0.5).tolist() == [4.0, 6.0, 8.0]


class Scripted:
    """A world that goes as it is written: the second of three steps ends an episode, for good or by a time limit."""

    def __init__(self, *, is_end: bool) -> None:
        self.observations = np.float32([[1.0]])
        self._steps = iter([(1.0, False, 2.0, 2.0), (2.0, True, 9.0, 3.0), (4.0, False, 4.0, 4.0)])
        self._is_end = is_end

    def step(self, actions: Any) -> Step:
        reward, over, successor, following = next(self._steps)
        self.observations = np.float32([[following]])
        is_over = np.array([over])
        return Step(np.float32([reward]), is_over & self._is_end, is_over, np.float32([[successor]]))


class Valuer:
    """Takes an observation for its value, and always does the same."""

    def sample(self, observations: Any, rng: Any) -> Any:
        return np.zeros(len(observations), np.int64)

    def value(self, observations: Any) -> Any:
        return observations[..., 0]


@pytest.mark.parametrize(("is_end", "advantages"), [(True, [-0.35, -1.8, -0.6]), (False, [0.775, 2.7, -0.6])])
def test_advantages_end_with_their_episode(is_end: bool, advantages: list[float]) -> None:
    worlds: Any = Scripted(is_end=is_end)
    policy: Any = Valuer()
    rng = np.random.default_rng(1)
    found = collect(worlds, policy, rng, length=3, gamma=0.5, gae_lambda=0.5, reward_scale=0.1)
    assert found.observations.tolist() == [[1.0], [2.0], [3.0]]
    assert found.advantages == pytest.approx(advantages, abs=1e-6)
    assert found.returns == pytest.approx(np.add(advantages, [1.0, 2.0, 3.0]), abs=1e-6)
