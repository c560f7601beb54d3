"""What is no setting of a training, or contradicts another, is refused before there is a run."""

from __future__ import annotations

import inspect
import json
import os
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.agent import ModelMetadata
from racecraft.errors import ConfigError
from racecraft.track import load_track
from racecraft.track.readers import save_route
from racecraft.training import settings as settings_module
from racecraft.training import train
from racecraft.training.plan import make_plan
from racecraft.training.settings import TrainSettings, make_settings

DISCRETE = ModelMetadata(neural_network="RACECRAFT_SMALL")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"start": {}}, "start is {}; use racecraft.sim.Start(...)."),
        ({"sac": {}}, "sac is {}; use racecraft.learn.SACConfig(...)."),
        ({"distill": {"num_envs": 8}}, "distill is {'num_envs': 8}; use racecraft.learn.DistillConfig(...)."),
        ({"sb3": 5}, "sb3 is 5; use racecraft.learn.sb3.SB3Config(...)."),
        ({"sensors": 5}, "sensors is 5; use a list of AWS's sensor names."),
        ({"sensors": "LIDAR"}, "sensors is 'LIDAR'; use a list of AWS's sensor names."),
        ({"aws_log": 5}, "aws_log is 5; use a file's path, or '-'."),
        ({"aws_log": "\0"}, "aws_log is '\\x00'; use a file's path, or '-'."),
        ({"root": "a\0b"}, "root is 'a\\x00b'; use a folder's path."),
        (
            {"reporter": 5},
            "reporter is 5; use an object with the methods begin, note, step, iteration, evaluation, such as a "
            "racecraft.training.SilentReporter().",
        ),
        ({"started": "x"}, "started is 'x'; allowed is a time of time.monotonic(), in seconds."),
        ({"algorithm": []}, "algorithm is []; use a name such as 'ppo'."),
        ({"tells_nearby": 5}, "tells_nearby is 5; allowed are True and False."),
        (
            {"model_metadata": "m.json", "actions": "safe"},
            "actions and model_metadata both say what a car's actions are; give one of them.",
        ),
        (
            {"model_metadata": "m.json", "sensors": ["LIDAR"]},
            "sensors and model_metadata both say what a car's sensors are; give one of them.",
        ),
        ({"model_metadata": "\0"}, "\ufffd cannot be read: it is no path."),
    ],
)
def test_arguments_of_another_kind_are_refused(tmp_path: Path, given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        train("oval", **{"root": tmp_path / "runs", **given})
    assert str(refusal.value) == says
    assert not (tmp_path / "runs").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
def test_a_track_whose_name_no_run_could_keep_leaves_no_run(tmp_path: Path) -> None:
    save_route(load_track("oval"), file := tmp_path / os.fsdecode(b"r\xff.npy"))
    with pytest.raises(ConfigError, match=r"track is '.*r\\udcff\.npy'; a run keeps that as text"):
        train(file, root=tmp_path / "runs", until="1 steps")
    assert not (tmp_path / "runs").exists()


def test_awss_file_goes_before_the_actions_of_a_recipe(tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(json.dumps(DISCRETE.to_dict()))
    with pytest.raises(ConfigError, match="distill") as refusal:
        train("oval", recipe="steady", model_metadata=tmp_path / "m.json", algorithm="sb3:distill", root=tmp_path)
    assert "both say" not in str(refusal.value)


def test_a_seed_of_numpy_s_is_a_number_that_json_knows() -> None:
    seed = make_plan(seed=np.int64(7)).settings.seed
    assert (seed, type(seed)) == (7, int)
    for wrong in (np.float64(7), True, "7"):
        with pytest.raises(ConfigError, match=r"seed is .*; allowed is a whole number from 0"):
            make_plan(seed=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "says"), [({"name": 5}, "name is 5; use a text"), ({"root": 5}, "root is 5; use a folder's path")]
)
def test_names_are_texts_and_places_are_paths(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        train("oval", **given)


def test_an_unknown_setting_is_refused_with_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"'num_env'.*Did you mean 'num_envs'"):
        make_settings(metadata=DISCRETE, num_env=4)


def test_a_misspelt_argument_of_train_is_told_its_name() -> None:
    arguments = set(inspect.signature(train).parameters) - {"settings"}
    assert arguments <= {*settings_module.ARGUMENTS, *(field.name for field in fields(TrainSettings))}
    with pytest.raises(ConfigError, match=r"There is no setting 'rewrd'\. Did you mean 'reward'"):
        train("oval", rewrd="racing")
