"""What becomes of every setting of deepracer-for-cloud and of a console job."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import models
import pytest

from racecraft.errors import ConfigError, SourceError
from racecraft.importing import drfc as settings_of_drfc
from racecraft.importing import import_run
from racecraft.importing.env_file import parse_env
from racecraft.run import RunFolder
from racecraft.sim import Bots, Objects, Obstacles, load_randomization
from racecraft.training.start import read_settings

DOCS = Path(__file__).parents[2] / "docs" / "import.md"

EVERY = {
    "DR_WORLD_NAME": "oval",
    "DR_RACE_TYPE": "OBJECT_AVOIDANCE",
    "DR_ENABLE_DOMAIN_RANDOMIZATION": "True",
    "DR_TRAIN_REVERSE_DIRECTION": "True",
    "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION": "False",
    "DR_CHANGE_START_POSITION": "True",
    "DR_TRAIN_ROUND_ROBIN_ADVANCE_DISTANCE": "0.1",
    "DR_TRAIN_START_POSITION_OFFSET": "0.5",
    "DR_TRAIN_MIN_EVAL_TRIALS": "300",
    "DR_TRAIN_BEST_MODEL_METRIC": "reward",
    "DR_EVAL_NUMBER_OF_TRIALS": "4",
    "DR_EVAL_IS_CONTINUOUS": "True",
    "DR_EVAL_MAX_RESETS": "7",
    "DR_EVAL_OFF_TRACK_PENALTY": "2.5",
    "DR_COLLISION_PENALTY": "4.0",
    "DR_EVAL_REVERSE_DIRECTION": "False",
    "DR_OA_NUMBER_OF_OBSTACLES": "3",
    "DR_OA_OBJECT_POSITIONS": '"0.23,-1;0.46,1"',
    "DR_H2B_BOT_CAR_SPEED": "0.2",
    "DR_LOCAL_S3_PRETRAINED": "True",
    "DR_LOCAL_S3_PRETRAINED_PREFIX": "older",
    "DR_LOCAL_S3_REWARD_KEY": "$DR_LOCAL_S3_CUSTOM_FILES_PREFIX/other_reward.py",
    "DR_LOCAL_S3_MODEL_METADATA_KEY": "custom_files/meta.json",
    "DR_CAR_COLOR": "Red",
    "DR_TRAIN_RTF": "1.0",
    "DR_WORLD_NAM": "x",
    "MY_OWN": "x",
    "DR_KINESIS_STREAM_NAME": "",
    "DR_EVAL_CHECKPOINT": "${X}",
}


def test_every_setting_is_accounted_for(tmp_path: Path) -> None:
    other = models.REWARD.replace("progress", "speed")
    files = {
        "run.env": "".join(f"{name}={value}\n" for name, value in EVERY.items()),
        "custom_files/reward_function.py": models.REWARD,
        "custom_files/other_reward.py": other,
        "custom_files/meta.json": models.METADATA,
    }
    found = import_run(models.as_folder(files, tmp_path / "drfc"), name="x")
    told = " ".join([*found.used, *found.unused, *found.unknown, *found.notes])
    for name in EVERY:
        assert settings_of_drfc.ALIASES.get(name, name) in told, name
    assert found.unknown == {"DR_WORLD_NAM": "Did you mean 'DR_WORLD_NAME'?", "MY_OWN": ""}
    assert any("fresh" in note for note in found.notes)
    assert found.used["DR_RACE_TYPE=OBJECT_AVOIDANCE"] == "obstacles on the track"
    assert found.used["DR_ENABLE_DOMAIN_RANDOMIZATION=True"] == "lamps of random colours"
    assert found.used["DR_OA_NUMBER_OF_OBSTACLES=3"] == "objects on the track"
    assert "DR_H2B_BOT_CAR_SPEED=0.2" in found.unused
    assert found.unused["DR_LOCAL_S3_PRETRAINED_PREFIX=older"] == "counts until the model has weights of its own"
    best = found.unused["DR_TRAIN_BEST_MODEL_METRIC=reward"]
    assert "among objects the one with most whole laps comes first" in best
    assert best in (Path(__file__).parents[2] / "docs" / "import.md").read_text("utf-8")

    folder = RunFolder.open(found.run)
    assert folder.read_reward_function() == other
    settings = read_settings(folder)
    assert (settings.direction, settings.evaluation_trials) == ("reverse", 100)
    assert (settings.start.mode, settings.start.advance, settings.start.offset) == ("advance", 0.1, 0.5)
    assert settings.objects == Objects(
        obstacles=Obstacles(count=2, placement="fixed", positions=((0.23, -1), (0.46, 1)))
    )
    assert settings.randomize == load_randomization("aws")
    rules = json.loads(folder.race_rules.read_text())
    expected = {"laps": 4, "max_resets": 7, "offtrack_penalty": 2.5, "collision_penalty": 4.0, "direction": "forward"}
    assert {name: rules[name] for name in expected} == expected
    params = folder.read_training_params()
    assert params is not None
    assert (params.race_type, params.enable_domain_randomization, params.best_model_metric) == (
        "OBJECT_AVOIDANCE",
        True,
        "reward",
    )
    assert dict(params.extra) == {
        "NUMBER_OF_OBSTACLES": "3",
        "OBJECT_POSITIONS": "0.23,-1;0.46,1",
        "BOT_CAR_SPEED": "0.2",
    }


@pytest.mark.parametrize(
    ("lines", "objects"),
    [
        ("RACE_TYPE: HEAD_TO_BOT\nNUMBER_OF_BOT_CARS: 2\nIS_LANE_CHANGE: true\n", Bots(count=2, changes_lane=True)),
        (
            "RACE_TYPE: OBJECT_AVOIDANCE\nOBJECT_POSITIONS: ['0.2,-1', '0.5,1']\n",
            Obstacles(count=2, placement="fixed", positions=((0.2, -1), (0.5, 1))),
        ),
        ("RACE_TYPE: HEAD_TO_MODEL\nNUMBER_OF_OBSTACLES: 2\n", None),
    ],
)
def test_objects_of_a_console_job(lines: str, objects: Bots | Obstacles | None, tmp_path: Path) -> None:
    files = {**models.MODEL, "training_params.yaml": models.PARAMS + lines}
    found = import_run(models.as_folder(files, tmp_path / "model"))
    settings = read_settings(RunFolder.open(found.run))
    expected = Objects(bots=objects) if isinstance(objects, Bots) else Objects(obstacles=objects)
    assert settings.objects == expected
    assert ("NUMBER_OF_OBSTACLES" in found.unused) == (objects is None)


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("DR_RACE_TYPE=HEAD_TO_BOT\nDR_H2B_NUMBER_OF_BOT_CARS=many\n", "is 'many'; allowed is a whole number"),
        ("DR_RACE_TYPE=OBJECT_AVOIDANCE\nDR_OA_OBJECT_POSITIONS=0.2,inf\n", 'allowed is "fraction,lane'),
    ],
)
def test_a_wrong_setting_of_objects_leaves_no_run(lines: str, says: str, tmp_path: Path) -> None:
    env = f"DR_WORLD_NAME=oval\n{lines}"
    with pytest.raises(ConfigError, match=says):
        import_run(models.as_folder({**models.DRFC, "run.env": env}, tmp_path / "drfc"), name="x")
    assert not Path("runs/x").exists()


def test_settings_lie_above_a_folder_of_custom_files(tmp_path: Path) -> None:
    """As deepracer-on-the-spot keeps several models, with the prefix of one of them in run.env."""
    folder = "custom_files/oval/second"
    files = {
        "run.env": f"DR_WORLD_NAME=oval\nDR_EVAL_NUMBER_OF_TRIALS=7\nDR_LOCAL_S3_CUSTOM_FILES_PREFIX={folder}\n",
        "system.env": "DR_WORKERS=2\n",
        f"{folder}/reward_function.py": models.REWARD,
        f"{folder}/model_metadata.json": models.METADATA,
    }
    found = import_run(models.as_folder(files, tmp_path / "racer"), name="mine")
    assert any("track oval" in value for value in found.used.values())
    assert any("DR_WORKERS" in name for name in found.unused)
    assert not any("No file names a track" in note for note in found.notes)


@pytest.mark.parametrize(
    "named",
    [
        "DR_LOCAL_S3_CUSTOM_FILES_PREFIX=custom_files/oval/second",
        "DR_LOCAL_S3_REWARD_KEY=custom_files/oval/second/reward_function.py\n"
        "DR_LOCAL_S3_MODEL_METADATA_KEY=$DR_LOCAL_S3_CUSTOM_FILES_PREFIX/oval/second/model_metadata.json",
    ],
)
@pytest.mark.parametrize("pack", [models.as_folder, models.as_tar])
def test_of_several_models_run_env_names_the_one_that_is_meant(named: str, pack: Any, tmp_path: Path) -> None:
    files = {"run.env": f"DR_WORLD_NAME=oval\n{named}\n"}
    for place in ("first", "second", "third"):
        files[f"custom_files/oval/{place}/reward_function.py"] = f"# {place}\n{models.REWARD}"
        files[f"custom_files/oval/{place}/model_metadata.json"] = models.METADATA.replace(
            '"speed": 1.0', '"speed": 0.5' if place == "second" else '"speed": 2.0'
        )
    found = import_run(pack(files, tmp_path / "racer.tar"), name="mine")
    folder = RunFolder.open(found.run)
    assert folder.read_reward_function().startswith("# second")
    assert folder.read_model_metadata().action_space.most_speed == 0.5
    assert found.track == "oval"
    with pytest.raises(SourceError, match="holds 3 models: "):
        import_run(pack({**files, "run.env": named.replace("second", "fourth")}, tmp_path / "none.tar"))


def test_the_page_names_every_setting_that_is_known() -> None:
    page = DOCS.read_text(encoding="utf-8")
    table = page[page.index("## Settings of deepracer-for-cloud") :]
    for name in (
        *settings_of_drfc.TRAINING,
        *settings_of_drfc.EVALUATION,
        *settings_of_drfc.FILES,
        *settings_of_drfc.ALIASES,
        *settings_of_drfc.NO_EFFECT,
        settings_of_drfc.MODEL_PREFIX,
        *settings_of_drfc.PRETRAINING,
    ):
        assert f"`{name}`" in table, name
    named = set(re.findall(r"`(DR_[A-Z0-9_*]+)`", table)) - {"DR_OA_*", "DR_H2B_*"}
    for name in named:
        concrete = name.replace("*", "X")
        known = {*settings_of_drfc.TRAINING, *settings_of_drfc.EVALUATION, *settings_of_drfc.FILES}
        known |= settings_of_drfc.OBJECTS.keys()
        known |= {*settings_of_drfc.ALIASES, settings_of_drfc.MODEL_PREFIX, *settings_of_drfc.PRETRAINING}
        assert name in known or settings_of_drfc.meaning(concrete) is not None, name


@pytest.mark.parametrize(
    "name",
    [
        "DR_RACER_NAME",
        "DR_EVAL_DEBUG_REWARD",
        "DR_EVAL_OPP_RACER_NAME",
        "DR_EVAL_RTF",
        "DR_ENABLE_EXTRA_KVS_OVERLAY",
        "DR_LOCAL_SECRET_ACCESS_KEY",
        "DR_MINIO_URL",
        "DR_GAZEBO_ARGS",
    ],
)
def test_what_its_templates_and_scripts_know_is_not_unknown(name: str) -> None:
    found = settings_of_drfc.read_drfc(parse_env(f"{name}=1\n", name="run.env"), name="run.env")
    assert (list(found.without_effect), found.unknown) == ([name], {})


def test_a_trial_that_is_not_continuous_forgives_nothing(tmp_path: Path) -> None:
    env = "DR_WORLD_NAME=oval\nDR_TRAIN_REVERSE_DIRECTION=True\nDR_EVAL_IS_CONTINUOUS=False\nDR_EVAL_MAX_RESETS=9\n"
    found = import_run(models.as_folder({**models.DRFC, "run.env": env}, tmp_path / "drfc"))
    rules = json.loads((found.run / "race_rules.json").read_text())
    assert (rules["is_continuous"], rules["max_resets"], rules["direction"]) == (False, 0, "reverse")
    assert any("DR_EVAL_MAX_RESETS has no effect" in note for note in found.notes)


def test_what_a_job_has_of_the_cloud_is_told_from_what_another_race_would_read(tmp_path: Path) -> None:
    params = "WORLD_NAME: oval\nAWS_REGION: us-east-1\nNUMBER_OF_BOT_CARS: 3\nNUMBER_OF_OBSTACLES: 2\n"
    folder = models.as_folder({**models.MODEL, "training_params.yaml": params}, tmp_path / "m")
    found = import_run(folder, name="x")
    assert found.unused["AWS_REGION"] == "is not read here; kept"
    elsewhere = {found.unused[name] for name in ("NUMBER_OF_BOT_CARS", "NUMBER_OF_OBSTACLES")}
    assert elsewhere == {"has no effect in a race of type TIME_TRIAL; kept"}
    assert RunFolder.open(found.run).read_training_params().extra["AWS_REGION"] == "us-east-1"
