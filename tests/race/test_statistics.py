import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.errors import ConfigError
from racecraft.race.statistics import mean_interval, wilson_interval


# Known values: Newcombe 1998 (81 of 263, 15 of 148, 0 of 20, 1 of 29), and 5 of 5.
@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_interval_agrees_with_published_values(successes, trials, low, high):
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)


def test_five_of_five_is_not_certainty():
    assert wilson_interval(5, 5) == pytest.approx((0.5655, 1.0), abs=5e-5)
    assert wilson_interval(5, 5).high == 1.0


def test_without_trials_nothing_is_known():
    assert wilson_interval(0, 0) == (0.0, 1.0)


@given(st.integers(0, 200), st.integers(0, 200), st.floats(0.5, 0.999))
def test_wilson_interval_holds_the_rate_and_stays_within_bounds(a, b, confidence):
    successes, trials = min(a, b), max(a, b, 1)
    low, high = wilson_interval(successes, trials, confidence=confidence)
    assert 0.0 <= low <= successes / trials <= high <= 1.0
    mirrored = wilson_interval(trials - successes, trials, confidence=confidence)
    assert mirrored == pytest.approx((1.0 - high, 1.0 - low), abs=1e-12)


@pytest.mark.parametrize(("successes", "trials"), [(-1, 5), (6, 5), (1, 0)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(ConfigError, match="successes"):
        wilson_interval(successes, trials)


def test_mean_interval_by_hand():
    # 1..5: mean 3, standard deviation sqrt(2.5), t(0.975, 4) = 2.776445
    half = 2.776445 * np.sqrt(2.5 / 5)
    assert mean_interval([1, 2, 3, 4, 5]) == pytest.approx((3 - half, 3 + half), abs=1e-5)


def test_mean_interval_is_cut_to_what_is_possible():
    assert mean_interval([0.2, 1.0, 0.9], low=0.0, high=1.0) == (0.0, 1.0)
    assert mean_interval([1.0, 1.0, 1.0], low=0.0, high=1.0) == (1.0, 1.0)


@pytest.mark.parametrize("values", [[], [0.7]])
def test_one_value_says_nothing(values):
    assert mean_interval(values, low=0.0, high=1.0) == (0.0, 1.0)


@pytest.mark.parametrize("confidence", [0.0, 1.0, -1.0, float("nan")])
def test_confidence_must_be_a_probability(confidence):
    with pytest.raises(ConfigError, match="confidence"):
        wilson_interval(1, 2, confidence=confidence)
    with pytest.raises(ConfigError, match="confidence"):
        mean_interval([1.0, 2.0], confidence=confidence)


@pytest.mark.parametrize("probability", [0.6, 0.75, 0.95, 0.975, 0.9995])
@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 10, 11, 100, 101])
def test_mean_interval_is_students(count: int, probability: float) -> None:
    from scipy.special import stdtrit

    values = np.linspace(-1.0, 1.0, count)
    half = stdtrit(count - 1, probability) * values.std(ddof=1) / np.sqrt(count)
    assert mean_interval(list(values), confidence=2 * probability - 1) == pytest.approx((-half, half), rel=1e-9)
