from __future__ import annotations

import numpy as np
import pytest

from racecraft import _native
from racecraft.learn import distributions


def outputs_of(size: int, *, rows: int = 7, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 2, (rows, size)).astype(np.float32)


def log_softmax(logits: np.ndarray) -> np.ndarray:
    shifted = logits.astype(np.float64) - logits.max(axis=1, keepdims=True)
    return shifted - np.log(np.exp(shifted).sum(axis=1, keepdims=True))


def test_log_probs_survive_huge_logits():
    logits = np.array([[1e30, 0.0], [-1e30, 0.0]], np.float32)
    np.testing.assert_array_equal(distributions.log_prob(logits, np.array([0, 1]), is_discrete=True), 0.0)


def test_categorical_sampling_is_what_numpy_makes_of_it():
    logits = outputs_of(9, rows=4000)
    noise = np.random.default_rng(1).random(len(logits))
    actions = distributions.sample(logits, noise, is_discrete=True)
    cumulative = np.exp(log_softmax(logits)).cumsum(axis=1)[:, :-1]
    np.testing.assert_array_equal(actions, (noise[:, None] >= cumulative).sum(axis=1))
    expected = np.take_along_axis(log_softmax(logits), actions[:, None], axis=1)[:, 0]
    np.testing.assert_allclose(distributions.log_prob(logits, actions, is_discrete=True), expected, rtol=1e-6)


def test_gaussian_sampling_is_what_numpy_makes_of_it():
    outputs = outputs_of(6, rows=500)
    outputs[0, 3:] = -50.0, 0.0, 50.0  # spreads beyond their bounds
    noise = np.random.default_rng(1).standard_normal((len(outputs), 3))
    actions = distributions.sample(outputs, noise, is_discrete=False)
    log_std = outputs[:, 3:].clip(distributions.LOG_STD_MIN, distributions.LOG_STD_MAX).astype(np.float64)
    np.testing.assert_allclose(actions, outputs[:, :3] + np.exp(log_std) * noise, rtol=1e-5, atol=1e-6)
    z = (actions - outputs[:, :3].astype(np.float64)) / np.exp(log_std)
    expected = (-0.5 * z**2 - log_std - 0.5 * np.log(2 * np.pi)).sum(axis=1)
    np.testing.assert_allclose(distributions.log_prob(outputs, actions, is_discrete=False), expected, rtol=1e-5)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_normal_numbers_come_in_any_count(count):
    noise = distributions.noise_for(count, num_actions=1, is_discrete=False, rng=np.random.default_rng(5))
    assert noise.shape == (count, 1)
    assert np.isfinite(noise).all()


def test_normal_numbers_are_normal():
    rng = np.random.default_rng(0)
    noise = distributions.noise_for(50_000, num_actions=2, is_discrete=False, rng=rng)
    assert abs(noise.mean(axis=0)).max() < 0.02
    np.testing.assert_allclose(np.cov(noise.T), np.eye(2), atol=0.02)
    shares = [(abs(noise) > bound).mean() for bound in (1.0, 2.0, 3.0)]
    np.testing.assert_allclose(shares, [0.31731, 0.04550, 0.00270], atol=0.004)


@pytest.mark.parametrize("ends", [0.0, 1.0 - 2.0**-53])
def test_normal_numbers_are_finite_at_the_ends_of_the_uniform_ones(ends):
    class Ends:
        def random(self, size):
            return np.full(size, ends)

    noise = distributions.noise_for(4, num_actions=1, is_discrete=False, rng=Ends())
    assert np.isfinite(noise).all()
    assert abs(noise).max() == pytest.approx(np.sqrt(-2.0 * np.log1p(-ends)))


def test_moments_are_numpys():
    values = np.random.default_rng(0).normal(3, 2, (7, 11)).astype(np.float32)
    mean, spread = _native.moments(values.ravel())
    assert mean == pytest.approx(values.astype(float).mean(), rel=1e-12)
    assert spread == pytest.approx(values.astype(float).std(), rel=1e-12)
    assert np.isnan(_native.moments(np.array([1, np.nan], np.float32))).all()


def test_categorical_samples_have_the_policys_frequencies():
    outputs = np.tile(outputs_of(5, rows=1), (40_000, 1))
    rng = np.random.default_rng(3)
    noise = distributions.noise_for(len(outputs), num_actions=5, is_discrete=True, rng=rng)
    actions = distributions.sample(outputs, noise, is_discrete=True)
    frequencies = np.bincount(actions, minlength=5) / len(actions)
    np.testing.assert_allclose(frequencies, np.exp(log_softmax(outputs[:1]))[0], atol=0.01)


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
