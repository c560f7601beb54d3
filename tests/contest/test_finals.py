"""Finals in which two meet at a time: who meets whom, and what places come of it."""

from __future__ import annotations

import itertools
import random

import pytest
from made_up_trials import trial

from racecraft.contest.finals import FORMS, FinalTerms, duel_result, final_places, plan_final, seats_of
from racecraft.errors import ConfigError


def held(form: str, number: int, strength: list[float]) -> tuple[dict[int, int], list[tuple[int, ...]]]:
    """Places of a final that the strongest of each duel wins, and who met."""
    plan, winners = plan_final(form, number), dict[int, int]()
    met = []
    for duel in plan:
        seats = [seed for seed in seats_of(plan, winners)[duel.number] if seed is not None]
        assert len(seats) == 2, "whoever meets is known by then"
        met.append(tuple(seats))
        winners[duel.number] = max(seats, key=lambda seed: strength[seed - 1])
    return final_places(form, number, winners), met


@pytest.mark.parametrize("number", [*range(2, 13), 16, 23, 32])
def test_in_a_bracket_the_stronger_goes_on_and_everybody_has_a_place(number: int) -> None:
    places, met = held("bracket", number, [-seed for seed in range(number)])
    assert len(met) == number - 1 + (number >= 4), "who loses is out, but for the third place"
    assert [places[seed] for seed in range(1, min(4, number) + 1)] == [1, 2, 3, 4][: min(4, number)]
    assert met[-1] == (1, 2), "the two best meet at the end only"
    assert sorted(places) == list(range(1, number + 1))
    assert {seed: place for seed, place in places.items() if 5 <= seed <= 8} == dict.fromkeys(
        range(5, min(8, number) + 1), 5
    )
    strength = [random.Random(number).random() for _ in range(number)]
    places, _ = held("bracket", number, strength)
    assert places[1 + strength.index(max(strength))] == 1
    for place in set(places.values()):
        assert place == 1 + sum(other < place for other in places.values())


def test_a_bracket_of_six_is_the_one_that_is_drawn() -> None:
    plan = plan_final("bracket", 6)
    assert seats_of(plan, {}) == [(4, 5), (3, 6), (1, None), (2, None), (None, None), (None, None)]
    assert [(duel.round, duel.is_for_third) for duel in plan] == [
        *((0, False), (0, False)),
        *((1, False), (1, False)),
        *((2, True), (2, False)),
    ]
    assert seats_of(plan, {0: 5, 1: 3, 2: 5, 3: 2})[4:] == [(1, 3), (5, 2)]
    assert final_places("bracket", 6, {0: 5, 1: 3, 2: 5, 3: 2, 4: 3, 5: 2}) == {2: 1, 5: 2, 3: 3, 1: 4, 4: 5, 6: 5}


@pytest.mark.parametrize("number", range(2, 9))
def test_head_to_head_everyone_meets_everyone_once(number: int) -> None:
    strength = [random.Random(number).random() for _ in range(number)]
    places, met = held("head-to-head", number, strength)
    assert sorted(met) == list(itertools.combinations(range(1, number + 1), 2))
    order = sorted(range(1, number + 1), key=lambda seed: -strength[seed - 1])
    assert places == {seed: place for place, seed in enumerate(order, start=1)}


def test_of_equal_wins_those_among_themselves_count_and_then_the_seed() -> None:
    plan = plan_final("head-to-head", 4)
    numbers = {frozenset(seats): duel.number for duel, seats in zip(plan, seats_of(plan, {}), strict=True)}

    def places(beaten: dict[int, str]) -> dict[int, int]:
        pairs = [(winner, int(loser)) for winner, losers in beaten.items() for loser in losers]
        return final_places("head-to-head", 4, {numbers[frozenset(pair)]: pair[0] for pair in pairs})

    # two wins each of 4 and 1, and 4 has beaten 1; one each of 3 and 2, and 3 has beaten 2
    assert places({4: "13", 1: "23", 3: "2", 2: "4"}) == {4: 1, 1: 2, 3: 3, 2: 4}
    # three in a circle: the better seed
    assert places({1: "24", 2: "34", 3: "14", 4: ""}) == {1: 1, 2: 2, 3: 3, 4: 4}


def test_a_duel_is_won_over_both_heats_and_by_the_better_seed_if_all_is_equal() -> None:
    def won(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
        heats = [[trial(time, laps=1) for time in times] for times in (first, second)]
        return duel_result(*heats, ranking="total", minimum_laps=1)[1]

    assert won((10.0, 12.0), (11.0, 11.5))
    assert not won((10.0, 12.0), (11.0, 10.5))
    assert won((10.0, 12.0), (12.0, 10.0))
    one, other = duel_result(
        [trial(9.0, laps=1), trial(laps=1, driven=0.4)],
        [trial(30.0, laps=1), trial(31.0, laps=1)],
        ranking="total",
        minimum_laps=1,
    )[0]
    assert (one.place, one.score, other.place) == (2, None, 1), "who does not arrive twice loses to who does"


def test_what_is_no_final_is_refused() -> None:
    for form, number, words in (
        ("bracket", 1, "allowed are 2 to 32"),
        ("bracket", 33, "allowed are 2 to 32"),
        ("head-to-head", 9, "allowed are 2 to 8"),
        ("league", 4, "form of a final"),
    ):
        with pytest.raises(ConfigError, match=words):
            plan_final(form, number)
    terms = FinalTerms(form="bracket", best=8, qualifying="c" * 64)
    assert FinalTerms.of({"final": terms.to_dict()}) == terms
    assert FinalTerms.of({}) is None
    for told in (
        3,
        {},
        {**terms.to_dict(), "best": "8"},
        {**terms.to_dict(), "more": 1},
        {**terms.to_dict(), "best": 99},
    ):
        with pytest.raises(ConfigError):
            FinalTerms.of({"final": told})
    assert set(FORMS) == {"head-to-head", "bracket"}
