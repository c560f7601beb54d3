"""Imports of every kind of model, and of everything that is wrong with one."""

from __future__ import annotations

import json
import os
import re
import tarfile
from pathlib import Path
from typing import Any

import models
import pytest

from racecraft import evaluate, resume
from racecraft.errors import ArchiveError, ConfigError, RacecraftError, RewardError, SourceError
from racecraft.importing import ImportedRun, import_run
from racecraft.importing import drfc as settings_of_drfc
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder
from racecraft.sim import Bots, Objects, Obstacles, load_randomization
from racecraft.track import load_track, save_route
from racecraft.training.start import read_settings

SHARED = Path(__file__).parents[3] / "shared"
DOCS = Path(__file__).parents[2] / "docs" / "import.md"


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a run, but for what names its source and its time."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    files.pop("original/import.json")
    document = json.loads(files.pop("run.json"))
    del document["created"]
    return {**files, "run.json": json.dumps(document).encode()}


def nothing_was_made() -> bool:
    return not Path("runs").exists() or not list(Path("runs").iterdir())


# ---- what is understood


def test_a_virtual_model_gives_the_same_run_from_a_folder_and_from_archives(tmp_path: Path) -> None:
    files = {**models.MODEL, **models.HISTORY, **models.WEIGHTS, "mp4/camera-pip/0-video.mp4": "film"}
    sources = [
        models.as_folder(files, tmp_path / "model"),
        models.as_tar(files, tmp_path / "model.tar.gz"),
        models.as_tar(files, tmp_path / "wrapped.tar", prefix="./my model (1)/"),
        models.as_zip(files, tmp_path / "model.zip", prefix="mine/"),
    ]
    found = [import_run(source, name=f"n{number}") for number, source in enumerate(sources)]
    first = content(found[0].run)
    for result in found:
        assert content(result.run) == first
        assert (result.used, result.unused, result.kept) == (found[0].used, found[0].unused, found[0].kept)
    assert sorted(found[0].kept) == sorted(models.HISTORY)
    for name, text in models.HISTORY.items():
        assert first[f"original/{name}"] == text.encode()
    assert not any(name.endswith((".pb", ".mp4")) or "ckpt" in name for name in first)
    assert any("TensorFlow" in why for why in found[0].unused.values())
    assert "JOB_TYPE" in found[0].unused

    folder = RunFolder.open(found[0].run)
    settings = read_settings(folder)
    assert (settings.track, settings.direction, settings.evaluation_trials) == ("oval", "reverse", 3)
    assert (settings.start.mode, settings.start.offset, settings.start.spread) == ("fixed", 0.25, False)
    assert settings.ppo.episodes_per_iteration == 5
    assert settings.network == "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
    assert folder.read_reward_function() == models.REWARD
    assert folder.read_model_metadata().action_space.size == 3
    params = folder.read_training_params()
    assert params is not None
    assert (params.world_name, params.reverse_dir, params.extra) == ("oval", True, {"JOB_TYPE": "TRAINING"})
    assert not folder.race_rules.exists()


def test_a_drfc_folder(tmp_path: Path) -> None:
    found = import_run(models.as_folder(models.DRFC, tmp_path / "drfc"))
    assert found.run.name.startswith("my-model-")
    assert found.kind == "deepracer-for-cloud folder, folder drfc"
    assert sorted(found.kept) == ["metrics/TrainingMetrics.json", "training-simtrace/0-iteration.csv"]
    assert (found.unknown, found.notes, found.track) == ({}, [], "oval")
    assert {"DR_WORKERS", "DR_DOCKER_STYLE"} <= found.unused.keys()
    report = json.loads((found.run / "original" / "import.json").read_text())
    assert report["used"] == found.used


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
    assert "DR_TRAIN_BEST_MODEL_METRIC=reward" in found.unused

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


def test_a_wrong_setting_of_objects_leaves_no_run(tmp_path: Path) -> None:
    env = "DR_WORLD_NAME=oval\nDR_RACE_TYPE=HEAD_TO_BOT\nDR_H2B_NUMBER_OF_BOT_CARS=many\n"
    with pytest.raises(ConfigError, match="NUMBER_OF_BOT_CARS is 'many'; allowed is a whole number"):
        import_run(models.as_folder({**models.DRFC, "run.env": env}, tmp_path / "drfc"), name="x")
    assert not Path("runs/x").exists()


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
        settings_of_drfc.PRETRAINED,
    ):
        assert f"`{name}`" in table, name
    named = set(re.findall(r"`(DR_[A-Z0-9_*]+)`", table)) - {"DR_OA_*", "DR_H2B_*"}
    for name in named:
        concrete = name.replace("*", "X")
        known = {*settings_of_drfc.TRAINING, *settings_of_drfc.EVALUATION, *settings_of_drfc.FILES}
        known |= settings_of_drfc.OBJECTS.keys()
        known |= {*settings_of_drfc.ALIASES, settings_of_drfc.MODEL_PREFIX, settings_of_drfc.PRETRAINED}
        assert name in known or settings_of_drfc.meaning(concrete) is not None, name


def test_a_trial_that_is_not_continuous_forgives_nothing(tmp_path: Path) -> None:
    env = "DR_WORLD_NAME=oval\nDR_TRAIN_REVERSE_DIRECTION=True\nDR_EVAL_IS_CONTINUOUS=False\nDR_EVAL_MAX_RESETS=9\n"
    found = import_run(models.as_folder({**models.DRFC, "run.env": env}, tmp_path / "drfc"))
    rules = json.loads((found.run / "race_rules.json").read_text())
    assert (rules["is_continuous"], rules["max_resets"], rules["direction"]) == (False, 0, "reverse")
    assert any("DR_EVAL_MAX_RESETS has no effect" in note for note in found.notes)


def test_a_reward_function_alone_and_with_files_beside_it(tmp_path: Path) -> None:
    models.as_folder({"mine.py": models.REWARD, "other.py": "import os"}, tmp_path / "a")
    found = import_run(tmp_path / "a" / "mine.py")
    assert found.run.name.startswith("mine-")
    assert (found.used, found.unused, found.track) == ({"mine.py": "reward_function.py"}, {}, "reinvent_2018")
    assert [("model_metadata" in note, "hyperparameters" in note, "track" in note) for note in found.notes] == [
        (True, False, False),
        (False, True, False),
        (False, False, True),
    ]
    settings = read_settings(RunFolder.open(found.run))
    assert (settings.network, settings.ppo.episodes_per_iteration) == ("RACECRAFT_SMALL", 0)

    models.as_folder(models.MODEL, tmp_path / "b")
    with_files = import_run(tmp_path / "b" / "reward_function.py", network="RACECRAFT_SMALL")
    settings = read_settings(RunFolder.open(with_files.run))
    assert (settings.track, settings.direction, settings.network) == ("oval", "reverse", "RACECRAFT_SMALL")


def test_a_cars_archive_needs_a_reward(tmp_path: Path) -> None:
    car = {"model_metadata.json": models.METADATA, "agent/model.pb": "graph"}
    archive = models.as_tar(car, tmp_path / "model.tar.gz")
    with pytest.raises(SourceError, match=r"has no reward_function\.py") as caught:
        import_run(archive)
    assert "--reward" in caught.value.hint
    assert nothing_was_made()
    found = import_run(archive, reward="centerline", track="oval")
    assert RunFolder.open(found.run).read_model_metadata().action_space.size == 3
    assert found.used["--reward centerline"] == "reward_function.py"


def test_a_download_of_logs_alone(tmp_path: Path) -> None:
    found = import_run(models.as_zip(models.HISTORY, tmp_path / "logs.zip"), reward="centerline", track="oval")
    assert sorted(found.kept) == sorted(models.HISTORY)


def test_options_go_before_files(tmp_path: Path) -> None:
    save_route(load_track("kidney"), tmp_path / "route.npy")
    found = import_run(
        models.as_folder(models.MODEL, tmp_path / "m"), track=str(tmp_path / "route.npy"), reward="centerline"
    )
    assert found.track == "route"
    assert found.unused["reward_function.py"] == "--reward was given"
    assert found.unused["WORLD_NAME: oval"] == "--track was given"
    folder = RunFolder.open(found.run)
    assert (folder.path / "training_params.yaml").read_text().startswith("WORLD_NAME: route\n")
    assert folder.read_reward_function() != models.REWARD


@pytest.mark.parametrize("era", ["drfc", "droa", "console"])
def test_real_files_of_three_eras(era: str, tmp_path: Path) -> None:
    logs = SHARED / "logs" / era
    if not logs.exists():
        pytest.skip("the shared logs are not here")
    texts = {path.name: path.read_text() for path in logs.iterdir()}
    if era == "drfc":
        files = {
            "reward_function.py": models.REWARD,
            "model/model_metadata.json": texts["model_metadata.json"],
            "ip/hyperparameters.json": texts["hyperparameters.json"],
            "metrics/TrainingMetrics.json": texts["TrainingMetrics.json"],
            "metrics/EvaluationMetrics-20220709200242.json": texts["EvaluationMetrics-20220709200242.json"],
            "training-simtrace/0-iteration.csv": texts["training-simtrace-0-iteration.csv"],
            "training-simtrace/20-iteration.csv": texts["training-simtrace-20-iteration.csv"],
            "evaluation-20220709200242/evaluation-simtrace/0-iteration.csv": texts[
                "evaluation-simtrace-0-iteration.csv"
            ],
        }
        left = 0
    elif era == "droa":
        files = {
            **models.MODEL,
            "metrics/training/training-1.json": texts["training-metrics.json"],
            "sim-trace/training/1/training-simtrace/1-iteration.csv": texts["training-simtrace-1-iteration.csv"],
            "sim-trace/evaluation/2/evaluation-simtrace/0-iteration.csv": texts["evaluation-simtrace-0-iteration.csv"],
            "logs/training/1-simulation.log": texts["training-simulation.log"],
            "logs/evaluation/2-simulation.log": texts["evaluation-simulation.log"],
        }
        left = 0
    else:
        files = {**models.MODEL, **{f"logs/{name}": text for name, text in texts.items() if name.endswith(".log")}}
        files |= {f"metrics/{name}": text for name, text in texts.items() if name.endswith(".json")}
        left = 1  # SageMaker's log holds no sim-trace
    found = import_run(models.as_tar(files, tmp_path / "model.tar.gz"), track="oval")
    came_along = [name for name in files if name.startswith(("metrics", "training-s", "evaluation-", "sim-t", "logs"))]
    assert len(found.kept) == len(came_along) - left
    for name in found.kept:
        assert (found.run / "original" / name).read_text() == files[name]
    if era == "console":
        (why,) = [why for what, why in found.unused.items() if what.endswith("sagemaker.log")]
        assert "holds no sim-trace" in why


# ---- and then it can be trained


def test_the_printed_command_trains_and_evaluation_follows_the_rules(tmp_path: Path) -> None:
    env = models.DRFC["run.env"] + "DR_EVAL_NUMBER_OF_TRIALS=1\nDR_EVAL_MAX_RESETS=1\nDR_EVAL_OFF_TRACK_PENALTY=0.5\n"
    files = {name: text for name, text in models.DRFC.items() if "hyperparameters" not in name}
    found = import_run(
        models.as_folder({**files, "run.env": env}, tmp_path / "drfc"), name="mine", network="RACECRAFT_SMALL"
    )
    assert found.next_command == "racecraft train --resume runs/mine"
    result = resume(found.run, until="1 steps")
    assert result.steps > 0
    assert (found.run / "original" / "training-simtrace" / "0-iteration.csv").read_text() == models.simtrace()
    raced = evaluate(found.run, num_trials=1, video=False).evaluation
    assert (raced.rules.laps, raced.rules.max_resets, raced.rules.offtrack_penalty) == (1, 1, 0.5)
    named = evaluate(found.run, rules="droa", laps=1, max_resets=1, num_trials=1, video=False).evaluation
    assert named.rules.offtrack_penalty == 1.0
    (found.run / "race_rules.json").write_text('{"lapps": 3}')
    with pytest.raises(ConfigError, match=r"race_rules\.json: There is no race rule 'lapps'\. Did you mean 'laps'"):
        evaluate(found.run, video=False)


def test_a_model_with_two_lenses_and_a_lidar_is_imported_and_trained(tmp_path: Path) -> None:
    document = {
        **json.loads(models.METADATA),
        "sensor": ["STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"],
        "lidar_config": {"num_sectors": 16, "num_values_per_sector": 4, "clipping_dist": 3.0},
    }
    files = {**models.MODEL, "model_metadata.json": json.dumps(document)}
    found = import_run(models.as_tar(files, tmp_path / "model.tar.gz"), name="mine", network="RACECRAFT_SMALL")
    assert resume(found.run, until="1 steps").steps > 0
    _, policy = load_policy(RunFolder.open(found.run))
    assert (policy.learner.spec.lenses, policy.learner.spec.lidar_size) == (2, 64)


def test_nothing_foreign_runs_while_importing_and_a_bad_reward_stops_the_training_before_it_begins(
    tmp_path: Path,
) -> None:
    trap = tmp_path / "trap"
    reward = f"open({str(trap)!r}, 'w')\nwhile True: pass\n{models.REWARD}"
    with pytest.raises(RewardError, match="not allowed"):  # the check of the text refuses it
        import_run(models.as_folder({**models.MODEL, "reward_function.py": reward}, tmp_path / "a"))
    hanging = f"raise SystemExit\n{models.REWARD}"
    files = {**models.MODEL, "reward_function.py": hanging, "setup.py": f"open({str(trap)!r}, 'w')"}
    found = import_run(models.as_folder(files, tmp_path / "b"), network="RACECRAFT_SMALL", name="x")
    assert "neither run nor kept" in found.unused[f"setup.py ({len(files['setup.py'])} bytes)"]
    with pytest.raises(RewardError):
        resume(found.run, until="1 steps")
    assert not trap.exists()
    assert not (found.run / "checkpoints").exists()


# ---- what is refused


def changed(name: str, text: str) -> dict[str, str]:
    return {**models.MODEL, name: text}


BAD_MODELS: dict[str, tuple[dict[str, str], str]] = {
    "nothing": ({"notes.txt": "hello"}, "nothing that is understood"),
    "broken json": (changed("model_metadata.json", "{"), "model_metadata.json is not valid JSON"),
    "two answers": (changed("hyperparameters.json", '{"lr": 1e-4, "lr": 1e-3}'), "'lr' is given twice"),
    "no actions": (changed("model_metadata.json", "{}"), "action_space is missing"),
    "too fast": (changed("model_metadata.json", models.METADATA.replace("1.0", "40.0")), "0.1 to 4 m/s"),
    "learning rate": (changed("hyperparameters.json", '{"lr": 7}'), "lr is 7"),
    "nan": (changed("hyperparameters.json", '{"lr": NaN}'), "NaN is not a number"),
    "deep": (changed("hyperparameters.json", "[" * 100_000), "nested too deeply"),
    "sac": (
        changed("model_metadata.json", models.METADATA[:-1] + ', "training_algorithm": "sac"}'),
        "sac",
    ),
    "yaml": (changed("training_params.yaml", "WORLD_NAME: [oval"), "training_params.yaml is not valid YAML"),
    "python in yaml": (
        changed("training_params.yaml", "WORLD_NAME: !!python/object/apply:os.system ['true']"),
        "not valid YAML",
    ),
    "bomb in yaml": (changed("training_params.yaml", "a: &a [1]\nb: [*a, *a]"), "YAML alias"),
    "direction": (changed("training_params.yaml", "REVERSE_DIR: perhaps"), "REVERSE_DIR is 'perhaps'"),
    "syntax": (changed("reward_function.py", "def reward_function(params:\n"), "reward_function.py, line 1"),
    "no function": (changed("reward_function.py", "x = 1\n"), "no function 'reward_function'"),
    "wrong key": (changed("reward_function.py", models.REWARD.replace("progress", "progres")), "progres"),
    "huge": (changed("reward_function.py", "#" * 2_000_000), "larger than 1,048,576 bytes"),
    "unknown world": (changed("training_params.yaml", "WORLD_NAME: Spain_track"), "'Spain_track'"),
    "world as a path": (changed("training_params.yaml", "WORLD_NAME: /etc/passwd.npy"), "'/etc/passwd.npy'"),
    "world that climbs": (changed("training_params.yaml", "WORLD_NAME: ../x.csv"), "'../x.csv'"),
    "world from a seed": (changed("training_params.yaml", "WORLD_NAME: 'generated:7'"), "'generated:7'"),
    "two models": ({f"{n}/{name}": text for n in "ab" for name, text in models.MODEL.items()}, "2 models: 'a', 'b'"),
    "setting": (
        {**models.DRFC, "run.env": "DR_TRAIN_REVERSE_DIRECTION=perhaps"},
        "DR_TRAIN_REVERSE_DIRECTION is 'perhaps', allowed: true or false",
    ),
    "penalty": ({**models.DRFC, "run.env": "DR_EVAL_OFF_TRACK_PENALTY=-1"}, "DR_EVAL_OFF_TRACK_PENALTY is '-1'"),
    "env world": ({**models.DRFC, "run.env": "DR_WORLD_NAME=reinvent_base"}, "'reinvent_base'"),
    "binary env": ({**models.DRFC, "run.env": "DR_WORLD_NAME=oval\0"}, "NUL"),
    "missing file": (
        {**models.DRFC, "run.env": "DR_LOCAL_S3_REWARD_KEY=custom_files/mine.py"},
        "names 'mine.py' as the reward_function.py, but custom_files/mine.py is not there",
    ),
}


@pytest.mark.parametrize(("files", "says"), BAD_MODELS.values(), ids=BAD_MODELS)
def test_a_bad_model_is_one_sentence_and_makes_no_run(files: dict[str, str], says: str, tmp_path: Path) -> None:
    for source in (models.as_folder(files, tmp_path / "m"), models.as_tar(files, tmp_path / "m.tar.gz")):
        with pytest.raises(RacecraftError) as caught:
            import_run(source)
        assert says in str(caught.value)
        assert "\n" not in str(caught.value)
        assert "racecraft-import-" not in str(caught.value)  # our own temporary folder
        assert nothing_was_made()


def test_the_hint_for_a_world_that_is_not_here(tmp_path: Path) -> None:
    with pytest.raises(RacecraftError) as caught:
        import_run(models.as_folder({**models.DRFC, "run.env": "DR_WORLD_NAME=reinvent_base"}, tmp_path / "d"))
    assert "--track FILE.npy" in caught.value.hint
    assert "--track reinvent_2018 is much like it" in caught.value.hint


@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("missing", "There is no file or folder"),
        ("a\0b", "There is no file or folder"),
        ("model_metadata.json", "alone is no model"),
        ("notes.txt", "is no archive"),
        ("empty.tar.gz", "is empty"),
        ("pipe", "There is no file or folder"),
    ],
)
def test_paths_that_are_no_models(path: str, says: str, tmp_path: Path) -> None:
    models.as_folder({**models.MODEL, "notes.txt": "hello", "empty.tar.gz": ""}, tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises((SourceError, ArchiveError), match=says):
        import_run(path)
    assert nothing_was_made()


def test_a_hostile_member_refuses_the_whole_archive(tmp_path: Path) -> None:
    archive = models.as_tar(models.MODEL, tmp_path / "model.tar")
    with tarfile.open(archive, "a") as tar:
        link = tarfile.TarInfo("metrics/TrainingMetrics.json")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        tar.addfile(link)
    with pytest.raises(ArchiveError, match="holds a link"):
        import_run(archive)
    assert nothing_was_made()


def test_links_in_a_folder_are_not_followed(tmp_path: Path) -> None:
    folder = models.as_folder(models.MODEL, tmp_path / "model")
    (tmp_path / "secret.json").write_text(models.metrics())
    (folder / "metrics").mkdir()
    (folder / "metrics" / "TrainingMetrics.json").symlink_to(tmp_path / "secret.json")
    (folder / "loop").symlink_to(folder)
    found = import_run(folder)
    assert found.kept == []
    assert found.unused["2 links"] == "links are not followed"


BAD_HISTORY: dict[str, tuple[str, str, str]] = {
    "short row": ("training-simtrace/1-iteration.csv", models.simtrace() + "1,2,3\n", "1 rows are broken"),
    "no number": (
        "training-simtrace/1-iteration.csv",
        models.simtrace().replace("16.8", "long"),
        "are broken|broken rows",
    ),
    "nan": ("training-simtrace/1-iteration.csv", models.simtrace().replace("16.8", "nan", 1), "1 rows are broken"),
    "text": ("training-simtrace/1-iteration.csv", "hello\n" * 100, "holds no sim-trace"),
    "empty": ("training-simtrace/1-iteration.csv", "", "holds no sim-trace"),
    "no metrics": ("metrics/TrainingMetrics.json", "[]", "expected an object"),
    "no trials": ("metrics/TrainingMetrics.json", '{"metrics": [1]}', "no list of trials"),
    "text in metrics": ("metrics/TrainingMetrics.json", models.metrics().replace("100", '"x"'), "is not a number"),
    "infinite": ("metrics/TrainingMetrics.json", models.metrics().replace("100", "1e999"), "too large"),
    "no status": ("metrics/TrainingMetrics.json", models.metrics().replace("episode_status", "x"), "no episode_status"),
    "odd name": ("metrics/Training Metrics $(x).json", models.metrics(), "odd characters"),
    "plain log": ("logs/sagemaker.log", "Policy training> ...\n", "holds no sim-trace"),
}


@pytest.mark.parametrize(("name", "text", "says"), BAD_HISTORY.values(), ids=BAD_HISTORY)
def test_malformed_history_is_left_out_and_named(name: str, text: str, says: str, tmp_path: Path) -> None:
    good = "training-simtrace/0-iteration.csv"
    files = {**models.MODEL, good: models.simtrace(), name: text}
    found = import_run(models.as_folder(files, tmp_path / "m"))
    assert found.kept == [good]
    assert re.search(says, found.unused[name])
    assert not (found.run / "original" / name).exists()
    assert "/tmp" not in found.unused[name]


def test_a_packed_sim_trace_is_not_unpacked(tmp_path: Path) -> None:
    import gzip

    folder = models.as_folder({**models.MODEL, "training-simtrace/0-iteration.csv": ""}, tmp_path / "m")
    (folder / "training-simtrace" / "0-iteration.csv").write_bytes(gzip.compress(bytes(10**6)))
    found = import_run(folder)
    assert "packed once more" in found.unused["training-simtrace/0-iteration.csv"]


def test_a_taken_name_and_a_failure_half_way_leave_the_other_run_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = models.as_folder(models.MODEL, tmp_path / "m")
    first = import_run(folder, name="mine")
    before = content(first.run)
    with pytest.raises(RacecraftError, match="exists"):
        import_run(folder, name="mine")

    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("racecraft.importing.importer.write_run", full)
    with pytest.raises(RacecraftError, match="No space left"):
        import_run(folder, name="other")
    assert content(first.run) == before
    assert [run.name for run in Path("runs").iterdir()] == ["mine"]


def test_a_report_is_plain_json(tmp_path: Path) -> None:
    found: ImportedRun = import_run(models.as_folder(models.DRFC, tmp_path / "d"), name="x")
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert document.keys() == {"run", "kind", "track", "used", "unused", "unknown", "kept", "notes", "next"}
