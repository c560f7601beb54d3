"""What DQN, and SAC, do when: how much it explores, how often it learns, and when its clock runs out."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.classic import dqn, job, learn
from racecraft.classic.network import Adam


def test_exploration_falls_evenly_to_its_end_and_stays_there() -> None:
    settings = dqn.DQNSettings(epsilon=0.9, final_epsilon=0.1, exploration=0.5)
    found = [dqn.epsilon(settings, share) for share in (0.0, 0.125, 0.25, 0.5, 0.75, 1.0)]
    assert found == pytest.approx([0.9, 0.7, 0.5, 0.1, 0.1, 0.1])
    assert dqn.epsilon(dqn.DQNSettings(epsilon=0.9, final_epsilon=0.1, exploration=0.0), 0.0) == pytest.approx(0.1)


@pytest.mark.parametrize(("steps_per_update", "num_envs"), [(4, 4), (1, 4), (8, 4), (10, 2)])
def test_so_many_steps_make_an_update_once_it_is_warm(
    monkeypatch: pytest.MonkeyPatch, steps_per_update: int, num_envs: int
) -> None:
    updates = list[float]()
    step = Adam.step

    def counted(self: Adam, gradient: np.ndarray) -> None:
        updates.append(self.learning_rate)
        step(self, gradient)

    monkeypatch.setattr(Adam, "step", counted)
    monkeypatch.setattr(job, "EPISODES", 1)
    settings = {"warm_up": 40, "batch": 4, "steps_per_update": steps_per_update, "num_envs": num_envs, "memory": 500}
    learn("CartPole-v1", "dqn", seed=1, settings={**settings, "learning_rate": 1.0}, until="240 steps")
    warm = 240 - 40 + num_envs  # the step that makes it warm counts
    assert len(updates) == warm // steps_per_update
    assert updates == sorted(updates, reverse=True)


def test_sac_learns_from_every_step_once_it_is_warm(monkeypatch: pytest.MonkeyPatch) -> None:
    stepped = list[int]()
    monkeypatch.setattr(Adam, "step", lambda self, gradient: stepped.append(len(gradient)))
    monkeypatch.setattr(job, "EPISODES", 1)
    settings = {"warm_up": 40, "batch": 4, "num_envs": 4, "steps_per_update": 2, "memory": 500}
    learn("Pendulum-v1", "sac", seed=1, settings=settings, until="100 steps")
    optimizers = 4  # of the actor, two critics and the temperature
    assert len(stepped) == optimizers * (100 - 40) // 2


@pytest.mark.parametrize(("environment", "algorithm"), [("CartPole-v1", "dqn"), ("Pendulum-v1", "sac")])
def test_a_memory_smaller_than_the_warm_up_is_warm_when_it_is_full(
    monkeypatch: pytest.MonkeyPatch, environment: str, algorithm: str
) -> None:
    monkeypatch.setattr(job, "EPISODES", 1)
    settings = {"warm_up": 1000, "memory": 16, "batch": 16, "num_envs": 4, "steps_per_update": 4}
    early, late = (learn(environment, algorithm, seed=1, settings=settings, until=f"{n} steps") for n in (8, 80))
    for name, weights in early.policy.arrays.items():
        assert (weights != late.policy.arrays[name]).any(), name


@pytest.mark.costly
def test_a_limit_in_seconds_lets_it_learn_until_then(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]

    def tick() -> float:
        clock[0] += 0.01
        return clock[0]

    monkeypatch.setattr(job.time, "perf_counter", tick)
    monkeypatch.setattr(job, "EPISODES", 1)
    short, long = (learn("FrozenLake-v1", "q-table", seed=1, until=f"{limit} s or 10000000 steps") for limit in (2, 8))
    assert short.reason == long.reason == "seconds"
    assert 50 < short.steps / short.lesson.settings.num_envs < 250
    assert long.steps > 3 * short.steps
