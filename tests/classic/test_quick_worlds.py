"""The quick worlds of these tests beside Gymnasium's: the same bits, step for step, at bounds and at the end, too."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from quick_worlds import QUICK, install

EPISODES = {
    "MountainCar-v0": 6,
    "CartPole-v1": 60,
    "Pendulum-v1": 6,
    "Acrobot-v1": 6,
    "FrozenLake-v1": 200,
    "CliffWalking-v1": 6,
}


def played(name: str) -> list[Any]:
    """Everything that comes out of episodes in which every action is drawn anew, or held for a while."""
    world: Any = gymnasium.make(name)
    lots = np.random.default_rng(1)
    came: list[Any] = []

    def keep(seen: Any, *more: Any) -> None:
        came.append((type(seen), np.asarray(seen).dtype, np.asarray(seen).tobytes(), *more))

    for episode in range(EPISODES[name]):
        keep(world.reset(seed=episode)[0])
        is_over, action = False, None
        while not is_over:
            if action is None or lots.random() < (1.0, 0.05)[episode % 2]:
                action = lots.uniform(-2.5, 2.5, 1).astype(np.float32)  # and beyond a pendulum's bounds
                action = action if name == "Pendulum-v1" else int(lots.integers(world.action_space.n))
            seen, reward, terminated, truncated, _ = world.step(action)
            keep(seen, np.float64(reward).tobytes(), terminated, truncated)
            is_over = terminated or truncated
    world.close()
    return came


@pytest.mark.costly
@pytest.mark.parametrize("name", EPISODES)
def test_a_quick_world_is_gymnasiums_to_the_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    own = played(name)
    install(monkeypatch.setattr)
    assert [getattr(owner, name) for owner, name, _ in QUICK] == [quick for _, _, quick in QUICK]
    assert played(name) == own
