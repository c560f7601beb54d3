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
    found = {standing.car: standing.place for standing in classify([[trial] for trial in trials], **settings)}
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
    assert [standing.car for standing in classify([[less], [two], [done]], minimum_laps=3)] == [2, 1, 0]
    assert places(two, done, less, minimum_laps=2) == [1, 3, 1]
    found = classify([[two], [done]], minimum_laps=3)
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
    found = classify([[trial(10.0, 10.0, 12.0)], [trial(10.0, 10.0, 10.0)]], minimum_laps=3)
    assert [standing.gap for standing in found] == [0.0, 2.0]
    assert found[0].average == 10.0
    assert classify([]) == []
    with pytest.raises(ConfigError, match="ranking"):
        classify([[trial(1.0)]], ranking="luck")


# ---- several trials


def trials(*times: float | None) -> list[Trial]:
    """Races of a lap; None did not come round."""
    return [trial(laps=1, driven=0.5) if time is None else trial(time, laps=1) for time in times]


def test_the_median_of_the_trials_counts_and_no_lucky_one() -> None:
    lucky, steady = trials(5.0, 20.0, 21.0, 22.0, 23.0), trials(15.0, 16.0, 17.0, 18.0, 90.0)
    found = classify([lucky, steady])
    assert [(one.car, one.score, one.gap) for one in found] == [(1, 17.0, 0.0), (0, 21.0, 4.0)]
    assert found[1].scores == (5.0, 20.0, 21.0, 22.0, 23.0)
    assert (found[1].best, found[1].laps, found[1].total) == (5.0, 5, 21.0)
    for order in itertools.permutations(lucky):  # in whatever order they were driven
        assert classify([order])[0].score == 21.0


def test_who_fails_in_more_than_half_of_the_trials_is_not_ranked() -> None:
    most, few, even = trials(9.0, None, 11.0, None, 10.0), trials(9.0, None, None, None, 10.0), trials(9.0, None)
    found = {one.car: one for one in classify([most, few, even])}
    assert (found[0].place, found[0].score) == (1, 11.0)  # the two that failed are its slowest
    assert (found[1].place, found[1].score, found[1].gap) == (None, None, None)
    assert found[1].scores == (9.0, None, None, None, 10.0)
    assert found[1].statuses == ("lap_complete", "off_track", "off_track", "off_track", "lap_complete")
    assert (found[2].place, found[2].score) == (None, None)
    assert [found[car].completion for car in (0, 1, 2)] == pytest.approx([0.8, 0.7, 0.75])
    assert [one.car for one in classify([most, few, even])] == [0, 2, 1]  # of the others, who drove further


def test_a_ranking_is_of_each_trial_and_then_the_median() -> None:
    driver = [trial(10.0, 12.0, 11.0), trial(9.0, 9.0, 30.0), trial(14.0, 14.0, 14.0)]
    assert classify([driver], ranking="total", minimum_laps=3)[0].score == 42.0  # of 33, 48, 42
    assert classify([driver], ranking="best")[0].score == 10.0  # of 10, 9, 14
    assert classify([driver], ranking="average", minimum_laps=2)[0].score == 11.0  # of 11, 9, 14
