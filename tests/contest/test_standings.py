import math

import pytest

from racecraft.contest.standings import median_score, places, ranking_key, ranking_score
from racecraft.errors import ConfigError

LAPS = [10.0, 9.0, 8.0, 12.0]


@pytest.mark.parametrize(
    ("ranking", "minimum_laps", "score"),
    [
        ("total", 1, 39.0),
        ("total", 4, 39.0),
        ("best", 1, 8.0),
        ("best", 3, 8.0),
        ("average", 1, 8.0),
        ("average", 2, 8.5),
        ("average", 3, 9.0),
        ("average", 4, 9.75),
    ],
)
def test_scores_by_hand(ranking, minimum_laps, score):
    assert ranking_score(LAPS, ranking=ranking, minimum_laps=minimum_laps) == pytest.approx(score)


@pytest.mark.parametrize("ranking", ["total", "best", "average"])
def test_too_few_laps_are_not_ranked(ranking):
    assert ranking_score(LAPS, ranking=ranking, minimum_laps=5) == math.inf
    assert ranking_score([], ranking=ranking) == math.inf


def test_an_unknown_ranking_gets_a_suggestion():
    with pytest.raises(ConfigError, match="'averge'") as error:
        ranking_score(LAPS, ranking="averge")
    assert "average" in error.value.hint
    with pytest.raises(ConfigError, match="minimum_laps"):
        ranking_score(LAPS, minimum_laps=0)


def test_places():
    assert places([]) == []
    assert places([(9.5,)]) == [1]
    assert places([(12.0,), (9.0,), (10.0,)]) == [3, 1, 2]
    assert places([(9.0, 1.0), (10.0, 0.0), (9.0, 1.0), (9.0, 2.0)]) == [1, 4, 1, 3]
    assert places([(math.inf,), (8.0,), (math.inf,)]) == [2, 1, 2]


def test_keys_by_hand():
    finished = {"lap_times": [10.0, 9.0], "completion": 1.0, "resets": 2}
    assert ranking_key(19.0, **finished) == (0.0, 19_000.0, 9_000.0, 2.0)
    assert ranking_key(19.0004, **finished) == ranking_key(19.0, **finished) < ranking_key(19.0006, **finished)
    out = {"lap_times": [], "completion": 0.4567, "resets": 3}
    assert ranking_key(math.inf, **out) == (1.0, -457.0, 3.0, 0.0) > ranking_key(1e9, **finished)


def test_the_median_of_scores_by_hand():
    assert median_score([7.0]) == 7.0
    assert median_score([9.0, 1.0, 5.0]) == 5.0
    assert median_score([4.0, 1.0, 2.0, 9.0]) == 3.0
    assert median_score([math.inf, 5.0, math.inf, 1.0, 3.0]) == 5.0
    assert median_score([math.inf, 5.0]) == math.inf
