from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scheduled_world import ScheduledWorld

from racecraft._native import generalized_advantages
from racecraft.learn import PPO, NetworkSpec, PPOConfig, make_learner


def column(*values, dtype=np.float32):
    return np.array(values, dtype)[:, None]


def advantages_of(*, terminated=(0, 0, 0, 0), truncated=(0, 0, 0, 0), next_values=(0, 0, 0, 0), gae_lambda=0.5):
    return generalized_advantages(
        rewards=column(1, 2, 3, 4),
        values=column(10, 20, 30, 40),
        next_values=column(*next_values),
        terminated=column(*terminated, dtype=bool),
        truncated=column(*truncated, dtype=bool),
        gamma=0.5,
        gae_lambda=gae_lambda,
    )


def test_truncation_in_the_middle_by_hand():
    advantages, returns = advantages_of(truncated=(0, 1, 0, 0), next_values=(99, 100, 99, 50))
    # step 3: 4 + 0.5·50 − 40 = −11                      the rollout ends, the car drives on
    # step 2: 3 + 0.5·40 − 30 = −7,  −7 + 0.25·(−11) = −9.75
    # step 1: 2 + 0.5·100 − 20 = 32                      cut: its own final value, nothing from step 2
    # step 0: 1 + 0.5·20 − 10 = 1,    1 + 0.25·32 = 9
    np.testing.assert_allclose(advantages[:, 0], [9, 32, -9.75, -11])
    np.testing.assert_allclose(returns[:, 0], [19, 52, 20.25, 29])


def test_termination_in_the_middle_by_hand():
    advantages, _ = advantages_of(terminated=(0, 1, 0, 0), next_values=(99, 100, 99, 50))
    # step 1: 2 − 20 = −18: nothing follows, whatever value was handed in;  step 0: 1 + 0.25·(−18)
    np.testing.assert_allclose(advantages[:, 0], [-3.5, -18, -9.75, -11])


def test_lambda_one_without_ends_is_the_discounted_return():
    _, returns = advantages_of(next_values=(0, 0, 0, 16), gae_lambda=1.0)
    np.testing.assert_allclose(returns[0, 0], 1 + 2 / 2 + 3 / 4 + 4 / 8 + 16 / 16)


@given(st.integers(0, 2**32 - 1), st.floats(0, 1), st.floats(0, 1))
def test_cars_do_not_touch_each_other(seed, gamma, gae_lambda):
    rng = np.random.default_rng(seed)
    arrays = {name: rng.normal(size=(9, 3)).astype(np.float32) for name in ("rewards", "values", "next_values")}
    ends = {name: rng.random((9, 3)) < 0.2 for name in ("terminated", "truncated")}
    together = generalized_advantages(**arrays, **ends, gamma=gamma, gae_lambda=gae_lambda)[0]
    alone = generalized_advantages(
        **{name: array[:, 1:2] for name, array in (arrays | ends).items()}, gamma=gamma, gae_lambda=gae_lambda
    )[0]
    np.testing.assert_array_equal(together[:, 1:2], alone)


def test_a_car_that_is_terminated_and_truncated_is_terminated():
    class Both(ScheduledWorld):
        def step(self, actions):
            rewards, terminated, truncated = super().step(actions)
            return rewards, terminated, terminated | truncated

    config = PPOConfig(num_envs=2, num_steps=4, minibatch_size=8)
    learner = make_learner(NetworkSpec(num_actions=3, state_size=2), num_threads=1)
    ppo = PPO(config, learner, Both([[4], [4]], [1.0, 1.0], cars_cut=[1]))
    ppo.iterate()
    assert ppo.column("terminated")[3].tolist() == [True, False]
    assert ppo.column("truncated")[3].tolist() == [False, True]
    assert (ppo.column("next_values")[3] != 0).tolist() == [False, True]


@pytest.mark.parametrize(("is_discrete", "dtype", "shape"), [(True, np.int64, (4, 3)), (False, np.float32, (4, 3, 2))])
def test_actions_are_indices_or_vectors(is_discrete, dtype, shape):
    learner = make_learner(NetworkSpec(num_actions=2, is_discrete=is_discrete), num_threads=1)
    ppo = PPO(PPOConfig(num_envs=3, num_steps=4, minibatch_size=8), learner, ScheduledWorld([[9]] * 3, [1.0] * 3))
    ppo.iterate()
    assert ppo.column("actions").dtype == dtype
    assert ppo.column("actions").shape == shape
    assert ppo.column("observations").dtype == np.uint8
    with pytest.raises(ValueError, match="'speed'"):
        ppo.column("speed")
