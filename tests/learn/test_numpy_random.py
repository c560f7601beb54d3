"""The core's generator beside NumPy's: every number the same, in any order of calls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecraft._native import NumpyRandom

CALLS = st.tuples(st.sampled_from(("random", "integers", "permutation")), st.integers(1, 40))
SEEDS = st.lists(st.one_of(st.integers(0, 3), st.integers(0, 2**64 - 1)), min_size=1, max_size=4)


@pytest.mark.parametrize("seeds", [(0, 0), (1, 0), (7, 1234), (2**32, 5), (2**63 - 1, 2**31), (2**64 - 1,) * 4])
def test_a_million_uniform_numbers(seeds):
    np.testing.assert_array_equal(NumpyRandom(seeds).random(10**6), np.random.default_rng(seeds).random(10**6))


@pytest.mark.parametrize("bound", [1, 2, 3, 5, 10, 21, 2**16, 3 * 2**30, 2**31 + 1, 2**32 - 1])
def test_whole_numbers_below_a_bound(bound):
    # of the larger ones up to a half is drawn again
    ours, theirs = NumpyRandom((3, bound)), np.random.default_rng((3, bound))
    np.testing.assert_array_equal(ours.integers(bound, 200_001), theirs.integers(bound, size=200_001))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 64, 511, 512, 10_000, 300_000])
def test_permutations(count):
    ours, theirs = NumpyRandom((11, count)), np.random.default_rng((11, count))
    for _ in range(2):
        np.testing.assert_array_equal(ours.permutation(count), theirs.permutation(np.arange(count)))


@settings(max_examples=200, deadline=None)
@given(SEEDS, st.lists(CALLS, max_size=9))
def test_any_seeds_and_any_order_of_calls(seeds, calls):
    ours, theirs = NumpyRandom(seeds), np.random.default_rng(seeds)
    for kind, number in calls:  # a half word that whole numbers leave over waits for the next of them
        if kind == "random":
            drawn, expected = ours.random(number), theirs.random(number)
        elif kind == "integers":
            drawn, expected = ours.integers(number, 5), theirs.integers(number, size=5)
        else:
            drawn, expected = ours.permutation(number), theirs.permutation(np.arange(number))
        np.testing.assert_array_equal(drawn, expected)


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(ValueError, match="four"):
        NumpyRandom((0,) * 5)
    with pytest.raises(ValueError, match="bound"):
        NumpyRandom((0,)).integers(0, 1)
