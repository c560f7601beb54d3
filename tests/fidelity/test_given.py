"""What can be given to be held against each other, and what is said of anything else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.errors import ConfigError, RewardError
from racecraft.fidelity import calibrate, fit_frame, replay
from racecraft.fidelity.given import log_files, track_of, vehicle_of
from racecraft.fidelity.rules import TrackRules
from racecraft.sim import load_vehicle
from racecraft.track import load_track


def test_files_are_named_by_texts_and_by_paths(tmp_path: Path) -> None:
    oval = load_track("oval")
    route = tmp_path / "route.npy"
    np.save(route, np.column_stack([oval.centerline, oval.inner, oval.outer]))
    assert track_of(oval) is oval
    assert np.array_equal(track_of(route).centerline, track_of(str(route)).centerline)
    car = load_vehicle("v4")
    car.save(tmp_path / "car.json")
    assert vehicle_of(tmp_path / "car.json") == vehicle_of(str(tmp_path / "car.json")) == vehicle_of("v4") == car
    assert log_files("a.csv") == log_files(Path("a.csv")) == log_files(iter(["a.csv"])) == [Path("a.csv")]
    assert log_files(["a.csv", Path("b.csv")]) == [Path("a.csv"), Path("b.csv")]


REWARD = r"reward is .*; allowed is its source, which racecraft\.reward\.load_reward\(NAME_OR_FILE\) reads\."


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"logs": []}, r"logs is \[\]; use a file's path, or a list of several\."),
        ({"logs": 5}, "logs is 5; use a file's path"),
        ({"logs": ["a.csv", 5]}, r"logs is \['a.csv', 5\]; use a file's path"),
        ({"track": None}, "track is None; use a name or a file's path"),
        ({"vehicle": None}, "vehicle is None; use v4, v5, v6, a file's path or a Vehicle"),
        ({"rows": 5}, "rows is 5; use a CSV file's path"),
        ({"rows": "\0"}, "rows is .*; use a CSV file's path"),
        ({"reward": "racing"}, REWARD),
        ({"reward": "mine/reward_function.py"}, REWARD),
        ({"reward": Path("reward_function.py")}, REWARD),
    ],
)
def test_anything_else_is_one_sentence(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        replay(**{"logs": "a.csv", "track": "oval", **given})


def test_a_reward_is_checked_as_before_a_training() -> None:
    with pytest.raises(RewardError, match="'import pandas' is not allowed in a reward function"):
        replay("a.csv", track="oval", reward="import pandas\ndef reward_function(params):\n    return 1.0\n")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"logs": ()}, r"logs is \(\); use a file's path"),
        ({"track": 5}, "track is 5; use a name or a file's path"),
        ({"vehicle": 5}, "vehicle is 5; use v4"),
        ({"num_windows": 0}, "num_windows is 0; allowed is a whole number from 50"),
        ({"iterations": "a"}, "iterations is 'a'; allowed is a whole number from 1"),
    ],
)
def test_a_fit_says_it_too(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        calibrate(**{"logs": "a.csv", **given})


def test_a_frame_is_a_file() -> None:
    with pytest.raises(ConfigError, match=r"frame is 5; use a picture's path\."):
        fit_frame(5, track="oval")  # type: ignore[arg-type]


def test_rules_are_those_of_a_track_and_not_of_its_name() -> None:
    with pytest.raises(ConfigError, match=r"^track is 'oval'; get one with load_track\(name or path\)\.$"):
        TrackRules("oval")  # type: ignore[arg-type]
