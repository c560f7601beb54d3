"""Ladders of models whose order is known: what they drive is made up, so that every match is known beforehand.

Models are stand-ins with a pace; `evaluate` and `race_together`, which drive them, answer by it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from made_up_trials import trial

from racecraft.contest import ladder as ladders
from racecraft.contest.ladder import Ladder, Match, check_ladder, hold_ladder
from racecraft.contest.ratings import Rating, rate
from racecraft.contest.schedule import swiss_round
from racecraft.contest.terms import check_kind
from racecraft.errors import ConfigError
from racecraft.race import RaceRules, Trial
from racecraft.race.conditions import Conditions
from racecraft.track import load_track

OVAL, RING, STRAIGHT = (
    Conditions(track=load_track(name), rules=RaceRules(laps=1, **rules), seed=seed)
    for name, seed, rules in (
        ("oval", 11, {}),
        ("reinvent_2018", 12, {"start_offset": 0.75}),
        ("straight", 13, {"start_offset": 0.5}),
    )
)


@dataclass(frozen=True)
class Model:
    """Needs `pace` seconds for a lap, and never comes round where it is None."""

    name: str
    pace: float | None

    @property
    def policy(self) -> Model:
        return self


def models(*paces: float | None) -> list[Any]:
    return [Model(f"model {number}", pace) for number, pace in enumerate(paces)]


class Driven:
    """What was asked to be driven, and what came of it."""

    def __init__(self) -> None:
        self.evaluations: list[tuple[Model, str, int, int]] = []
        self.duels: list[tuple[tuple[Model, ...], Conditions]] = []

    def evaluate(self, policy: Model, track: Any, *, num_trials: int, seed: int, **settings: Any) -> SimpleNamespace:
        self.evaluations.append((policy, track.name, num_trials, seed))
        # a second more for every start after the first, so that a trial tells which one it is of
        return SimpleNamespace(trials=tuple(_lap(policy, start) for start in range(num_trials)))

    def race_together(
        self, drivers: Sequence[Model], conditions: Conditions, *, num_threads: int = 0
    ) -> tuple[Trial, ...]:
        self.duels.append((tuple(drivers), conditions))
        return tuple(_lap(driver, 0) for driver in drivers)


def _lap(model: Model, start: int) -> Trial:
    return trial(laps=1, driven=0.25) if model.pace is None else trial(model.pace + start, laps=1)


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> Driven:
    found = Driven()
    monkeypatch.setattr(ladders, "evaluate", found.evaluate)
    monkeypatch.setattr(ladders, "race_together", found.race_together)
    return found


def outcome(found: Ladder) -> dict[str, tuple[int, int, int]]:
    return {row.name: (row.wins, row.draws, row.losses) for row in found.rows}


def rated_again(matches: Sequence[Match], num_models: int) -> list[Rating]:
    """Match after match, by `rate` alone."""
    ratings = [Rating()] * num_models
    for match in matches:
        for car, rating in zip(match.cars, rate([ratings[car] for car in match.cars], match.places), strict=True):
            ratings[car] = rating
    return ratings


def test_the_faster_model_wins_every_match_and_stands_above(driven: Driven) -> None:
    field = models(12.0, 10.0, None, 11.0)
    found = hold_ladder(field, [OVAL, RING], starts=3, seed=5)
    expected = {"model 1": (18, 0, 0), "model 3": (12, 0, 6), "model 0": (6, 0, 12), "model 2": (0, 0, 18)}
    assert outcome(found) == expected
    assert [row.name for row in found.rows] == ["model 1", "model 3", "model 0", "model 2"]
    assert [row.place for row in found.rows] == [1, 2, 3, 4]
    means = [row.rating.mean for row in found.rows]
    assert means == sorted(means, reverse=True)
    assert list(found.ratings) == rated_again(found.matches, 4)
    assert found.rows[0].rating == found.ratings[1]


def test_everyone_meets_everyone_at_every_start_and_each_drives_each_start_once(driven: Driven) -> None:
    field = models(12.0, 10.0, None)
    found = hold_ladder(field, [OVAL, RING], starts=2, seed=5)
    meetings = sorted((match.track, match.start, *sorted(match.cars)) for match in found.matches)
    pairs = [(0, 1), (0, 2), (1, 2)]
    assert meetings == sorted(
        (track, start, *pair) for track, start, pair in itertools.product(("oval", "reinvent_2018"), (0, 1), pairs)
    )
    for match in found.matches:
        paces = [field[car].pace for car in match.cars]
        assert match.seconds == tuple(None if pace is None else pace + match.start for pace in paces)
    assert sorted(driven.evaluations, key=lambda asked: (asked[1], asked[0].name)) == [
        (model, track, 2, seed) for (track, seed) in (("oval", 11), ("reinvent_2018", 12)) for model in field
    ]


def test_the_seed_shuffles_the_courses_and_who_meets_first_on_each(driven: Driven) -> None:
    orders = [hold_ladder(models(12.0, 10.0, 11.0), [OVAL, RING], starts=3, seed=seed).matches for seed in range(3)]
    for settle in (lambda match: (match.track, match.start), lambda match: match.cars):
        assert len({tuple(map(settle, matches)) for matches in orders}) == 3
    again = hold_ladder(models(12.0, 10.0, 11.0), [OVAL, RING], starts=3, seed=2)
    assert again.matches == orders[2]


def test_equal_models_draw_and_share_a_place(driven: Driven) -> None:
    found = hold_ladder(models(10.0, 12.0, 10.0), [OVAL], starts=1)
    assert outcome(found) == {"model 0": (1, 1, 0), "model 2": (1, 1, 0), "model 1": (0, 0, 2)}
    drawn = hold_ladder(models(10.0, 10.0), [OVAL], starts=3)
    assert {match.places for match in drawn.matches} == {(1, 1)}
    assert [row.place for row in drawn.rows] == [1, 1]
    assert drawn.ratings[0] == drawn.ratings[1]


# ---- Swiss


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[float], list[int]]]:
    """Points and who rested, as every round of a Swiss ladder was paired by."""
    found: list[tuple[list[float], list[int]]] = []

    def note(points: list[float], met: Any, rested: list[int]) -> Any:
        found.append((list(points), list(rested)))
        return swiss_round(points, met, rested)

    monkeypatch.setattr(ladders, "swiss_round", note)
    return found


def test_a_win_a_rest_and_two_draws_are_a_point(driven: Driven, tables: list[Any]) -> None:
    found = hold_ladder(models(10.0, 11.0, 11.0), [OVAL], schedule="swiss", starts=1, rounds=4)
    assert [set(match.cars) for match in found.matches] == [{0, 1}, {0, 2}, {1, 2}, {0, 1}]
    assert tables == [
        ([0.0, 0.0, 0.0], []),
        ([1.0, 0.0, 1.0], [2]),  # model 0 beat model 1, model 2 had nobody to race
        ([2.0, 1.0, 1.0], [2, 1]),
        ([3.0, 1.5, 1.5], [2, 1, 0]),
    ]
    assert list(found.ratings) == rated_again(found.matches, 3)


def test_the_strong_meet_the_strong(driven: Driven) -> None:
    found = hold_ladder(models(13.0, 10.0, 12.0, 11.0), [OVAL], schedule="swiss", starts=1, rounds=2)
    assert [set(match.cars) for match in found.matches] == [{0, 1}, {2, 3}, {1, 3}, {0, 2}]
    assert found.rows[0].name == "model 1"
    assert outcome(found)["model 1"] == (2, 0, 0)
    assert outcome(found)["model 0"] == (0, 0, 2)


@pytest.mark.parametrize(("num_models", "starts", "rounds"), [(2, 1, 2), (4, 1, 3), (5, 1, 4), (5, 4, 8), (3, 1, 3)])
def test_rounds_are_as_many_as_find_the_best_and_drive_every_start(
    driven: Driven, tables: list[Any], num_models: int, starts: int, rounds: int
) -> None:
    found = hold_ladder(models(*range(10, 10 + num_models)), [OVAL, RING], schedule="swiss", starts=starts)
    assert len(tables) == rounds
    assert len({(match.track, match.start) for match in found.matches}) == 2 * starts


# ---- duels


def test_duels_begin_further_round_the_lap_each_time_and_swap_who_is_in_front(driven: Driven) -> None:
    field = models(12.0, 10.0)
    found = hold_ladder(field, [OVAL], kind="head-to-model", starts=4)
    ((first, second),) = {match.cars for match in found.matches}
    for match, (drivers, conditions) in zip(found.matches, driven.duels, strict=True):
        assert conditions.rules.start_offset == match.start / 4
        swapped = (field[second], field[first])
        assert drivers == (swapped if match.start % 2 else swapped[::-1])
        assert conditions.cars_per_race == 2
        assert conditions.camera is not None
        # whoever was in front, each has its own result
        assert match.seconds == (field[first].pace, field[second].pace)
        assert match.places == ((2, 1) if first == 0 else (1, 2))
    assert sorted(match.start for match in found.matches) == [0, 1, 2, 3]
    assert outcome(found) == {"model 1": (4, 0, 0), "model 0": (0, 0, 4)}


def test_duels_begin_from_where_the_rules_start_and_on_an_open_road_at_its_beginning(driven: Driven) -> None:
    found = hold_ladder(models(12.0, 10.0), [RING, STRAIGHT], kind="head-to-model", starts=2)
    begun = {
        (match.track, match.start): conditions.rules.start_offset
        for match, (_, conditions) in zip(found.matches, driven.duels, strict=True)
    }
    assert begun == {
        ("reinvent_2018", 0): 0.75,
        ("reinvent_2018", 1): 0.25,
        ("straight", 0): 0.0,
        ("straight", 1): 0.0,
    }


def test_on_one_road_those_who_do_not_finish_have_a_place_too(driven: Driven) -> None:
    found = hold_ladder(models(None, 10.0, None), [OVAL], kind="head-to-model", starts=1)
    assert outcome(found) == {"model 1": (2, 0, 0), "model 0": (0, 1, 1), "model 2": (0, 1, 1)}
    assert found.rows[0].place == 1


def test_a_ladder_as_json_names_its_models(driven: Driven) -> None:
    found = hold_ladder(models(12.0, 10.0), [OVAL], starts=1, seed=3)
    document = found.to_dict()
    assert (document["type"], document["schedule"], document["seed"]) == ("time-trial", "round-robin", 3)
    (match,) = document["matches"]
    assert dict(zip(match["models"], match["places"], strict=True)) == {"model 0": 2, "model 1": 1}
    assert dict(zip(match["models"], match["seconds"], strict=True)) == {"model 0": 12.0, "model 1": 10.0}
    best, worst = document["ladder"]
    assert (best["name"], best["place"], best["wins"], best["losses"]) == ("model 1", 1, 1, 0)
    assert best["floor"] == best["rating"] - 3 * best["deviation"] < best["rating"]
    assert worst["rating"] < 25.0 < best["rating"]


def test_one_model_is_too_few_in_a_sentence_that_reads_well() -> None:
    with pytest.raises(ConfigError, match=r"^A ladder is of 2 to \d+ models; this one has 1\.$"):
        check_ladder(1, kind="head-to-model", schedule="round-robin", starts=1, rounds=0)
    with pytest.raises(ConfigError, match=r"^A grid race is of 2 to \d models; this one has 1\.$"):
        check_kind("grid", 1)
    with pytest.raises(ConfigError, match=r"^A head-to-model race is of 2 models; this one has 1\.$"):
        check_kind("head-to-model", 1)
