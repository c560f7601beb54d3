from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, fields, replace
from pathlib import Path

import pytest

from racecraft import _native
from racecraft.errors import ConfigError
from racecraft.sim import Vehicle, load_vehicle
from racecraft.sim.vehicle import LEAST_REACH, LIMITS, MIN_INERTIA_RATIO, PRESETS

CPP = (Path(__file__).parents[2] / "native/tests/vehicle_test.cpp").read_text()
FULL = replace(Vehicle(), mass=1.0, yaw_inertia=5.0, front_axle=1.0, rear_axle=1.0, half_track=0.5)


def test_fields_are_the_cores_parameters_in_its_order():
    assert tuple(field.name for field in fields(Vehicle)) == tuple(_native.VEHICLE_PARAMETERS) == tuple(LIMITS)
    assert Vehicle().values() == list(asdict(Vehicle()).values())


def test_the_corners_driven_by_the_cpp_test_are_the_limits():
    number = r"(-?[\d.]+)f"
    table = dict.fromkeys(LIMITS)
    for name, low, high in re.findall(rf'\{{"(\w+)", {number}, {number}\}}', CPP):
        table[name] = (float(low), float(high))
    assert table == LIMITS
    assert float(re.search(rf"kMinInertiaRatio = {number}", CPP)[1]) == MIN_INERTIA_RATIO
    assert float(re.search(rf"kLeastReach = {number}", CPP)[1]) == LEAST_REACH


def test_the_default_car_of_the_cpp_tests_is_ours():
    for name, value in asdict(Vehicle()).items():
        assert float(re.search(rf"\.{name} = (-?[\d.]+)f", CPP)[1]) == value


@pytest.mark.parametrize("name", list(LIMITS))
def test_parameters_have_a_range(name):
    low, high = LIMITS[name]
    for value in (low - 1e-3, high * 1.001 + 1e-3, math.nan, math.inf, -math.inf, None, "1", True, [1.0]):
        with pytest.raises(ConfigError, match=name):
            replace(FULL, **{name: value})


def test_a_car_that_turns_faster_than_the_substeps_is_refused():
    with pytest.raises(ConfigError, match=r"yaw_inertia is 0\.02; a car of 7\.5 kg .* at least 0\.056"):
        Vehicle(yaw_inertia=0.02)
    assert Vehicle(yaw_inertia=0.06).yaw_inertia == 0.06


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_and_files(name, tmp_path):
    vehicle = load_vehicle(name)
    path = tmp_path / "car.json"
    vehicle.save(path)
    assert load_vehicle(path) == vehicle == load_vehicle(str(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not valid JSON"),
        ("{" * 100_000, "not valid JSON|larger than|nested"),
        ("[]", "holds a JSON array, expected an object"),
        ('{"mas": 3}', "unknown parameter 'mas'.*Did you mean 'mass'"),
        ('{"mass": "heavy"}', "mass is 'heavy'"),
        ('{"mass": NaN}', "NaN is not a number"),
        ('{"mass": 1e400}', "1e400 is too large"),
        (json.dumps({"mass": 3, "note": "x" * 200_000}), "larger than 100,000 bytes"),
    ],
)
def test_bad_files_say_what_is_wrong(text, message, tmp_path):
    path = tmp_path / "car.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_vehicle(path)


def test_a_folder_and_bytes_are_no_vehicle_files(tmp_path):
    (tmp_path / "car").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path, tmp_path / "car", tmp_path / "none.json"):
        with pytest.raises(ConfigError):
            load_vehicle(path)


def test_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere/v\.json cannot be written: No such file"):
        load_vehicle("v5").save(tmp_path / "nowhere" / "v.json")


def test_a_misspelt_preset_is_recognised():
    with pytest.raises(ConfigError) as caught:
        load_vehicle("v55")
    assert "v5" in f"{caught.value} {caught.value.hint}"
