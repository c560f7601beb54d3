import json
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.errors import ConfigError, RunError
from racecraft.run import RunFolder, RunInfo, list_runs
from racecraft.run.folder import _installed_version, checked_name, sanitize_name
from racecraft.run.training_params import TrainingParams


def test_a_run_comes_back_as_it_was_made(tmp_path):
    run = RunFolder.create(tmp_path / "runs", name="first")
    info = RunInfo(seed=7, track="oval", track_digest="ab" * 32, settings={"minutes": 5, "until": "5 laps"})
    parts = {
        "reward_function": "def reward_function(params):\n    return 1.0  # ü\n",
        "model_metadata": ModelMetadata(),
        "hyperparameters": Hyperparameters(lr=1e-4),
        "training_params": TrainingParams(world_name="oval"),
    }
    run.write_info(info)
    run.write_inputs(**parts)
    again = RunFolder.open(tmp_path / "runs" / "first")
    assert again == run
    assert again.name == "first"
    assert again.read_info() == info
    assert {name: getattr(again, f"read_{name}")() for name in parts} == parts
    assert again.checkpoints.folder == run.path / "checkpoints"
    assert again.evaluation_metrics("20250102030405").name == "EvaluationMetrics-20250102030405.json"
    assert again.evaluation("20250102030405").name == "evaluation-20250102030405"
    assert list_runs(tmp_path / "runs") == [run]
    assert {"python", "numpy", "machine"} <= info.versions.keys()


@pytest.mark.parametrize("place", [Path(np.__file__).parent, Path("/nowhere/numpy")], ids=["beside", "elsewhere"])
def test_the_version_of_a_package_is_what_was_installed(place):
    assert _installed_version("numpy", beside=place) == version("numpy")


def test_optional_files_may_be_missing(tmp_path):
    run = RunFolder.create(tmp_path)
    run.write_inputs(reward_function="x", model_metadata=ModelMetadata())
    assert run.read_hyperparameters() is None
    assert run.read_training_params() is None


def test_names_are_made_from_a_prefix_and_never_collide(tmp_path):
    names = {RunFolder.create(tmp_path, prefix="Mein Auto/../#1 ").name for _ in range(5)}
    assert len(names) == 5
    assert all(name.startswith("Mein-Auto-..-1-2") for name in names)


def test_taken_name(tmp_path):
    RunFolder.create(tmp_path, name="a")
    with pytest.raises(RunError, match="exists") as error:
        RunFolder.create(tmp_path, name="a")
    assert "--resume" in error.value.hint


@pytest.mark.parametrize(
    "name", ["", ".", "..", "a/b", "/etc", "a b", "-x", ".x", "ä", "x" * 65, "CON", "nul.txt", "a\n"]
)
def test_bad_names_are_refused(tmp_path, name):
    with pytest.raises(RunError, match="not allowed"):
        RunFolder.create(tmp_path / "runs", name=name)
    assert not (tmp_path / "runs").exists()


def test_what_is_no_name_or_place_is_told_so(tmp_path):
    for name in (5, b"a", tmp_path):
        with pytest.raises(ConfigError, match=r"name is .*; use a text\."):
            RunFolder.create(tmp_path / "runs", name=name)
    for root in (5, None, b"runs"):
        with pytest.raises(ConfigError, match=r"root is .*; use a folder's path\."):
            RunFolder.create(root)
    assert not (tmp_path / "runs").exists()


@given(st.text(max_size=100))
def test_sanitized_names_are_allowed(text):
    name = sanitize_name(text)
    assert checked_name(name) == name


def test_open_says_what_is_missing_and_guesses(tmp_path):
    RunFolder.create(tmp_path, name="oval-1").write_info(RunInfo(seed=1, track="oval", track_digest=""))
    RunFolder.create(tmp_path, name="empty")
    with pytest.raises(RunError, match="There is no run") as error:
        RunFolder.open(tmp_path / "ovla-1")
    assert error.value.hint == "Did you mean 'oval-1'?"
    RunFolder.create(tmp_path, name="b").write_info(RunInfo(seed=1, track="oval", track_digest=""))
    with pytest.raises(RunError, match="There is no run") as error:
        RunFolder.open(tmp_path / "b@20480000")
    assert error.value.hint == "Did you mean 'b'?"
    with pytest.raises(RunError, match=r"run.json is missing") as error:
        RunFolder.open(tmp_path / "empty")
    assert error.value.hint == ""
    with pytest.raises(RunError, match=r"holds no run") as error:
        RunFolder.open(tmp_path)
    assert error.value.hint == f"It is a folder of runs: name one of them, such as {tmp_path}/b."
    with pytest.raises(RunError, match="There is no run") as error:
        RunFolder.open(tmp_path / ("x" * 5000))  # which a file system does not even look up
    assert len(str(error.value)) < 600


def test_files_of_aws_s_are_imported_before_they_are_a_run(tmp_path):
    (tmp_path / "my model").mkdir()
    (tmp_path / "my model/model_metadata.json").write_text("{}")
    (tmp_path / "car.tar.gz").write_bytes(b"x")
    with pytest.raises(RunError, match=r"holds no run: run\.json is missing\.") as error:
        RunFolder.open(tmp_path / "my model")
    assert error.value.hint == f"racecraft import '{tmp_path}/my model' makes a run of a model of AWS's."
    with pytest.raises(RunError, match=r"car\.tar\.gz' is an archive, not a run's folder\.") as error:
        RunFolder.open(tmp_path / "car.tar.gz")
    assert error.value.hint == f"racecraft import {tmp_path}/car.tar.gz makes a run of a model of AWS's."
    with pytest.raises(RunError, match="There is no run"):
        RunFolder.open(tmp_path / "other.tar.gz")


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 1}', '{"format": 2}', '{"format": 1, "seed": 1, "x": 2}'])
def test_damaged_run_json(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(RunError):
        RunFolder.open(tmp_path).read_info()


@pytest.mark.parametrize(("name", "value"), [("created", 5), ("versions", "x"), ("parent", "b@4096"), ("seed", "1")])
def test_a_value_of_another_kind_in_run_json_is_named(tmp_path, name, value):
    RunFolder(tmp_path).write_info(RunInfo(seed=1, track="oval", track_digest=""))
    document = json.loads((tmp_path / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps({**document, name: value}))
    with pytest.raises(RunError, match=rf"cannot be opened: {name} in run\.json is {value!r}\."):
        RunFolder.open(tmp_path).read_info()


def test_damaged_inputs(tmp_path):
    run = RunFolder(tmp_path)
    with pytest.raises(RunError, match="cannot be read"):
        run.read_reward_function()
    run.reward_function.write_bytes(b"\xff")
    with pytest.raises(RunError, match="not UTF-8"):
        run.read_reward_function()
    run.reward_function.write_bytes(b" " * 600_000)
    with pytest.raises(RunError, match="larger than"):
        run.read_reward_function()
    with pytest.raises(ConfigError, match="cannot be read"):
        run.read_model_metadata()


def test_info_that_is_not_json_is_refused(tmp_path):
    with pytest.raises(RunError, match="cannot be written"):
        RunFolder(tmp_path).write_info(RunInfo(seed=1, track="", track_digest="", settings={"x": float("nan")}))
    assert list(tmp_path.iterdir()) == []


def test_only_one_trainer(tmp_path):
    run = RunFolder.create(tmp_path, name="a")
    with run.lock(), pytest.raises(RunError, match="in use"), run.lock():
        pass


def test_root_that_is_a_file(tmp_path):
    (tmp_path / "runs").write_text("")
    with pytest.raises(RunError, match="cannot be made"):
        RunFolder.create(tmp_path / "runs", name="a")


def test_run_json_is_for_people(tmp_path):
    RunFolder(tmp_path).write_info(RunInfo(seed=1, track="oval", track_digest="x"))
    text = (tmp_path / "run.json").read_text()
    assert text.count("\n") > 5
    assert json.loads(text)["format"] == 1
