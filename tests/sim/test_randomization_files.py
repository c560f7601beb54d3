"""What is no randomisation, and the files that hold one."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from racecraft.errors import ConfigError
from racecraft.sim import CameraSpec, Randomization, Simulation, load_randomization
from racecraft.sim.randomization import PRESETS
from racecraft.track import load_track

OVAL = load_track("oval")
SMALL = CameraSpec(width=64, height=48)


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({"friction": (1.2, 0.8)}, "greater than the second"),
        ({"friction": 1.0}, "two numbers"),
        ({"friction": (1.0, 1.0, 1.0)}, "two numbers"),
        ({"friction": (0.0, 1.0)}, "0.1 to 3"),
        ({"friction": (float("nan"), 1.0)}, "0.1 to 3"),
        ({"latency": (0.0, 3.0)}, "0 to 2"),
        ({"latency": (True, 1.0)}, "0 to 2"),
        ({"blur": ("a", "b")}, "0 to 4"),
    ],
)
def test_ranges_that_are_refused(ranges, words):
    with pytest.raises(ConfigError, match=words):
        Randomization(**ranges)


@pytest.mark.parametrize(
    ("randomize", "camera"),
    [
        (Randomization(speed_gain=(1.0, 1.5)), None),
        (Randomization(camera_height=(-0.1, 0.5)), replace(SMALL, above_ground=0.1)),
        (Randomization(camera_pitch=(-0.5, 0.0)), SMALL),
    ],
)
def test_cars_and_cameras_that_cannot_be_are_refused(randomize, camera):
    with pytest.raises(ConfigError, match="At an end of the randomization's ranges"):
        Simulation(OVAL, camera=camera, randomize=randomize)


def test_files(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"preset": "light", "friction": [0.7, 1.2]}))
    assert load_randomization(path) == replace(PRESETS["light"], friction=(0.7, 1.2))
    PRESETS["strong"].save(path)
    assert load_randomization(str(path)) == PRESETS["strong"]


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere/r\.json cannot be written: No such file"):
        PRESETS["light"].save(tmp_path / "nowhere" / "r.json")
    PRESETS["light"].save(tmp_path / "r.json")
    assert load_randomization(tmp_path / "r.json") == PRESETS["light"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "not valid JSON"),
        ("[" * 100_000, "nested too deeply|larger than"),
        ("[]", "expected an object"),
        ('{"fiction": [1, 1]}', "unknown quantity 'fiction'"),
        ('{"preset": "lite"}', "is 'lite'; allowed are none, light"),
        ('{"preset": ["light"]}', "The preset of randomization file"),
        ('{"friction": null}', "two numbers"),
        ('{"friction": [1, "x"]}', "Randomization friction"),
        (" " * 200_000, "larger than"),
        ('{"friction": [1, NaN]}', "NaN is not a number"),
    ],
)
def test_files_that_are_refused(tmp_path, content, words):
    path = tmp_path / "bad.json"
    path.write_text(content)
    with pytest.raises(ConfigError, match=words):
        load_randomization(path)


def test_names_that_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="neither a preset") as caught:
        load_randomization("stong")
    assert "strong" in caught.value.hint
    with pytest.raises(ConfigError, match="neither a preset"):
        load_randomization(tmp_path)
    with pytest.raises(ConfigError, match="track_order"):
        Simulation(OVAL, camera=None, track_order="chance")
    with pytest.raises(ConfigError, match="randomize"):
        Simulation(OVAL, camera=None, randomize=0.5)  # type: ignore[arg-type]
