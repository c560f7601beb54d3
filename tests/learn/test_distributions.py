from __future__ import annotations

import numpy as np
import pytest

from racecraft.learn import distributions


def outputs_of(size: int, *, rows: int = 7, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 2, (rows, size)).astype(np.float32)


def test_log_softmax_survives_huge_logits():
    logits = np.array([[1e30, 0.0], [-1e30, 0.0]], np.float32)
    np.testing.assert_allclose(distributions.log_softmax(logits).max(axis=1), 0.0)


def test_categorical_samples_have_the_policys_frequencies():
    outputs = np.tile(outputs_of(5, rows=1), (40_000, 1))
    rng = np.random.default_rng(3)
    noise = distributions.noise_for(len(outputs), num_actions=5, is_discrete=True, rng=rng)
    actions = distributions.sample(outputs, noise, is_discrete=True)
    frequencies = np.bincount(actions, minlength=5) / len(actions)
    np.testing.assert_allclose(frequencies, np.exp(distributions.log_softmax(outputs[:1]))[0], atol=0.01)


@pytest.mark.parametrize("noise", [0.0, np.nextafter(1.0, 0.0)])
def test_categorical_samples_stay_in_range_at_the_ends_of_the_noise(noise):
    outputs = outputs_of(4)
    actions = distributions.sample(outputs, np.full(len(outputs), noise), is_discrete=True)
    assert set(actions) <= {0, 3}


def test_gaussian_log_prob_integrates_to_one():
    grid = np.linspace(-60, 60, 24_001, dtype=np.float32)[:, None]
    outputs = np.tile(np.array([[0.3, 1.1]], np.float32), (len(grid), 1))
    density = np.exp(distributions.log_prob(outputs, grid, is_discrete=False).astype(float))
    assert density.sum() * 0.005 == pytest.approx(1.0, abs=1e-5)


def test_gaussian_samples_have_the_policys_moments():
    outputs = np.tile(np.array([[0.2, -0.4, -1.0, 0.5]], np.float32), (40_000, 1))
    noise = distributions.noise_for(len(outputs), num_actions=2, is_discrete=False, rng=np.random.default_rng(0))
    actions = distributions.sample(outputs, noise, is_discrete=False)
    np.testing.assert_allclose(actions.mean(0), [0.2, -0.4], atol=0.03)
    np.testing.assert_allclose(actions.std(0), np.exp([-1.0, 0.5]), rtol=0.03)


def test_most_likely_is_the_argmax_or_the_clipped_mean():
    assert distributions.most_likely(np.array([[0, 3, 1]], np.float32), is_discrete=True) == [1]
    mean = distributions.most_likely(np.array([[-7, 0.5, 0, 0]], np.float32), is_discrete=False)
    np.testing.assert_array_equal(mean, [[-1, 0.5]])
