"""What a gradient step saw, number by number."""

from __future__ import annotations

import math

import pytest

from racecraft.learn import UpdateStats


def test_numbers_keep_their_order() -> None:
    stats = UpdateStats.of([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert stats == UpdateStats(
        policy_loss=1.0, value_loss=2.0, entropy=3.0, approx_kl=4.0, clip_fraction=5.0, grad_norm=6.0
    )
    with pytest.raises(ValueError, match="shorter"):
        UpdateStats.of([1.0])


def test_a_mean_is_of_every_number_and_what_is_not_known_stays_so() -> None:
    first, second = UpdateStats.of([1, 2, 3, math.nan, 0, 6]), UpdateStats.of([3, 2, 5, 4, 1, 0])
    mean = UpdateStats.mean([first, second])
    assert (mean.policy_loss, mean.value_loss, mean.entropy, mean.clip_fraction, mean.grad_norm) == (2, 2, 4, 0.5, 3)
    assert math.isnan(mean.approx_kl)
    assert mean.is_finite


def test_there_is_no_mean_of_no_steps() -> None:
    assert not UpdateStats.mean([]).is_finite
