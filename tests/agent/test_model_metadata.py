import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft.agent import (
    PRESETS,
    ContinuousActionSpace,
    DiscreteActionSpace,
    Hyperparameters,
    LidarConfig,
    ModelMetadata,
    action_space,
)
from racecraft.errors import ConfigError

SHARED = Path(__file__).parents[3] / "shared"
CAMERA = ["FRONT_FACING_CAMERA"]
TWO = [{"steering_angle": -10, "speed": 1}, {"steering_angle": 10, "speed": 1}]
LIMITS = {"steering_angle": {"low": -20, "high": 25}, "speed": {"low": 1, "high": 3.5}}


def test_real_file_is_read_and_written_unchanged(tmp_path):
    path = SHARED / "logs/drfc/model_metadata.json"
    if not path.exists():
        pytest.skip("shared/logs is not there")
    metadata = ModelMetadata.load(path)
    assert (metadata.version, metadata.sensors, metadata.action_space.size) == (
        "4",
        ("FRONT_FACING_CAMERA",),
        14,
    )
    assert metadata.notes == ()
    metadata.save(tmp_path / "again.json")
    assert json.loads((tmp_path / "again.json").read_text()) == json.loads(path.read_text())


def test_all_real_runs_are_accepted():
    files = sorted((SHARED / "traces").glob("*.json"))
    if not files:
        pytest.skip("shared/traces is not there")
    fields = ("action_space", "sensor", "neural_network", "training_algorithm", "action_space_type")
    for path in files:
        run = json.loads(path.read_text())
        document = run.get("model_metadata") or {name: run[name] for name in fields}
        metadata = ModelMetadata.from_dict(document)
        assert metadata.action_space.to_aws() == document["action_space"]
        assert ModelMetadata.from_dict(metadata.to_dict()) == metadata


def test_ancient_file_with_45_degrees():
    actions = [{"steering_angle": a, "speed": s} for a, s in ((45, 0.8), (-45, 0.8), (22.5, 0.8), (-22.5, 0.8))]
    metadata = ModelMetadata.from_dict({"action_space": actions}, name="old.json")
    assert (metadata.version, metadata.sensors) == ("1", ("observation",))
    assert metadata.neural_network == "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
    assert metadata.notes == (
        "old.json: action_space[0].steering_angle is 45, driven as 30: the wheels turn no further.",
        "old.json: action_space[1].steering_angle is -45, driven as -30: the wheels turn no further.",
    )
    with pytest.raises(ConfigError, match=r"action_space\[0\].steering_angle is 45; allowed is -30 to 30"):
        ModelMetadata.from_dict({"action_space": actions, "version": "5"})


def test_file_of_2019_with_nine_metres_a_second():
    actions = [{"steering_angle": angle, "speed": speed} for angle, speed in ((-30, 5), (0, 9), (0, 12.0), (30, 4))]
    metadata = ModelMetadata.from_dict({"action_space": actions}, name="old.json")
    assert [action["speed"] for action in metadata.to_dict()["action_space"]] == [5, 9, 12, 4]
    assert metadata.notes == ("old.json: 3 of 4 actions ask for more than 4 m/s, driven as that.",)
    with pytest.raises(ConfigError, match=r"\[1\].speed is 40; allowed is 0.1 to 4 m/s \(files of 2019 up to 12\)"):
        ModelMetadata.from_dict({"action_space": [actions[0], {"steering_angle": 0, "speed": 40}]})


def test_missing_version_depends_on_the_sensor():
    assert ModelMetadata.from_dict({"action_space": TWO, "sensor": CAMERA}).version == "2"
    assert ModelMetadata.from_dict({"action_space": TWO}).version == "1"


@pytest.mark.parametrize("version", ["5", 5, 5.0, "5.0"])
def test_version_may_be_a_number(version):
    assert ModelMetadata.from_dict({"action_space": TWO, "version": version}).version == "5"


def test_words_may_have_capital_letters():
    document = {"action_space": LIMITS, "action_space_type": " Continuous", "training_algorithm": "SAC"}
    metadata = ModelMetadata.from_dict(document)
    assert isinstance(metadata.action_space, ContinuousActionSpace)
    assert metadata.training_algorithm == "sac"


def test_continuous_and_lidar_round_trip():
    document = {
        "action_space": LIMITS,
        "action_space_type": "continuous",
        "training_algorithm": "sac",
        "sensor": ["STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"],
        "neural_network": "DEEP_CONVOLUTIONAL_NETWORK",
        "version": "6",
        "lidar_config": {"num_sectors": "16", "num_values_per_sector": 4, "clipping_dist": 1.5},
        "preview": True,
    }
    metadata = ModelMetadata.from_dict(document, name="m.json")
    assert isinstance(metadata.action_space, ContinuousActionSpace)
    assert metadata.lidar == LidarConfig(16, 4, 1.5)
    assert metadata.notes == ("m.json: unknown field 'preview' has no effect.",)
    assert metadata.to_dict() == {**document, "lidar_config": {**document["lidar_config"], "num_sectors": 16}}


LIDAR = [*CAMERA, "DISCRETIZED_SECTOR_LIDAR"]
CARS = {"num_values": 64, "min_angle": -150, "max_angle": 150, "min_distance": 0.15, "max_distance": 1}


@pytest.mark.parametrize(
    "space",
    [
        *map(action_space, PRESETS),
        DiscreteActionSpace([(0.018440668993009002, 1.0 / 3.0), (-0.3, 2.0)]),
        ContinuousActionSpace([-0.018440668993009002, 1.0 / 3.0], [0.3, 2.0]),
    ],
    ids=repr,
)
def test_what_a_file_will_say_is_known_before_it_is_read(space):
    """To the bit: of some angles in radians there is no decimal in degrees that would be them again."""
    given = ModelMetadata(action_space=space, sensors=("LIDAR", "observation"))
    filed = given.as_filed
    read = ModelMetadata.from_dict(given.to_dict())
    assert filed == read
    ends = [
        (one.action_space.table,) if space.kind == "discrete" else (one.action_space.low, one.action_space.high)
        for one in (filed, read)
    ]
    np.testing.assert_array_equal(*ends)


def test_unknown_fields_are_told_at_any_depth():
    document = {
        "action_space": [{**TWO[0], "note": 1}, {**TWO[1], "note": 2, "spede": 2}],
        "lidar_config": {"num_sectors": 4, "num_value_per_sector": 2},
        "sensor": LIDAR,
        "sensors": CAMERA,
    }
    assert ModelMetadata.from_dict(document, name="m.json").notes == (
        "m.json: unknown field 'sensors' has no effect. Did you mean 'sensor'?",
        "m.json: unknown field 'lidar_config.num_value_per_sector' has no effect. "
        "Did you mean 'num_values_per_sector'?",
        "m.json: unknown field 'action_space[].note' has no effect.",
        "m.json: unknown field 'action_space[1].spede' has no effect. Did you mean 'speed'?",
    )
    speed = {**LIMITS, "speed": {"low": 1, "high": 2, "hihg": 3}}
    assert ModelMetadata.from_dict({"action_space": speed}, name="m.json").notes == (
        "m.json: unknown field 'action_space.speed.hihg' has no effect. Did you mean 'high'?",
    )


def test_what_is_unknown_of_the_lidar_is_kept_and_written_back():
    config = {"num_sectors": 4, "clipping_distance": 0.5, "num_value_per_sector": 2}
    metadata = ModelMetadata.from_dict({"action_space": TWO, "sensor": LIDAR, "lidar_config": config})
    assert metadata.lidar == LidarConfig(4, 8, 0.5)
    assert metadata.to_dict()["lidar_config"] == {**config, "num_values_per_sector": 8, "clipping_dist": 0.5}
    again = ModelMetadata.from_dict(metadata.to_dict())
    assert (again, again.notes) == (metadata, metadata.notes)


def test_what_is_unknown_of_an_action_is_kept_and_written_back(tmp_path):
    listed = [{**TWO[0], "note": "left"}, {**TWO[1], "index": 7, "spede": 2}]
    limits = {"steering_angle": {**LIMITS["steering_angle"], "unit": "°"}, "speed": LIMITS["speed"], "why": [1, 2]}
    written = {
        "discrete": [{**TWO[0], "index": 0, "note": "left"}, {**TWO[1], "index": 1, "spede": 2}],
        "continuous": limits,
    }
    for space in (listed, limits):
        metadata = ModelMetadata.from_dict({"action_space": space, "version": "3"}, name="m.json")
        metadata.save(tmp_path / "m.json")
        document = json.loads((tmp_path / "m.json").read_text())
        assert document["action_space"] == written[metadata.action_space.kind]
        again = ModelMetadata.from_dict(document, name="m.json")
        unknown = [note for note in metadata.notes if "unknown" in note]
        assert (again, len(unknown), list(again.notes)) == (metadata, 2, unknown)
        other = replace(metadata, action_space=action_space("default")).to_dict()["action_space"]
        assert all(set(action) == {"steering_angle", "speed", "index"} for action in other)


def test_clipping_distance_is_what_a_car_calls_clipping_dist():
    def read(**config):
        return ModelMetadata.from_dict({"action_space": TWO, "sensor": LIDAR, "lidar_config": config}, name="m.json")

    metadata = read(clipping_distance="0.5")
    assert metadata.lidar == LidarConfig(clipping_dist=0.5)
    assert metadata.notes == (
        "m.json: lidar_config.clipping_distance 0.5 is taken as clipping_dist, which a car calls so.",
    )
    metadata = read(clipping_distance=0.5, clipping_dist=1.5)
    assert metadata.lidar == LidarConfig(clipping_dist=1.5)
    assert metadata.notes == (
        "m.json: lidar_config.clipping_distance 0.5 has no effect, as clipping_dist is given too.",
    )
    with pytest.raises(ConfigError, match=r"lidar_config\.clipping_dist is 20; allowed is above 0\.15"):
        read(clipping_distance=20)


def test_a_cars_own_file_is_no_mistake_but_a_part_of_it_is():
    def notes(**config):
        document = {"action_space": TWO, "sensor": [*CAMERA, "LIDAR"], "lidar_config": config}
        return ModelMetadata.from_dict(document, name="m.json").notes

    assert notes(**CARS, clipping_distance=1, num_sectors=64) == ()
    assert notes(num_values=64, num_sectors=64) == (
        "m.json: unknown field 'lidar_config.num_values' has no effect. Did you mean 'num_values_per_sector'?",
        "m.json: lidar_config has no effect without the sensor DISCRETIZED_SECTOR_LIDAR.",
    )


def test_continuous_is_inferred_where_the_type_is_missing():
    assert ModelMetadata.from_dict({"action_space": LIMITS}).action_space.kind == "continuous"


def test_notes_for_slow_continuous_and_odd_index():
    slow = {**LIMITS, "speed": {"low": 0.1, "high": 1}}
    assert "below 0.5 m/s" in ModelMetadata.from_dict({"action_space": slow}).notes[0]
    odd = [{**TWO[0], "index": 0}, {**TWO[1], "index": 2}]
    assert "action_space[1].index is 2" in ModelMetadata.from_dict({"action_space": odd}).notes[0]


def test_indices_that_count_from_1_are_told_once():
    counted = [{**action, "index": index} for index, action in enumerate(TWO * 10, start=1)]
    assert ModelMetadata.from_dict({"action_space": counted}, name="a.json").notes == (
        "a.json: the index of 20 of 20 actions is not its place in the list, which counts.",
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"action_space": None}, "action_space is None; allowed is a list of 2 to 30 actions"),
        ({"action_space": TWO[:1]}, "allowed is a list of 2 to 30 actions"),
        ({"action_space": TWO * 16}, "allowed is a list of 2 to 30 actions"),
        (
            {"action_space": [*TWO, {"speed": 1}]},
            "action_space[2].steering_angle is missing; allowed is -30 to 30 degrees",
        ),
        (
            {"action_space": [*TWO, {"steering_angle": 1, "speed": "fast"}]},
            "action_space[2].speed is 'fast'; allowed is 0.1",
        ),
        (
            {"action_space": [*TWO, {"steering_angle": 1, "speed": 0}]},
            "action_space[2].speed is 0; allowed is 0.1 to 4 m/s",
        ),
        (
            {"action_space": [*TWO, {"steering_angle": 1, "speed": 40}]},
            "speed is 40; allowed is 0.1 to 4 m/s",
        ),
        (
            {"action_space": [*TWO, {"steering_angle": -31, "speed": 4}]},
            "steering_angle is -31; allowed is -30 to 30",
        ),
        ({"action_space": [*TWO, 3]}, "action_space[2] is 3"),
        (
            {"action_space": {**LIMITS, "speed": {"low": 1}}, "action_space_type": "continuous"},
            "speed.high is missing",
        ),
        (
            {"action_space": {**LIMITS, "speed": {"low": 1, "high": 9}}, "action_space_type": "continuous"},
            "action_space.speed.high is 9; allowed is 0.1 to 4 m/s",
        ),
        (
            {"action_space": LIMITS, "action_space_type": "discrete"},
            "action_space is an object, and action_space_type 'discrete'; allowed is a list of 2 to 30 actions, or "
            "'continuous'.",
        ),
        ({"action_space_type": " Discreet"}, "action_space_type is ' Discreet'; allowed is 'discrete' or"),
        ({"action_space_type": "continuous"}, "allowed is an object with steering_angle and speed"),
        ({"action_space_type": "discreet"}, "'discrete' or 'continuous' (Did you mean 'discrete'?)"),
        (
            {"sensor": "FRONT_FACING_CAMERA"},
            "sensor is 'FRONT_FACING_CAMERA'; allowed is a list of sensor names, such as [\"FRONT_FACING_CAMERA\"]",
        ),
        ({"sensor": []}, "sensor has 0 cameras"),
        ({"sensor": [*CAMERA, "LEFT_CAMERA"]}, "sensor has 2 cameras"),
        ({"sensor": [*CAMERA, "LIDAR", "SECTOR_LIDAR"]}, "sensor has 2 LIDARs"),
        ({"sensor": ["FRONT_CAMERA"]}, "sensor is 'FRONT_CAMERA'; allowed are"),
        (
            {"neural_network": "deep_convolutional_network"},
            "PERCEPTION (Did you mean 'DEEP_CONVOLUTIONAL_NETWORK'?)",
        ),
        ({"neural_network": "DEEP"}, "neural_network is 'DEEP'; allowed is DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"),
        ({"training_algorithm": "ppo"}, "training_algorithm is 'ppo'; allowed is 'clipped_ppo' or 'sac'"),
        ({"training_algorithm": "sac"}, "'sac' needs action_space_type 'continuous'"),
        ({"version": "7"}, "version is '7'; allowed is '1' to '6'"),
        ({"version": True}, "version is True"),
        ({"lidar_config": {"num_sectors": 7}}, "lidar_config.num_sectors is 7; allowed is a divisor of 64"),
        ({"lidar_config": {"clipping_dist": -1}}, "lidar_config.clipping_dist is -1; allowed is above 0.15"),
    ],
)
def test_wrong_field_names_itself_its_value_and_what_is_allowed(change, words):
    document = {"action_space": TWO, "sensor": CAMERA, "version": "5", **change}
    with pytest.raises(ConfigError) as error:
        ModelMetadata.from_dict(document, name="m.json")
    assert words in str(error.value)
    assert str(error.value).startswith("m.json: ")


@pytest.mark.parametrize("document", [5, [], None, "{}"])
def test_what_is_no_object_has_no_fields(document):
    with pytest.raises(ConfigError, match=r"^m.json is .*; allowed is an object of named fields"):
        ModelMetadata.from_dict(document, name="m.json")


def test_default_is_what_a_new_model_gets():
    metadata = ModelMetadata()
    assert metadata.action_space == action_space("default")
    assert ModelMetadata.from_dict(metadata.to_dict()) == metadata
    with pytest.raises(ConfigError, match="version is '9'"):
        ModelMetadata(version="9")
    with pytest.raises(
        ConfigError, match=r"lidar is \{'num_sectors': 8\}; use a racecraft\.agent\.LidarConfig, or None"
    ):
        ModelMetadata(lidar={"num_sectors": 8})


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"action_space": "continuous"}, r"action_space is 'continuous'; use racecraft\.action_space"),
        ({"action_space": [[0.0, 1.0], [0.1, 1.0]]}, "action_space is"),
        ({"sensors": "FRONT_FACING_CAMERA"}, "sensors is 'FRONT_FACING_CAMERA'; use a list"),
    ],
)
def test_what_is_no_action_space_and_no_list_of_sensors_is_told(settings, words):
    with pytest.raises(ConfigError, match=words):
        ModelMetadata(**settings)
    assert hash(ModelMetadata(sensors=["FRONT_FACING_CAMERA"])) == hash(ModelMetadata())


def test_save_says_why_it_cannot(tmp_path):
    with pytest.raises(ConfigError, match="cannot be written: No such file"):
        ModelMetadata().save(tmp_path / "none" / "model_metadata.json")


@pytest.mark.parametrize("settings", [ModelMetadata(), Hyperparameters()])
def test_what_is_no_path_is_not_written_to(settings):
    for path in (5, None, ["a"]):
        with pytest.raises(ConfigError, match=r" cannot be written: it is no path\.$"):
            settings.save(path)
