"""The one account of episodes, against sums made by hand."""

from __future__ import annotations

import numpy as np

from racecraft.learn.ledger import Ended, EpisodeLedger


def mask(*cars: int) -> np.ndarray:
    return np.isin(np.arange(3), cars)


def test_an_episode_is_told_with_the_step_that_ends_it_and_the_next_begins_at_nothing() -> None:
    ledger = EpisodeLedger(3)
    assert ledger.add(np.array([1.0, 2.0, 4.0]), mask()) == []
    assert ledger.add(np.array([1.0, 2.0, 4.0]), mask(0, 2)) == [Ended(0, 2.0, 2), Ended(2, 8.0, 2)]
    assert (ledger.totals.tolist(), ledger.lengths.tolist()) == ([0.0, 4.0, 0.0], [0, 2, 0])
    assert ledger.add(np.array([0.5, -7.0, 0.5]), mask(0, 1, 2)) == [
        Ended(0, 0.5, 1),
        Ended(1, -3.0, 3),
        Ended(2, 0.5, 1),
    ]


def test_an_episode_that_does_not_count_is_forgotten_when_it_ends() -> None:
    ledger = EpisodeLedger(3)
    assert ledger.add(np.ones(3), mask(0, 1), is_counted=mask(1, 2)) == [Ended(1, 1.0, 1)]
    assert ledger.totals.tolist() == [0.0, 0.0, 1.0]


def test_what_is_forgotten_begins_anew_and_leaves_the_others() -> None:
    ledger = EpisodeLedger(3)
    ledger.add(np.full(3, 9.0), mask())
    ledger.forget(mask(1))
    assert ledger.add(np.ones(3), mask(0, 1, 2)) == [Ended(0, 10.0, 2), Ended(1, 1.0, 1), Ended(2, 10.0, 2)]


def test_plain_numbers_come_out_for_json() -> None:
    (ended,) = EpisodeLedger(3).add(np.ones(3, np.float32), mask(2))
    assert [type(number) for number in ended] == [int, float, int]
