"""Models that the original trained become runs that drive, and go on learning, like any other."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import models
import numpy as np
import pytest
from aws_models import DEEP, AwsModel
from runs_made import nothing_was_made

from racecraft import evaluate, resume, train
from racecraft.agent import Hyperparameters
from racecraft.errors import ConfigError, SourceError
from racecraft.importing import import_run
from racecraft.importing.model_files import find_models
from racecraft.race import RULE_SETS, load_driver
from racecraft.race import evaluate as drive
from racecraft.run import RunFolder
from racecraft.sim import load_vehicle
from racecraft.track import load_track
from racecraft.training.start import read_settings

SHARED = Path(__file__).parents[3] / "shared"
AWS_MODEL = SHARED / "aws_model"
ROUTES = ("reinvent_base", "reinvent_2018", "reInvent2019_wide", "oval")


@pytest.mark.slow
@pytest.mark.skipif(not AWS_MODEL.is_dir(), reason="the models are not in the repository")
def test_what_aws_trained_drives_twenty_of_twenty_laps_at_first_sight() -> None:
    found = import_run(AWS_MODEL, track="reinvent_2018", name="aws")
    assert found.used["model_48.pb"] == "weights of the policy"
    laps = {}
    for route in ROUTES:
        shared = SHARED / "tracks" / f"{route}.npy"
        raced = evaluate(found.run, track=str(shared if shared.exists() else route), laps=1, num_trials=5, video=False)
        laps[route] = sum(
            len(trial.lap_times) == 1 and not any(lap.off_track_count for lap in trial.laps)
            for trial in raced.evaluation.trials
        )
    assert laps == dict.fromkeys(ROUTES, 5)


BODY = ("front_axle", "front_friction", "front_load", "front_stiffness", "rear_axle", "rear_friction", "rear_stiffness")


@pytest.mark.slow
@pytest.mark.skipif(not AWS_MODEL.is_dir(), reason="the models are not in the repository")
def test_tyres_and_body_decide_whether_the_model_of_version_3_laps() -> None:
    """The drive does not: docs/fidelity.md tells why it loses version 5's car at a third of the lap."""
    found = import_run(AWS_MODEL, track="reinvent_2018", name="aws")
    older, newer = load_vehicle("v4"), load_vehicle("v5")
    turning = (*BODY, "yaw_inertia")
    cars = {
        "v5": newer,
        "v5 that turns like v4": replace(newer, **{name: getattr(older, name) for name in turning}),
        "v4 that turns like v5": replace(older, **{name: getattr(newer, name) for name in turning}),
    }
    policy, rules = load_driver(found.run), replace(RULE_SETS["drfc"], laps=1, is_continuous=False, max_resets=0)
    laps = {}
    for name, car in cars.items():
        trials = drive(policy, load_track("reinvent_2018"), rules=rules, vehicle=car).trials
        laps[name] = sum(trial.status == "lap_complete" for trial in trials)
    assert laps == {"v5": 0, "v5 that turns like v4": 5, "v4 that turns like v5": 0}


def small(actions: int = 3, **changes: str) -> models.Files:
    return {"model_metadata.json": json.dumps(AwsModel(num_actions=actions).metadata()), **changes}


def imported(path: Path, **options: str) -> tuple[str, list[str]]:
    """The file whose weights were taken, and the notes."""
    found = import_run(path, name=f"n{len(list(Path('runs').glob('*')))}", track="oval", **options)
    store = RunFolder.open(found.run).checkpoints
    return (store.load().metadata["origin"]["file"] if store.entries() else "", found.notes)


@pytest.mark.costly
def test_best_last_a_named_one_or_none(tmp_path: Path) -> None:
    index = {"best_checkpoint": {"name": "7_Step-70.ckpt"}, "last_checkpoint": {"name": "9_Step-90.ckpt"}}
    files = {
        **small(),
        "model/deepracer_checkpoints.json": json.dumps(index),
        **{f"model/model_{i}.pb": models.GRAPH for i in (7, 8, 9)},
    }
    folder = models.as_folder(files, tmp_path / "m")
    assert imported(folder)[0] == "model_7.pb"
    assert imported(folder, checkpoint="last")[0] == "model_9.pb"
    for name in ("8", "model_8.pb", "model/model_8.pb", "8_Step-80.ckpt"):
        assert imported(folder, checkpoint=name)[0] == "model_8.pb"
    assert imported(folder, checkpoint="none", reward="centerline")[0] == ""
    with pytest.raises(SourceError, match=r"has no checkpoint '6'; it has model_7\.pb, model_8\.pb, model_9\.pb"):
        imported(folder, checkpoint="6")
    (folder / "model/deepracer_checkpoints.json").unlink()
    (folder / "model/.coach_checkpoint").write_text("8_Step-80.ckpt\n")
    assert imported(folder, checkpoint="last")[0] == "model_8.pb"
    name, notes = imported(folder)
    assert name == "model_8.pb"  # the last, where nothing says which is best
    assert any("model_8.pb was taken of 3 states" in note for note in notes)
    with pytest.raises(SourceError, match="--checkpoint 8 asks for weights, and --network begins with fresh ones"):
        imported(folder, checkpoint="8", network="RACECRAFT_SMALL")


def test_of_two_models_of_one_iteration_the_user_names_one(tmp_path: Path) -> None:
    folders = {f"{place}/model_7.pb": models.GRAPH for place in ("mine", "theirs")}
    folder = models.as_folder({**small(), **folders}, tmp_path / "m")
    for checkpoint in ("best", "last", "7", "model_7.pb"):
        with pytest.raises(SourceError, match=r"holds 2 models of iteration 7: mine/model_7\.pb, theirs/model_7\.pb\."):
            imported(folder, checkpoint=checkpoint)
    found = import_run(folder, checkpoint="mine/model_7.pb")
    assert found.used["mine/model_7.pb"] == "weights of the policy"
    (folder / "theirs/model_7.pb").rename(folder / "theirs/model_8.pb")
    assert import_run(folder, name="by-number", checkpoint=7).used["mine/model_7.pb"] == "weights of the policy"
    with pytest.raises(SourceError, match="has no checkpoint 'bset'") as refused:
        imported(folder, checkpoint="bset")
    assert refused.value.hint == "Did you mean 'best'?"
    for checkpoint in (None, 7.0, Path("model_7.pb")):
        with pytest.raises(ConfigError, match=r"checkpoint is .*; use best, last, none, an iteration or a file's name"):
            import_run(folder, checkpoint=checkpoint)
    for path in (5, None):
        with pytest.raises(ConfigError, match=r"path is .*; use the path of a folder"):
            import_run(path)


def test_a_checkpoint_that_is_named_or_half_there_is_missed(tmp_path: Path) -> None:
    said = "The checkpoint 7_Step-70.ckpt is not whole among the files: it begins with fresh weights."
    base = {**small(), "reward_function.py": models.REWARD}
    best = json.dumps({"best_checkpoint": {"name": "7_Step-70.ckpt"}, "last_checkpoint": {"name": "9_Step-90.ckpt"}})
    for number, partial in enumerate(
        (
            {"model/.coach_checkpoint": "7_Step-70.ckpt"},
            {"model/deepracer_checkpoints.json": best},
            {"model/7_Step-70.ckpt.index": "x", "model/7_Step-70.ckpt.meta": "x"},
        )
    ):
        folder = models.as_folder({**base, **partial}, tmp_path / str(number))
        assert imported(folder)[0] == ""
        assert said in imported(folder)[1]
        assert said not in imported(folder, checkpoint="none")[1]
    assert not any("not whole" in note for note in imported(models.as_folder(base, tmp_path / "plain"))[1])


def test_what_belongs_together_of_the_states_of_a_model() -> None:
    def states(*names: str) -> list[tuple[int, str, str]]:
        return [(model.steps, model.path, model.graph) for model in find_models(names)]

    def pair(name: str) -> tuple[str, str]:
        return f"{name}.index", f"{name}.data-00000-of-00001"

    assert states(*pair("model/8_Step-90.ckpt"), "agent/model_8.pb") == [
        (90, "model/8_Step-90.ckpt", "agent/model_8.pb")
    ]
    index, data = pair("8_Step-90.ckpt")
    assert states(f"a/{index}", f"b/{data}") == states(index, pair("8_Step-95.ckpt")[1]) == []  # halves of two
    assert states(*pair("8_Step-90.ckpt"), *pair("8_Step-95.ckpt"), "model_8.pb") == [
        (90, "8_Step-90.ckpt", ""),
        (95, "8_Step-95.ckpt", "model_8.pb"),
    ]
    assert states(*pair("a/8_Step-90.ckpt"), "a/model_8.pb", "b/model_8.pb") == [
        (-1, "b/model_8.pb", "b/model_8.pb"),
        (90, "a/8_Step-90.ckpt", "a/model_8.pb"),
    ]


def test_who_imports_in_the_models_folder_imports_the_model_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {**small(), "model_7.pb": models.GRAPH, "metrics/TrainingMetrics.json": models.metrics()}
    monkeypatch.chdir(models.as_folder(files, tmp_path / "m"))
    found = [import_run(".", name=name) for name in ("first", "second", "third")]
    assert [one.used for one in found] == [found[0].used] * 3
    assert [one.kept for one in found] == [["metrics/TrainingMetrics.json"]] * 3
    assert "weights of the policy" in found[2].used.values()
    assert found[2].unused["runs/first/ and 1 more"] == "runs of Racecraft's own"
    again = import_run(found[2].run, name="again")  # a run by itself is one
    assert again.kind.startswith("archive of Racecraft")
    with pytest.raises(SourceError, match="4 models"):
        import_run("runs")


def test_weights_of_which_nobody_knows_what_they_answer(tmp_path: Path) -> None:
    folder = models.as_folder({"reward_function.py": models.REWARD, "model_7.pb": models.GRAPH}, tmp_path / "m")
    name, notes = imported(folder)
    assert name == ""
    assert "model_7.pb was left out: without a model_metadata.json nobody knows what it answers." in notes
    assert not any("model_7" in note for note in imported(folder, checkpoint="none")[1])
    with pytest.raises(SourceError, match=r"has no model_metadata\.json"):
        imported(folder, checkpoint="7")
    (folder / "reward_function.py").unlink()
    with pytest.raises(SourceError, match=r"has model_7\.pb, but no model_metadata\.json, .* and no") as told:
        imported(folder)
    assert "Put the model's own model_metadata.json beside it." in told.value.hint


def test_settings_that_lie_elsewhere_are_not_left_out_in_silence(tmp_path: Path) -> None:
    files = {"reward/reward_function.py": models.REWARD, "meta/model_metadata.json": models.METADATA}
    notes = imported(models.as_folder(files, tmp_path / "m"))[1]
    assert "meta/model_metadata.json was left out: the model's own would lie in reward/." in notes
    files = {"reward_function.py": models.REWARD, "hp/hyperparameters.json": models.HYPERPARAMETERS}
    notes = imported(models.as_folder(files, tmp_path / "n"))[1]
    assert "hp/hyperparameters.json was left out: the model's own would lie in the outermost folder." in notes
    files = {**models.DRFC, "defaults/hyperparameters.json": "{}"}
    del files["custom_files/hyperparameters.json"]
    assert not any("defaults/" in note for note in imported(models.as_folder(files, tmp_path / "o"))[1])


def test_what_is_said_of_weights_that_do_not_fit(tmp_path: Path) -> None:
    folder = models.as_folder({**small(4), "model_7.pb": models.GRAPH}, tmp_path / "m")
    with pytest.raises(SourceError, match=r"chooses from 3 actions, and model_metadata\.json lists 4") as told:
        imported(folder)
    assert "Is this the model_metadata.json that it was trained with?" in told.value.hint
    broken = {f"model/7_Step-70.ckpt.{end}": "x" for end in ("index", "data-00000-of-00001")}
    folder = models.as_folder({**small(), **broken, "model/model_7.pb": models.GRAPH}, tmp_path / "n")
    with pytest.raises(SourceError, match="7_Step-70") as told:
        imported(folder)
    assert "With --checkpoint model/model_7.pb it begins with those of its graph." in told.value.hint
    assert imported(folder, checkpoint="model/model_7.pb")[0] == "model_7.pb"


def test_a_model_drives_with_the_actions_that_it_learned_with(tmp_path: Path) -> None:
    bucket = "data/minio/bucket/my-model/model"
    faster = AwsModel(num_actions=3).metadata()
    for action in faster["action_space"]:
        action["speed"] = 2.0
    files = {
        **models.DRFC,
        "custom_files/model_metadata.json": json.dumps(faster),  # of the next model
        f"{bucket}/model_metadata.json": json.dumps(AwsModel(num_actions=3).metadata()),
    }
    folder = models.as_folder(files, tmp_path / "m")
    for options, speed in (({}, 1.0), ({"checkpoint": "none"}, 2.0)):
        found = import_run(folder, name=f"at-{speed:g}", **options)
        space = RunFolder.open(found.run).read_model_metadata().action_space
        assert {action["speed"] for action in space.to_aws()} == {speed}
        told = [note for note in found.notes if "custom_files/model_metadata.json has changed since" in note]
        assert len(told) == (speed == 1.0)


@pytest.mark.parametrize("damage", ["{", "[]", '{"best_checkpoint": 7}', '{"best_checkpoint": {"name": "../../etc"}}'])
def test_an_index_that_says_nothing_is_no_hindrance(damage: str, tmp_path: Path) -> None:
    files = {**small(), "model/deepracer_checkpoints.json": damage, "model/model_7.pb": models.GRAPH}
    assert imported(models.as_folder(files, tmp_path / "m"))[0] == "model_7.pb"


@pytest.mark.costly
def test_a_car_s_archive_and_every_place_of_a_graph(tmp_path: Path) -> None:
    odd = ("agent/best lap.pb", "model (1).pb", "agent/modéle.pb")
    for place in ("agent/model.pb", "model.pb", "model/model_3.pb", "output/frozen.pb", *odd):
        files = {**small(), place: models.GRAPH, "worker_0.multi_agent_graph_0.json": "{}"}
        for source in (
            models.as_tar(files, tmp_path / f"{len(place)}.tar.gz"),
            models.as_zip(files, tmp_path / f"{len(place)}.zip", prefix="wrapped/"),
        ):
            assert imported(source)[0] == place.rpartition("/")[2]
    two = models.as_folder({**small(), "a.pb": models.GRAPH, "b.pb": models.GRAPH}, tmp_path / "two")
    with pytest.raises(SourceError, match=r"holds 2 graphs: a\.pb, b\.pb") as caught:
        imported(two)
    assert "--checkpoint FILE" in caught.value.hint
    assert imported(two, checkpoint="b.pb")[0] == "b.pb"


def test_a_trained_model_without_hyperparameters_goes_on_with_awss(tmp_path: Path) -> None:
    files = {name: text for name, text in small().items() if "hyperparameters" not in name}
    trained = import_run(models.as_tar({**files, "model.pb": models.GRAPH}, tmp_path / "car.tar.gz"), name="trained")
    assert "There is no hyperparameters.json: it goes on with AWS's defaults." in trained.notes
    folder = RunFolder.open(trained.run)
    assert folder.read_hyperparameters() == Hyperparameters()
    assert read_settings(folder).ppo.learning_rate == 3e-4
    fresh = import_run(models.as_tar(files, tmp_path / "new.tar.gz"), name="fresh", reward="centerline")
    assert "There is no hyperparameters.json: it trains with Racecraft's own settings." in fresh.notes


@pytest.mark.costly
def test_the_weights_of_the_pretrained_model_until_there_are_own_ones(tmp_path: Path) -> None:
    env = "DR_WORLD_NAME=oval\nDR_LOCAL_S3_MODEL_PREFIX=my-model\nDR_LOCAL_S3_PRETRAINED=True\n"
    env += "DR_LOCAL_S3_PRETRAINED_PREFIX=older\n"
    files = {**models.DRFC, "run.env": env, "data/minio/bucket/older/model/model_4.pb": models.GRAPH}
    assert imported(models.as_folder(files, tmp_path / "a"))[0] == "model_1.pb"
    del files["data/minio/bucket/my-model/model/model_1.pb"]
    name, notes = imported(models.as_folder(files, tmp_path / "b"))
    assert name == "model_4.pb"
    assert any("the weights of 'older'; it begins with the last ones" in note for note in notes)
    found = import_run(tmp_path / "b", name="told", checkpoint="4")
    assert any("the weights of 'older'; it begins with those of 4." in note for note in found.notes)
    for setting in ("DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED_PREFIX=older"):
        assert found.used[setting] == "weights to begin with"
        assert setting not in found.unused
    fresh = import_run(tmp_path / "b", name="fresh", checkpoint="none")
    assert not any("it begins with" in note for note in fresh.notes)
    assert "DR_LOCAL_S3_PRETRAINED=True" in fresh.unused
    del files["data/minio/bucket/older/model/model_4.pb"]
    name, notes = imported(models.as_folder(files, tmp_path / "c"))
    assert name == ""
    assert any("it begins with fresh ones" in note for note in notes)


@pytest.mark.costly
def test_a_checkpoint_goes_on_learning_where_it_stopped(tmp_path: Path) -> None:
    model = AwsModel(DEEP, kind="continuous")
    model.write(tmp_path / "m", graph="model/model_8.pb", checkpoint="model/8_Step-100.ckpt")
    settings = {"lr": 1e-8, "num_episodes_between_training": 1, "num_epochs": 3, "batch_size": 64}
    (tmp_path / "m" / "hyperparameters.json").write_text(json.dumps(settings))
    found = import_run(tmp_path / "m", name="mine", track="oval", reward="centerline")
    assert "weights of the policy and the critic" in found.used.values()
    folder = RunFolder.open(found.run)
    assert read_settings(folder).critic == "camera"
    begin = folder.checkpoints.load()
    assert begin.metadata["origin"] == {"file": "8_Step-100.ckpt", "iteration": 8, "steps": 100}
    assert begin.arrays["weights/policy.log_std"].tolist() == [-0.5, 0.25]
    assert resume(found.run, until="1 steps").steps > 0
    after = folder.checkpoints.load()
    assert after.step > 0
    first, *_ = entries = folder.checkpoints.entries()  # judged before its first update, and the same
    assert [entry.step for entry in entries] == [0, after.step]
    assert first.score is not None
    assert first.metrics["completion"] == first.score[0]
    judged = folder.checkpoints.load(0)
    assert judged.metadata["origin"] == begin.metadata["origin"]
    for name, array in begin.arrays.items():
        np.testing.assert_array_equal(judged.arrays[name], array, err_msg=name)
    learned = [name for name in begin.arrays if not np.array_equal(after.arrays[name], begin.arrays[name])]
    assert learned  # it did learn
    for name, array in begin.arrays.items():
        assert np.abs(after.arrays[name] - array).max() < 1e-4, name
    assert resume(found.run, until="1 steps").steps >= after.step  # and resumes as any run does


@pytest.mark.costly
def test_another_run_begins_from_it(tmp_path: Path) -> None:
    model = AwsModel(DEEP)
    model.write(tmp_path / "m", graph="agent/model.pb")
    found = import_run(tmp_path / "m", name="aws", track="oval")
    theirs = RunFolder.open(found.run).checkpoints.load()
    child = train("oval", reward="centerline", parent=str(found.run), until="1 steps", name="child", num_envs=2)
    ours = RunFolder.open(child.run).parent_checkpoint.load()
    for name, array in theirs.arrays.items():
        assert np.array_equal(ours.arrays[name], array)
    assert load_driver(found.run).learner.spec.name == DEEP
    assert not RunFolder.open(found.run).read_info().foreign  # there was no reward function, so it has one of ours


def test_settings_of_its_own_make_no_use_of_weights(tmp_path: Path) -> None:
    folder = models.as_folder({**small(), "reward_function.py": models.REWARD, "model.pb": b"nonsense"}, tmp_path / "m")
    with pytest.raises(SourceError, match=r"model\.pb is damaged") as caught:
        imported(folder)
    assert "--checkpoint none" in caught.value.hint
    assert nothing_was_made()
    assert imported(folder, checkpoint="none")[0] == ""
    assert imported(folder, network="RACECRAFT_SMALL")[0] == ""
    with pytest.raises(SourceError, match="alone is no model"):
        import_run(folder / "model.pb")
