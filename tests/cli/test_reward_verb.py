"""`racecraft reward`: checks of a file, and the presets."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import GOOD_REWARD, Run

BAD = "def reward_function(params):\n    return params['progres']\n"


def test_a_good_reward_is_fit_for_training(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "reward_function.py").write_text(GOOD_REWARD)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 0
    assert "Fit for training." in outcome.out
    assert all(len(line) <= 80 for line in outcome.out.splitlines())
    document = racecraft("reward", "check", "reward_function.py", "--json").document
    assert document["ok"]
    assert document["problems"] == []
    assert {"start", "finish"} <= {situation["name"] for situation in document["situations"]}


def test_a_reward_check_shows_what_was_printed(racecraft: Run, tmp_path: Path) -> None:
    source = (
        "def reward_function(params):\n    for i in range(9): print('\\x1b[2J', params['steps'], i)\n    return 1.0\n"
    )
    (tmp_path / "reward_function.py").write_text(source)
    shown = racecraft("reward", "check", "reward_function.py").out
    assert "Printed at 'finish':" in shown
    assert "200.0 0" in shown
    assert "5 lines more" in shown
    assert "\x1b[2J" not in shown
    situations = racecraft("reward", "check", "reward_function.py", "--json").document["situations"]
    assert all(situation["printed"].count("\n") == 9 for situation in situations)


def test_a_bad_reward_is_told_with_line_and_column(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "reward_function.py").write_text(BAD)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 1
    assert "line 2, column" in outcome.out
    assert "Did you mean 'progress'?" in outcome.out
    assert "Not fit for training." in outcome.out
    (problem,) = racecraft("reward", "check", "reward_function.py", "--json").document["problems"]
    assert (problem["line"], problem["severity"]) == (2, "error")
    assert problem["column"] >= 1


def test_a_reward_that_fails_in_a_situation_says_in_which(racecraft: Run, tmp_path: Path) -> None:
    source = "def reward_function(params):\n    return 1 / (1 - params['is_offtrack'])\n"
    (tmp_path / "reward_function.py").write_text(source)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 1
    assert "ZeroDivisionError" in outcome.out
    document = racecraft("reward", "check", "reward_function.py", "--json").document
    failed = [situation["name"] for situation in document["situations"] if situation["error"]]
    assert failed == ["off track"]


@pytest.mark.costly
def test_a_failure_of_numpys_is_told_with_what_to_write_instead(racecraft: Run, tmp_path: Path) -> None:
    raised = "TypeError('only 0-dimensional arrays can be converted to Python scalars')"
    (tmp_path / "reward_function.py").write_text(f"def reward_function(params):\n    raise {raised}\n")
    assert "hint: NumPy makes a number only of" in racecraft("reward", "check", "reward_function.py").out


@pytest.mark.costly
def test_a_reward_is_tried_among_as_many_objects_as_are_asked_for(racecraft: Run, tmp_path: Path) -> None:
    source = "def reward_function(params):\n    return len(params['objects_speed']) / any(params['objects_speed'])\n"
    (tmp_path / "reward_function.py").write_text(source)
    assert racecraft("reward", "check", "reward_function.py").status == 1
    checked = racecraft("reward", "check", "reward_function.py", "--objects", "2", "--bots", "1", "--json").document
    assert checked["ok"]
    assert {situation["reward"] for situation in checked["situations"]} == {3.0}
    assert {"near an object", "crash"} <= {situation["name"] for situation in checked["situations"]}
    outcome = racecraft("reward", "check", "reward_function.py", "--objects", "33")
    assert outcome.status != 0


def test_presets_are_listed_shown_and_fit(racecraft: Run) -> None:
    listed = racecraft("reward", "list", "--json").document["rewards"]
    assert {"centerline", "racing"} <= listed.keys()
    assert all(text.endswith(".") for text in listed.values())
    assert "centerline" in racecraft("reward", "list").out
    source = racecraft("reward", "show", "centerline").out
    assert "def reward_function(params):" in source
    assert json.loads(racecraft("reward", "show", "centerline", "--json").out) == {"source": source}
