from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.learn.rollout import Rollout, generalized_advantages


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
    rollout = Rollout(1, num_envs=2, observation_shape=(2, 2, 1), state_size=1, action_size=0)
    rollout.add(
        observations=np.zeros((2, 2, 2, 1), np.uint8),
        states=np.zeros((2, 1), np.float32),
        actions=np.zeros(2, np.int64),
        log_probs=np.zeros(2, np.float32),
    )
    rollout.finish(rewards=np.ones(2), terminated=np.array([True, False]), truncated=np.array([True, True]))
    assert rollout.truncated.tolist() == [[False, True]]
    rollout.next_values[:] = 8
    advantages, _ = rollout.advantages(gamma=0.5, gae_lambda=0.9)
    assert advantages.tolist() == [[1.0, 5.0]]


@pytest.mark.parametrize(("action_size", "dtype", "shape"), [(0, np.int64, (4, 3)), (2, np.float32, (4, 3, 2))])
def test_actions_are_indices_or_vectors(action_size, dtype, shape):
    rollout = Rollout(4, num_envs=3, observation_shape=(15, 20, 16), state_size=0, action_size=action_size)
    assert rollout.actions.dtype == dtype
    assert rollout.actions.shape == shape
    assert rollout.observations.dtype == np.uint8
