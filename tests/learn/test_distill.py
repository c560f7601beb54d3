"""Distillation on a toy world: what the student learns from its teacher, and resuming."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scheduled_world import ScheduledWorld
from stripe_world import StripeWorld

from racecraft.errors import CheckpointError, ConfigError
from racecraft.learn import Learner, NetworkSpec, distill, distributions, make_learner
from racecraft.learn.distill import ANSWER_STD, Distill, DistillConfig, sure_answers

CONFIG = DistillConfig(num_envs=8, num_steps=8, teacher_steps=1, minibatch_size=32, buffer_size=512)


def open_teacher(teacher: Learner) -> StripeWorld:
    return StripeWorld(16, seed=4)


def make(config: DistillConfig = CONFIG, *, is_discrete: bool = True, seed: int = 0) -> Distill:
    spec = NetworkSpec(num_actions=3 if is_discrete else 1, is_discrete=is_discrete, state_size=2)
    learner = make_learner(spec, seed=seed, num_threads=1)
    return Distill(config, learner, StripeWorld(config.num_envs), open_teacher, seed=seed)


def mean_reward(trained: Distill) -> float:
    world = StripeWorld(32, seed=9, time_limit=10**6)
    rewards = []
    with trained.driving():
        for _ in range(30):
            outputs = trained.learner.policy(trained.learner.encode(world.observe()[0]))
            reward, terminated, _ = world.step(distributions.most_likely(outputs, is_discrete=trained.spec.is_discrete))
            rewards.append(reward.mean())
            if terminated.any():
                world.reset(terminated)
    return float(np.mean(rewards[10:]))


@pytest.mark.slow
@pytest.mark.parametrize("is_discrete", [True, False])
def test_a_student_with_a_camera_learns_what_its_teacher_knows(is_discrete: bool) -> None:
    trained = make(replace(CONFIG, teacher_steps=16_000), is_discrete=is_discrete)
    before = mean_reward(trained)
    while not trained.is_teaching:
        assert trained.iterate().num_steps == 0
    assert trained.total_steps == 0
    for _ in range(16):
        stats = trained.iterate()
    assert (stats.num_steps, trained.total_steps) == (64, 16 * 64)
    assert before < 0.7 < 0.8 < mean_reward(trained)


@pytest.mark.slow
def test_from_a_teacher_that_knows_nothing_nothing_is_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distill, "TEACHER_PPO", replace(distill.TEACHER_PPO, learning_rate=0.0))
    trained = make()
    for _ in range(17):
        trained.iterate()
    assert mean_reward(trained) < 0.7


def test_the_teachers_steps_become_smaller() -> None:
    moved = []
    for teacher_rate_steps in (0, 10):
        trained = make(replace(CONFIG, teacher_steps=10_000, teacher_rate_steps=teacher_rate_steps))
        trained.iterate()
        before = trained.teacher.learner.weights()
        trained.iterate()
        after = trained.teacher.learner.weights()
        moved.append(sum(float(np.abs(after[name] - before[name]).sum()) for name in before))
    assert 0 < moved[1] < 0.5 * moved[0]


def test_the_students_steps_become_smaller() -> None:
    moved = []
    for rate_steps in (0, 10):
        trained = make(replace(CONFIG, rate_steps=rate_steps))
        lesson = trained.iterate()  # the teacher
        assert (lesson.iteration, lesson.total_steps, lesson.num_steps) == (1, 0, 0)  # the student has driven nowhere
        before = trained.learner.weights()
        for _ in range(3):
            trained.iterate()
        after = trained.learner.weights()
        moved.append(sum(float(np.abs(after[name] - before[name]).sum()) for name in before))
    assert 0 < moved[1] < 0.5 * moved[0]


@pytest.mark.costly
def test_what_a_teacher_answers_is_its_mean_without_its_exploring() -> None:
    trained = make(is_discrete=False)
    for _ in range(40):
        trained.iterate()
    explored = np.exp(trained.teacher.learner.weights()["policy.log_std"])
    learned = np.exp(trained.learner.weights()["policy.log_std"])
    assert learned < 0.8 * explored


def test_an_answer_is_what_the_teachers_car_would_do() -> None:
    outputs = np.array([[0.25, -3.0, 0.5, -1.0], [1.75, 1.0, 0.5, -1.0]], np.float32)
    answers = sure_answers(outputs)
    np.testing.assert_array_equal(answers[:, :2], distributions.most_likely(outputs, is_discrete=False))
    np.testing.assert_allclose(np.exp(answers[:, 2:]), ANSWER_STD, rtol=1e-6)


def test_the_same_seed_gives_the_same_bits_and_a_resumed_run_has_them() -> None:
    first, second, third = make(), make(), make(seed=3)
    for _ in range(3):
        first.iterate()
        second.iterate()
    state = first.state()
    third.load_state(state)
    for trained in (second, third):
        for name, array in trained.state().items():
            np.testing.assert_array_equal(array, state[name], err_msg=name)
    assert third.is_teaching
    assert third.iterate().total_steps == 3 * 64
    with pytest.raises(CheckpointError, match="no entry"):
        third.load_state({})
    with pytest.raises(CheckpointError, match="of 4 cars"):
        third.load_state({**state, "distill/episodes": np.zeros((2, 4))})


@pytest.mark.parametrize("is_discrete", [True, False])
def test_after_its_lessons_the_student_goes_on_with_the_reward_and_its_teachers_critic(is_discrete: bool) -> None:
    trained = make(replace(CONFIG, student_steps=128, refining_rate=0.0), is_discrete=is_discrete)
    for _ in range(3):
        trained.iterate()
    assert (trained.refining, trained.is_refining) == (None, True)
    student, critic = trained.driving_weights, trained.teacher.learner.weights()
    taught = {name: array.copy() for name, array in student.items() if name.startswith("critic.")}

    stats = trained.iterate()
    assert stats.total_steps == trained.total_steps == 128 + stats.num_steps
    for name, array in trained.driving_weights.items():
        if name.startswith("critic."):
            np.testing.assert_array_equal(array, critic[name], err_msg=name)
            assert name.endswith(".bias") or not np.array_equal(array, taught[name])
    assert abs(stats.losses.policy_loss) < 1e-3


def test_the_student_takes_its_teachers_critic_in_the_teachers_unit() -> None:
    """A critic's outputs mean a return only together with the unit it learned them in."""
    trained = make(replace(CONFIG, student_steps=64))
    for _ in range(2):
        trained.iterate()
    refining = trained._begin_refining()
    world = StripeWorld(32, seed=2)
    frames, states = world.observe()
    told = trained.teacher.learner.values(states, states)
    np.testing.assert_array_equal(refining.learner.values(refining.learner.encode(frames), states), told)
    np.testing.assert_array_equal(refining.return_scale, trained.teacher.return_scale)
    assert np.ptp(told * refining.return_scale[1]) > 0.1
    assert not np.array_equal(refining.return_scale, [0.0, 1.0])
    assert (refining.iteration, refining.total_steps) == (trained.iteration - 1, trained.total_steps)


def test_the_students_returns_and_lengths_are_those_of_the_episodes_that_ended() -> None:
    world = ScheduledWorld([[3, 4], [6, 9]], [1.0, 0.5], cars_cut=[1])  # by turns; an iteration is 8 steps
    world.reset(np.ones(2, bool))
    config = replace(CONFIG, num_envs=2)
    learner = make_learner(NetworkSpec(num_actions=3, state_size=2), num_threads=1)
    trained = Distill(config, learner, world, open_teacher)
    trained.iterate()  # the teacher
    first, second = trained.iterate(), trained.iterate()
    assert (first.episodes, first.mean_return, first.mean_length) == (3, (3 + 4 + 3) / 3, (3 + 4 + 6) / 3)
    assert (second.episodes, second.mean_return, second.mean_length) == (3, (3 + 4 + 4.5) / 3, (3 + 4 + 9) / 3)
    assert (first.num_steps, second.total_steps, tuple(world.begun)) == (16, 32, (5, 3))


def test_a_student_whose_critic_sees_the_camera_only_learns_from_its_teacher() -> None:
    spec = NetworkSpec(num_actions=3, is_discrete=True, state_size=0)
    config = replace(CONFIG, student_steps=64)
    trained = Distill(config, make_learner(spec, seed=0, num_threads=1), StripeWorld(8), open_teacher, seed=0)
    for _ in range(4):
        trained.iterate()
    assert trained.refining is None
    assert trained.total_steps == 3 * 64


def test_a_student_that_refines_resumes_to_the_bit() -> None:
    config = replace(CONFIG, student_steps=64, refining_rate=2e-3, refining_rate_steps=700)
    first, second = make(config), make(config, seed=3)
    for _ in range(3):
        first.iterate()
    assert first.refining is not None
    assert (first.refining.config.learning_rate, first.refining.config.rate_steps) == (2e-3, 700)
    second.load_state(first.state())
    assert second.refining is not None
    assert (second.total_steps, second.iteration) == (first.total_steps, first.iteration)
    for name, array in second.state().items():
        np.testing.assert_array_equal(array, first.state()[name], err_msg=name)
    assert second.iterate().total_steps > first.total_steps


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"teacher_steps": 0}, "teacher_steps is 0"),
        ({"learning_rate": -1.0}, "learning_rate is -1.0"),
        ({"buffer_size": 100}, "at least num_envs x num_steps = 512"),
        ({"minibatch_size": 1.5}, "minibatch_size is 1.5"),
        ({"teacher_rate_steps": -1}, "teacher_rate_steps is -1; allowed is a whole number from 0"),
        ({"rate_steps": -1}, "rate_steps is -1; allowed is a whole number from 0"),
        ({"refining_rate": 2.0}, "refining_rate is 2.0"),
        ({"refining_rate_steps": -1}, "refining_rate_steps is -1; allowed is a whole number from 0"),
        ({"student_steps": 0.5}, "student_steps is 0.5; allowed is a whole number from 0"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        DistillConfig(**settings)
