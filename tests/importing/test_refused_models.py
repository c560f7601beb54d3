"""Everything that is wrong with a model, or hostile in it: one sentence, and no run is made."""

from __future__ import annotations

import errno
import os
import tarfile
from pathlib import Path

import models
import pytest
from runs_made import nothing_was_made

from racecraft.errors import ArchiveError, RacecraftError, SourceError
from racecraft.importing import import_run, importer


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
        "YAML tag",
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
        "DR_TRAIN_REVERSE_DIRECTION is 'perhaps'; allowed is true or false",
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


def test_the_hint_for_a_file_of_another_name(tmp_path: Path) -> None:
    files = {**models.DRFC, "run.env": "DR_LOCAL_S3_REWARD_KEY=custom_files/reward_v2.py"}
    files["custom_files/reward_v3.py"] = models.REWARD
    with pytest.raises(SourceError, match=r"custom_files/reward_v2\.py is not there") as caught:
        import_run(models.as_folder(files, tmp_path / "m"))
    assert caught.value.hint == "Did you mean 'custom_files/reward_v3.py'?"


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("Reward_Function.py", "reward_function.py"),
        ("my model/reward_function (1).py", "reward_function.py"),
        ("reward_function - Copy.py", "reward_function.py"),
        ("reward_function.py.txt", "reward_function.py"),
        ("reward.py", "reward_function.py"),
        ("MODEL_METADATA.JSON", "model_metadata.json"),
    ],
)
def test_the_hint_for_a_file_that_a_copy_or_an_editor_called_otherwise(name: str, meant: str, tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="nothing that is understood") as caught:
        import_run(models.as_folder({name: models.REWARD, "notes.txt": "mine"}, tmp_path / "m"))
    assert caught.value.hint == f"Is {name!r} meant? Call it {meant}."
    if meant == "reward_function.py":
        with pytest.raises(SourceError, match=r"has no reward_function\.py") as caught:
            import_run(models.as_folder({name: models.REWARD, "model_metadata.json": models.METADATA}, tmp_path / "n"))
        assert caught.value.hint == f"Is {name!r} meant? Call it {meant}."


def test_a_file_that_goes_meanwhile_is_told_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = str(tmp_path / "m" / "checkpoints" / "1.safetensors")

    def keep(*_: object) -> None:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), gone)

    monkeypatch.setattr(importer, "keep_history", keep)
    with pytest.raises(SourceError) as caught:
        import_run(models.as_folder(models.MODEL, tmp_path / "m"))
    assert str(caught.value) == f"{gone} went while it was imported."
    assert nothing_was_made()


def test_the_hint_for_an_archive_inside(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="nothing that is understood") as caught:
        import_run(models.as_folder({"down/model.tar.gz": "packed", "notes.txt": "mine"}, tmp_path / "m"))
    assert caught.value.hint == "It holds an archive, 'down/model.tar.gz': unpack it and import that."


def test_settings_that_are_called_otherwise_are_told(tmp_path: Path) -> None:
    files = {"reward_function.py": models.REWARD, "hyperparameters (1).json": "{}", "notes.txt": "mine"}
    found = import_run(models.as_folder(files, tmp_path / "m"), track="oval")
    assert found.unused == {
        "hyperparameters (1).json (2 bytes)": "the original's file has another name: give it that if it is to be read",
        "notes.txt (4 bytes)": "nothing that is read",
    }


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


@pytest.mark.parametrize("name", ["0-iteration.csv", "robo maker.log", "console.csv.gz"])
def test_logs_alone_are_for_another_verb(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"\x1f\x8b")
    with pytest.raises(SourceError, match="alone is no model") as caught:
        import_run(name)
    typed = f"'{name}'" if " " in name else name
    assert caught.value.hint.endswith(f"or hold it against the simulator: racecraft replay {typed}")


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
