"""Schedules: who meets whom."""

from __future__ import annotations

import itertools
import random

import pytest

from racecraft.contest.ratings import Rating, rate
from racecraft.contest.schedule import round_robin, swiss_round
from racecraft.errors import ConfigError


@pytest.mark.parametrize("number", range(10))
def test_in_a_round_robin_everyone_meets_everyone_once(number: int) -> None:
    rounds = round_robin(number)
    met = [frozenset(pair) for pairs in rounds for pair in pairs]
    assert sorted(map(sorted, met)) == sorted(map(list, itertools.combinations(range(number), 2)))
    for pairs in rounds:
        cars = [car for pair in pairs for car in pair]
        assert len(cars) == len(set(cars))
        assert len(cars) >= number - 1
    fronts = [sum(pair[0] == car for pairs in rounds for pair in pairs) for car in range(number)]
    assert all(abs(2 * front - (number - 1)) <= 1 for front in fronts)


@pytest.mark.parametrize("number", [2, 3, 6, 7, 16])
def test_swiss_rounds_repeat_no_pair_while_there_are_others(number: int) -> None:
    chance = random.Random(number)
    points, met, rested = [0.0] * number, [], []
    for _ in range(min(4, number - 1)):
        pairs = swiss_round(points, met, rested)
        cars = [car for pair in pairs for car in pair]
        assert len(cars) == len(set(cars)) == number - number % 2
        for pair in pairs:
            assert frozenset(pair) not in {frozenset(other) for other in met}
            points[chance.choice(pair)] += 1.0
        rested += list(set(range(number)) - set(cars))
        met += pairs
    assert len(rested) == len(set(rested))


def test_swiss_neighbours_in_the_table_meet() -> None:
    pairs = swiss_round([3.0, 1.0, 3.0, 1.0], met=[])
    assert {frozenset(pair) for pair in pairs} == {frozenset((0, 2)), frozenset((1, 3))}
    assert {frozenset(pair) for pair in swiss_round([1.0, 3.0, 2.0], met=[])} == {frozenset((1, 2))}  # the last rests
    assert {frozenset(pair) for pair in swiss_round([1.0, 3.0, 2.0], met=[], rested=[0])} == {frozenset((1, 0))}
    assert {frozenset(pair) for pair in swiss_round([1.0, 3.0, 2.0], met=[], rested=[0, 1, 2])} == {frozenset((1, 2))}
    again = swiss_round([2.0, 1.0], met=[(0, 1)])  # nobody else is there
    assert {frozenset(pair) for pair in again} == {frozenset((0, 1))}
    assert again == [(1, 0)]  # the other one starts in front


# ---- ratings


def test_winners_rise_losers_fall_and_everyone_becomes_surer() -> None:
    before = [Rating(), Rating()]
    winner, loser = rate(before, [1, 2])
    assert winner.mean > 25.0 > loser.mean
    assert winner.deviation == loser.deviation < Rating().deviation
    assert rate(before, [2, 1]) == [loser, winner]
    one, other = rate(before, [1, 1])
    assert one == other


def test_what_a_model_is_worth_almost_certainly_is_three_deviations_below_its_mean() -> None:
    assert Rating(30.0, 2.5).floor == 22.5
    assert Rating().floor == pytest.approx(0.0)


def test_a_surprise_moves_more_than_what_was_expected() -> None:
    strong, weak = Rating(35.0, 4.0), Rating(15.0, 4.0)
    expected, surprise = rate([strong, weak], [1, 2]), rate([strong, weak], [2, 1])
    assert abs(surprise[0].mean - strong.mean) > abs(expected[0].mean - strong.mean)


def test_strength_is_found_again() -> None:
    chance, strength, ratings = random.Random(3), [0.0, 1.0, 2.0, 3.0], [Rating()] * 4
    for _ in range(150):
        a, b = chance.sample(range(4), 2)
        first = strength[a] + chance.gauss(0.0, 1.0) > strength[b] + chance.gauss(0.0, 1.0)
        ratings[a], ratings[b] = rate([ratings[a], ratings[b]], [1, 2] if first else [2, 1])
    means = [rating.mean for rating in ratings]
    assert means == sorted(means)
    assert ratings[3].floor > ratings[0].mean


def test_ratings_need_a_place_for_each() -> None:
    with pytest.raises(ConfigError, match="place"):
        rate([Rating()], [1, 2])
    assert rate([Rating()], [1]) == [Rating()]
