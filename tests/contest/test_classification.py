"""Places: every rule and every tie, from small made-up results."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from made_up_trials import trial

from racecraft.contest.classification import classify
from racecraft.errors import ConfigError
from racecraft.race import Trial


def places(*trials: Trial, **settings: Any) -> list[int | None]:
    found = {standing.car: standing.place for standing in classify(trials, **settings)}
    return [found[car] for car in range(len(trials))]


def test_less_time_wins_by_each_ranking() -> None:
    steady, uneven = trial(10.0, 10.0, 10.0), trial(8.0, 13.0, 8.0)
    assert places(steady, uneven, minimum_laps=3) == [2, 1]
    assert places(steady, trial(8.0, 13.0, 10.0), minimum_laps=3) == [1, 2]
    assert places(steady, trial(9.0, 13.0, 10.0), ranking="best") == [2, 1]
    assert places(steady, uneven, ranking="average", minimum_laps=2) == [1, 2]


def test_time_counts_in_whole_milliseconds() -> None:
    assert places(trial(10.0004, 10.0, 10.0), trial(10.0, 10.0, 10.0), minimum_laps=3) == [1, 1]
    assert places(trial(10.0006, 10.0, 10.0), trial(10.0, 10.0, 10.0), minimum_laps=3) == [2, 1]


def test_equal_scores_are_decided_by_the_best_lap_then_by_resets_then_not_at_all() -> None:
    level, quick = trial(10.0, 10.0, 10.0), trial(9.0, 11.0, 10.0)
    assert places(level, quick, minimum_laps=3) == [2, 1]
    assert places(trial(10.0, 10.0, 10.0, resets=1), level, minimum_laps=3) == [2, 1]
    assert places(level, level, trial(11.0, 10.0, 10.0), minimum_laps=3) == [1, 1, 3]


def test_too_few_laps_are_not_ranked_and_come_last_by_distance() -> None:
    done, two, less = trial(30.0, 30.0, 30.0), trial(5.0, 5.0, driven=0.5), trial(5.0, 5.0, driven=0.2)
    assert places(two, done, less, minimum_laps=3) == [None, 1, None]
    assert [standing.car for standing in classify([less, two, done], minimum_laps=3)] == [2, 1, 0]
    assert places(two, done, less, minimum_laps=2) == [1, 3, 1]
    found = classify([two, done], minimum_laps=3)
    assert (found[1].score, found[1].gap, found[1].laps) == (None, None, 2)


def test_on_one_road_everybody_has_a_place() -> None:
    done, two, less = trial(30.0, 30.0, 30.0), trial(5.0, 5.0, driven=0.5), trial(5.0, 5.0, driven=0.2)
    assert places(less, two, done, minimum_laps=3, ranks_all=True) == [3, 2, 1]
    same = trial(5.0, 5.0, driven=0.2001)
    assert places(less, same, done, minimum_laps=3, ranks_all=True) == [2, 2, 1]
    assert places(trial(5.0, 5.0, driven=0.2, resets=2), same, done, minimum_laps=3, ranks_all=True) == [3, 2, 1]


def test_the_order_of_entries_means_nothing() -> None:
    field = [
        trial(10.0, 10.0, 10.0),
        trial(9.0, 11.0, 10.0),
        trial(10.0, 10.0, 10.0, resets=2),
        trial(4.0, driven=0.9),
        trial(driven=0.1),
    ]
    expected = dict(enumerate(places(*field, minimum_laps=3, ranks_all=True)))
    for order in itertools.permutations(range(len(field))):
        found = places(*(field[car] for car in order), minimum_laps=3, ranks_all=True)
        assert dict(zip(order, found, strict=True)) == expected


def test_gaps_are_to_the_winner() -> None:
    found = classify([trial(10.0, 10.0, 12.0), trial(10.0, 10.0, 10.0)], minimum_laps=3)
    assert [standing.gap for standing in found] == [0.0, 2.0]
    assert found[0].average == 10.0
    assert classify([]) == []
    with pytest.raises(ConfigError, match="ranking"):
        classify([trial(1.0)], ranking="luck")
