"""Every combination of AWS's sensors can be trained, saved, resumed, evaluated and filmed."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from tiny_runs import Train, assert_same

from racecraft import evaluate
from racecraft.agent import LidarConfig, ModelMetadata, SensorSuite
from racecraft.agent.sensors import CAMERAS, LIDARS
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder
from racecraft.sim import Objects, Obstacles
from racecraft.training import resume

COMBINATIONS = [(camera, *lidar) for camera, lidar in itertools.product(CAMERAS, [(), *((name,) for name in LIDARS)])]
BOXES = Objects(obstacles=Obstacles(count=3, placement="random"))


def write_metadata(path: Path, names: tuple[str, ...], lidar: LidarConfig | None = None) -> Path:
    ModelMetadata(sensors=names, neural_network="RACECRAFT_SMALL", lidar=lidar).save(path)
    return path


@pytest.mark.parametrize("names", COMBINATIONS, ids="+".join)
def test_every_combination_trains_and_drives(tiny: Train, tmp_path: Path, names: tuple[str, ...]) -> None:
    lidar = LidarConfig(16, 4, 3.0) if "DISCRETIZED_SECTOR_LIDAR" in names else None
    path = write_metadata(tmp_path / "metadata.json", names, lidar)
    result = tiny(model_metadata=path, until="64 steps", evaluate_every=64, objects=BOXES)
    step, policy = load_policy(RunFolder.open(result.run), num_threads=1)
    assert step == 64
    assert policy.sensors == SensorSuite(names, lidar)
    spec = policy.learner.spec
    assert (spec.lenses, spec.lidar_size) == (policy.sensors.lenses, policy.sensors.lidar_size)


@pytest.mark.costly
@pytest.mark.parametrize("randomize", ["none", "light"])
def test_a_run_with_two_lenses_and_a_lidar_resumes_to_the_same_bits(
    tiny: Train, tmp_path: Path, randomize: str
) -> None:
    path = write_metadata(tmp_path / "metadata.json", ("STEREO_CAMERAS", "LIDAR"))
    settings = {"model_metadata": path, "evaluate_every": 64, "objects": BOXES, "randomize": randomize}
    whole = tiny(until="256 steps", name="whole", **settings)
    half = tiny(until="128 steps", name="half", **settings)
    resume(half.run, until="256 steps")
    assert_same(half.run, whole.run)


@pytest.mark.costly
def test_a_run_with_such_sensors_is_evaluated_and_filmed(tiny: Train, tmp_path: Path) -> None:
    path = write_metadata(tmp_path / "metadata.json", ("STEREO_CAMERAS", "SECTOR_LIDAR"))
    result = tiny(model_metadata=path, until="64 steps", objects=BOXES)
    found = evaluate(result.run, laps=1, num_trials=2, max_resets=1)
    assert found.files["video"].stat().st_size > 1000
    assert json.loads(found.files["summary"].read_text())["trials"]
    again = evaluate(result.run, laps=1, num_trials=2, max_resets=1, video=False)
    rows, same = (found.evaluation.trials[0].recording.rows for found in (found, again))
    np.testing.assert_array_equal(rows, same)


def test_sensors_may_be_named_without_a_file(tiny: Train) -> None:
    result = tiny(sensors=("LEFT_CAMERA", "LIDAR"), until="64 steps")
    assert RunFolder.open(result.run).read_model_metadata().sensors == ("LEFT_CAMERA", "LIDAR")
