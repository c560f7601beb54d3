"""Sources that do not load, and what is out of reach of those that do."""

from __future__ import annotations

import pytest
from workers import function, running

from racecraft.errors import ConfigError, RewardError
from racecraft.reward.worker import RewardWorker


@pytest.mark.parametrize(
    ("source", "line", "text"),
    [
        ("def reward_function(params:\n    return 1", 1, "SyntaxError"),
        ("x = 1\n y = 2", 2, "IndentationError"),
        ("x = 1", None, "no function 'reward_function"),
        ("reward_function = 3", None, "no function 'reward_function"),
        ("import nothing_like_this\n" + function("return 1.0"), 1, "ModuleNotFoundError"),
        ("x = 1\nraise ValueError('no')\n" + function("return 1.0"), 2, "ValueError: no"),
        ("import os\nos._exit(5)", None, "exit status 5"),
        ("import sys\nsys.exit()", 2, "sys.exit"),
        ("", None, "no function"),
        ("x = '\0'", None, "null bytes"),
    ],
)
def test_a_source_that_does_not_load(track, source, line, text):
    with pytest.raises(RewardError, match=r"before the first call") as caught:
        RewardWorker(source, track)
    assert text in str(caught.value)
    assert caught.value.line == line
    assert caught.value.row_index is None
    assert caught.value.params is None


def test_a_missing_package_says_how_to_get_it(track, monkeypatch):
    monkeypatch.setattr("racecraft.reward.launch.package_paths", list)
    with pytest.raises(RewardError, match=r"needs shapely, which is not installed here: pip install shapely") as caught:
        RewardWorker("import math\nimport shapely\n" + function("return 1.0"), track)
    assert caught.value.line == 2


@pytest.mark.costly
def test_a_source_that_hangs_while_it_loads(track):
    with pytest.raises(RewardError, match=r"within 0\.3 s") as caught:
        RewardWorker("x = 1\nwhile True: pass", track, start_timeout_s=0.3)
    assert caught.value.line == 2


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"source": None}, "source is None; use the text of a reward function"),
        ({"source": b"x = 1"}, "source is b'x = 1'; use the text of a reward function"),
        ({"tracks": None}, "tracks is None; allowed is a Track, or several in a list"),
        ({"tracks": []}, r"tracks is \[\]; allowed is a Track"),
        ({"tracks": "oval"}, "tracks is 'oval'; allowed is a Track"),
        ({"timeout_s": None}, "timeout_s is None; allowed is a number above 0"),
        ({"start_timeout_s": float("inf")}, "start_timeout_s is inf; allowed is a number above 0, to 1000000"),
        ({"seed": None}, "seed is None; allowed is a whole number"),
        ({"num_cars": 10**30}, "num_cars is 10+; allowed is a whole number from 1 to 1048576"),
        ({"num_objects": 1.5}, "num_objects is 1.5; allowed is a whole number"),
        ({"memory_limit_mb": "2048"}, "memory_limit_mb is '2048'; allowed is a whole number from 64"),
    ],
)
def test_what_no_worker_can_be_made_of_is_told_before_there_is_one(track, given, says):
    with pytest.raises(ConfigError, match=says):
        RewardWorker(**{"source": "x = 1", "tracks": track, **given})


def test_a_worker_that_nobody_waits_for_comes_up_by_itself(track, rows):
    with RewardWorker(function("return 2.0"), track, waits=False) as worker:
        assert worker(rows[:2]).tolist() == [2.0, 2.0]
        worker.wait()  # again, for nothing
        assert worker(rows[:1]).tolist() == [2.0]


@pytest.mark.parametrize("waited", ["wait", "call"])
def test_a_worker_that_nobody_waits_for_tells_what_is_wrong_later(track, rows, waited):
    with RewardWorker("x = 1\nraise ValueError('no')\n", track, waits=False) as worker:
        with pytest.raises(RewardError, match=r"ValueError: no(.|\n)*before the first call") as caught:
            worker.wait() if waited == "wait" else worker(rows)
        assert caught.value.line == 2
        with pytest.raises(RewardError, match=r"cannot be called again(.|\n)*ValueError: no"):
            worker(rows)


def test_racecraft_and_the_environment_are_out_of_reach(track, rows, monkeypatch):
    monkeypatch.setenv("RACECRAFT_TEST_SECRET", "1")
    source = function(
        "import os, sys", "return float('RACECRAFT_TEST_SECRET' in os.environ) + ('racecraft' in sys.modules)"
    )
    with running(source, track) as worker:
        assert worker(rows[:1]).tolist() == [0.0]
