"""Imports of every kind of model: folders, archives, downloads, files of three eras."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import models
import pytest
from runs_made import content, nothing_was_made

from racecraft.errors import RacecraftError, SourceError
from racecraft.importing import ImportedRun, import_run
from racecraft.run import RunFolder
from racecraft.track import load_track, save_route
from racecraft.training.start import read_settings

SHARED = Path(__file__).parents[3] / "shared"


@pytest.mark.costly
def test_a_virtual_model_gives_the_same_run_from_a_folder_and_from_archives(tmp_path: Path) -> None:
    files = {
        **models.MODEL,
        **models.HISTORY,
        **models.WEIGHTS,
        "mp4/camera-pip/0-video.mp4": "film",
        "notes.txt": "mine",
    }
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
    assert found[0].used["model/model_8.pb"] == "weights of the policy"
    assert any("TensorFlow" in why for why in found[0].unused.values())
    assert found[0].unused["notes.txt (4 bytes)"] == "nothing that is read"
    assert "JOB_TYPE" in found[0].unused
    job = [label for label in found[0].used if ": " in label and not label.startswith("WORLD_NAME")]
    assert job == sorted(job)  # not as chance has it
    assert len(job) == 4

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
    assert (found.unknown, found.track) == ({}, "oval")
    assert found.used["model/model_1.pb"] == "weights of the policy"
    assert found.used["DR_LOCAL_S3_MODEL_PREFIX=my-model"].startswith("name of the run")
    assert [note[:26] for note in found.notes] == ["The model's critic is not "]
    assert {"DR_WORKERS", "DR_DOCKER_STYLE"} <= found.unused.keys()
    report = json.loads((found.run / "original" / "import.json").read_text())
    assert report["used"] == found.used


@pytest.mark.parametrize("pack", [models.as_folder, models.as_tar])
def test_files_that_run_env_names_may_lie_in_folders_of_custom_files(tmp_path: Path, pack: Any) -> None:
    keys = {
        "REWARD": "$DR_LOCAL_S3_CUSTOM_FILES_PREFIX/rewards/fast.py",
        "MODEL_METADATA": "custom_files/cars/slow.json",
        "HYPERPARAMETERS": "my-prefix/of-mine/ppo.json",
    }
    env = "".join(f"DR_LOCAL_S3_{name}_KEY={key}\n" for name, key in keys.items())
    slow = models.METADATA.replace('"speed": 1.0', '"speed": 0.5')
    named = {
        "run.env": f"{models.DRFC['run.env']}{env}",
        "custom_files/rewards/fast.py": f"# fast\n{models.REWARD}",
        "custom_files/cars/slow.json": slow,
        "custom_files/ppo.json": models.HYPERPARAMETERS.replace("64", "32"),
    }
    own = {name: text for name, text in models.DRFC.items() if not name.startswith("data/")}
    found = import_run(pack({**own, **named}, tmp_path / "drfc.tar"), name="named")
    folder = RunFolder.open(found.run)
    assert folder.read_reward_function().startswith("# fast")
    assert folder.read_model_metadata().action_space.most_speed == 0.5
    parameters = folder.read_hyperparameters()
    assert parameters is not None
    assert parameters.batch_size == 32
    assert found.used[f"DR_LOCAL_S3_REWARD_KEY={keys['REWARD']}"] == "custom_files/rewards/fast.py"
    assert found.used[f"DR_LOCAL_S3_HYPERPARAMETERS_KEY={keys['HYPERPARAMETERS']}"] == "custom_files/ppo.json"


def test_an_experiment_has_its_model_where_all_others_have_theirs(tmp_path: Path) -> None:
    of_all = ("data/", "system.env")
    files = {name if name.startswith(of_all) else f"experiments/e-1/{name}": text for name, text in models.DRFC.items()}
    folder = models.as_folder(files, tmp_path / "drfc")
    plain = import_run(models.as_folder(models.DRFC, tmp_path / "plain"), name="plain")
    found = import_run(folder / "experiments" / "e-1", name="e-1")
    assert found.used["model/model_1.pb"] == "weights of the policy"
    assert found.kept == plain.kept
    with pytest.raises(SourceError, match=r"has no reward_function\.py of its own, but experiments") as caught:
        import_run(folder)
    assert "experiments/" in caught.value.hint
    (folder / "system.env").unlink()
    alone = import_run(folder, name="alone")
    assert (alone.used["model/model_1.pb"], alone.kept) == ("weights of the policy", plain.kept)


def test_a_bucket_is_its_model_and_not_what_trains_next(tmp_path: Path) -> None:
    """As 'aws s3 sync' copies it: the weights must not be lost beside custom_files."""
    model = {f"my-model/{name}": text for name, text in {**models.MODEL, **models.WEIGHTS}.items()}
    bucket = models.as_folder({**model, "custom_files/reward_function.py": "other = 1\n"}, tmp_path / "bucket")
    found = import_run(bucket, name="of-bucket")
    assert found.track == "oval"
    assert found.used["model/model_8.pb"] == "weights of the policy"
    assert RunFolder.open(found.run).read_reward_function() == models.REWARD
    assert any(note.startswith("custom_files/ was left out") for note in found.notes)
    assert not any("custom_files" in note for note in import_run(bucket / "my-model", name="alone").notes)
    models.as_folder({name.replace("my", "your"): text for name, text in model.items()}, bucket)
    with pytest.raises(SourceError, match="holds 2 models: 'my-model', 'your-model'"):
        import_run(bucket, name="two")
    kept = {f"old/{name}": text for name, text in models.MODEL.items() if name != "training_params.yaml"}
    drafts = models.as_folder({**kept, "custom_files/reward_function.py": models.REWARD}, tmp_path / "drafts")
    assert "custom_files/reward_function.py" in import_run(drafts, name="drafts").used


def test_what_only_awss_console_refused_comes_along_with_a_note(tmp_path: Path) -> None:
    limits = {"steering_angle": {"low": -20, "high": 20}, "speed": {"low": 1, "high": 2}}
    wide = {"num_epochs": 2, "batch_size": 1024, "lr": 0.01, "loss_type": "Huber", "exploration_type": "e-greedy"}
    changed = {
        "model_metadata.json": json.dumps({**json.loads(models.METADATA), "action_space": limits}),
        "hyperparameters.json": json.dumps({**wide, "num_episodes_between_training": 200}),
    }
    found = import_run(models.as_folder({**models.MODEL, **changed}, tmp_path / "m"), network="RACECRAFT_SMALL")
    told = [note.split(", and")[0].split(" has")[0] for note in found.notes if "hyperp" in note or "e-greedy" in note]
    assert told == [
        "hyperparameters.json: batch_size is 1024",
        "hyperparameters.json: num_epochs is 2",
        "hyperparameters.json: lr is 0.01",
        "hyperparameters.json: num_episodes_between_training is 200",
        "exploration_type 'e-greedy'",
    ]
    ppo = read_settings(RunFolder.open(found.run)).ppo
    assert (ppo.update_epochs, ppo.minibatch_size, ppo.learning_rate, ppo.value_loss) == (2, 1024, 0.01, "huber")
    assert (ppo.episodes_per_iteration, ppo.num_envs, ppo.exploration) == (200, 64, "categorical")


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


def test_a_reward_function_is_read_in_the_encoding_that_it_says(tmp_path: Path) -> None:
    folder = models.as_folder(models.MODEL, tmp_path / "a")
    file = folder / "reward_function.py"
    file.write_bytes(f"# Größe\n{models.REWARD}".encode("latin-1"))
    with pytest.raises(RacecraftError, match=r"^reward_function\.py is not UTF-8 text: byte 4 is 0xf6"):
        import_run(folder)
    assert nothing_was_made()
    file.write_bytes(f"# coding: latin-1, Größe\n{models.REWARD}".encode("latin-1"))
    found = import_run(folder)
    assert RunFolder.open(found.run).read_reward_function() == f"# coding: utf-8, Größe\n{models.REWARD}"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_settings_are_read_as_a_windows_shell_wrote_them(tmp_path: Path, encoding: str) -> None:
    """Its > writes UTF-16, and Notepad a mark before UTF-8."""
    files = {name: text.encode(encoding) for name, text in models.MODEL.items()}
    found = import_run(models.as_folder(files, tmp_path / "car"), name="car")
    assert found.track == "oval"
    assert found.used["model_metadata.json"].startswith("3 actions")
    (tmp_path / "car" / "model_metadata.json").write_bytes(models.METADATA.encode("utf-16") + b"x")
    with pytest.raises(RacecraftError, match=r"^model_metadata\.json is not UTF-8 text: byte 0 is 0xff"):
        import_run(tmp_path / "car", name="cut")


def test_a_model_without_weights_needs_a_reward(tmp_path: Path) -> None:
    archive = models.as_tar({"model_metadata.json": models.METADATA}, tmp_path / "model.tar.gz")
    with pytest.raises(SourceError, match=r"has no reward_function\.py") as caught:
        import_run(archive)
    assert "--reward" in caught.value.hint
    assert nothing_was_made()
    found = import_run(archive, reward="centerline", track="oval")
    assert RunFolder.open(found.run).read_model_metadata().action_space.size == 3
    assert found.used["--reward centerline"] == "reward_function.py"


def test_a_packed_log_is_no_archive_inside(tmp_path: Path) -> None:
    files = {**models.MODEL, "logs/a.csv.gz": b"\x1f\x8b", "logs/b.tar.gz": b"\x1f\x8b"}
    found = import_run(models.as_folder(files, tmp_path / "m"))
    assert found.unused["logs/a.csv.gz (2 bytes)"] == "nothing that is read"
    assert found.unused["logs/b.tar.gz (2 bytes)"] == "archives inside are not opened; import one by itself"


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


def test_names_that_are_no_text_are_told_as_some(tmp_path: Path) -> None:
    folder = models.as_folder({**models.MODEL, "training-simtrace/0-iteration.csv": models.simtrace()}, tmp_path / "m")
    for name in (b"m\xe4.txt", b"training-simtrace/\xff-iteration.csv", b"\xe4.mp4"):
        with open(os.path.join(os.fsencode(folder), name), "wb") as file:
            file.write(b"x")
    found = import_run(folder, name="x")
    document = json.loads(json.dumps(found.to_dict(), ensure_ascii=False).encode())
    assert document["unused"]["m\ufffd.txt (1 bytes)"] == "nothing that is read"
    assert "training-simtrace/\ufffd-iteration.csv" in document["unused"]
    kept = json.loads((found.run / "original" / "import.json").read_text())
    assert kept["unused"] == document["unused"]


def test_a_report_is_plain_json(tmp_path: Path) -> None:
    found: ImportedRun = import_run(models.as_folder(models.DRFC, tmp_path / "d"), name="x")
    document = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert document.keys() == {"run", "kind", "track", "used", "unused", "unknown", "kept", "kept_in", "notes", "next"}
