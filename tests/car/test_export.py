"""`racecraft export --to car`: the archive, read without any code of ours, and what is refused."""

from __future__ import annotations

import gzip
import io
import json
import shutil
import sys
import tarfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft import load_track, train
from racecraft.car import export_run
from racecraft.car.export import read_exported
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RunError, SourceError
from racecraft.importing import import_run
from racecraft.learn import PPOConfig
from racecraft.race import RULE_SETS, evaluate, load_driver
from racecraft.race.results import Evaluation
from tensorflow_graphs import parse_graph, run_graph

OUTPUT = "main_level/agent/main/online/network_1/ppo_head_0/policy"
INPUT = "main_level/agent/main/online/network_0/FRONT_FACING_CAMERA/FRONT_FACING_CAMERA"


def trained(root: Path, *, name: str, **options: object) -> Path:
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    settings = {"until": "64 steps", "evaluate_every": 64, "evaluation_trials": 2, "num_threads": 1, **options}
    return train("oval", ppo=ppo, root=root, name=name, **settings).run  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return trained(tmp_path_factory.mktemp("runs"), name="to.floor")


def unpacked(archive: Path) -> dict[str, bytes]:
    with tarfile.open(fileobj=io.BytesIO(gzip.decompress(archive.read_bytes()))) as tar:
        assert all(member.isfile() for member in tar.getmembers())
        return {member.name: tar.extractfile(member).read() for member in tar.getmembers()}  # type: ignore[union-attr]


def test_the_archive_is_what_a_car_takes(run: Path) -> None:
    exported = export_run(run)
    assert exported.file == run / "to-floor.tar.gz"  # the car would cut the name at its dot
    assert exported.size == exported.file.stat().st_size
    told = {"run": str(run), "step": exported.step, "file": str(exported.file), "size": exported.size}
    told |= {"network": exported.network, "notes": list(exported.notes)}
    assert json.loads(json.dumps(exported.to_dict())) == told
    files = unpacked(exported.file)
    assert set(files) == {"model_metadata.json", "agent/model.pb"}
    metadata = json.loads(files["model_metadata.json"])
    assert all({"steering_angle", "speed"} <= set(action) for action in metadata["action_space"])
    assert metadata["sensor"] == ["FRONT_FACING_CAMERA"]
    nodes = parse_graph(files["agent/model.pb"])
    assert set(nodes) - {source for node in nodes.values() for source in node.inputs} == {OUTPUT}
    size = int(np.prod(np.frombuffer(nodes[f"{OUTPUT}_fc/bias"].attributes["value"][8], np.uint8)[:1]))
    assert size > 0


def test_the_same_model_gives_the_same_bytes(run: Path, tmp_path: Path) -> None:
    first, second = (export_run(run, output=tmp_path / name / "model.tar.gz").file for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes()[4:8] == bytes(4)  # gzip's time: two exports of one second hide it


def test_what_is_read_back_has_the_same_weights_to_the_bit(run: Path) -> None:
    ours, theirs = load_driver(run).learner.weights(), read_exported(export_run(run).file).learner.weights()
    names = [name for name in ours if name.startswith("policy.")]
    assert len(names) > 8
    assert all(np.array_equal(ours[name], theirs[name]) for name in names)


@pytest.mark.parametrize("options", [{"actions": "continuous"}, {"sensors": ("STEREO_CAMERAS", "LIDAR")}], ids=str)
def test_other_actions_and_sensors_are_read_back_as_well(options: dict[str, object], tmp_path: Path) -> None:
    run = trained(tmp_path, name="other", **options)
    policy = load_driver(run)
    again = read_exported(export_run(run).file)
    assert again.action_space == policy.action_space
    assert again.sensors.names == policy.sensors.names
    rng = np.random.default_rng(1)
    sight = rng.integers(0, 256, (4, 2 * 120 * 160 + 64) if policy.sensors.lidar_name else (4, 120, 160), np.uint8)
    assert np.array_equal(policy(sight), again(sight))


def test_an_exported_model_can_be_imported(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = import_run(export_run(run, output=tmp_path / "model.tar.gz").file, track="oval", name="again")
    frames = np.random.default_rng(2).integers(0, 256, (8, 120, 160), np.uint8)
    assert np.array_equal(load_driver(found.run)(frames), load_driver(run)(frames))


class GraphDriver:
    """Drives with the file alone: its graph run node by node, its metadata's actions."""

    def __init__(self, archive: Path) -> None:
        files = unpacked(archive)
        self.graph, metadata = files["agent/model.pb"], json.loads(files["model_metadata.json"])
        actions = [(np.radians(action["steering_angle"]), action["speed"]) for action in metadata["action_space"]]
        self.commands = np.array(actions, np.float32)

    def __call__(self, frames: np.ndarray) -> np.ndarray:
        seen = {INPUT: frames[..., None].astype(np.float32)}
        return self.commands[run_graph(self.graph, OUTPUT, seen).argmax(1)]


def driven(policy: object, *, seed: int) -> Evaluation:
    rules = replace(RULE_SETS["drfc"], laps=1, max_resets=3)
    return evaluate(policy, load_track("oval"), rules=rules, num_trials=1, seed=seed)  # type: ignore[arg-type]


def same(one: Evaluation, other: Evaluation) -> bool:
    pairs = zip(one.trials, other.trials, strict=True)
    return all(np.array_equal(a.recording.rows, b.recording.rows, equal_nan=True) for a, b in pairs)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_the_file_alone_drives_the_laps_of_its_run_to_the_bit(seed: int, tmp_path: Path) -> None:
    run = train("oval", until="5 laps", seed=seed, num_threads=1, root=tmp_path, name="lapper").run
    archive = export_run(run).file
    own = driven(load_driver(run), seed=seed)
    assert own.laps_completed == 1
    assert same(driven(GraphDriver(archive), seed=seed), own)
    assert same(driven(read_exported(archive), seed=seed), own)
    assert own.best_lap == driven(GraphDriver(archive), seed=seed).best_lap


@pytest.mark.parametrize(
    ("name", "archive"),
    [("v1.2", "v1-2.tar.gz"), ("alt und größer", "alt-und-gr--er.tar.gz"), ("x" * 70, "x" * 64 + ".tar.gz")],
)
def test_a_run_of_any_name_has_an_archive_that_a_car_takes(run: Path, tmp_path: Path, name: str, archive: str) -> None:
    named = tmp_path / name
    shutil.copytree(run, named)
    assert export_run(named).file == named / archive


def test_the_run_that_somebody_works_in_has_its_folder_s_name(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(run, tmp_path / "mine")
    monkeypatch.chdir(tmp_path / "mine")
    assert export_run(".").file == Path("mine.tar.gz")


WRONG = {
    "another ending": ({"output": "model.zip"}, ConfigError, "takes only names that end in .tar.gz"),
    "a dot": ({"output": "my.model.tar.gz"}, ConfigError, "cuts names at the first dot"),
    "a space": ({"output": "my model.tar.gz"}, ConfigError, "replaces spaces"),
    "no name": ({"output": ".tar.gz"}, ConfigError, "use 1 to 64 letters, digits, - and _"),
    "a long name": ({"output": f"{65 * 'a'}.tar.gz"}, ConfigError, "use 1 to 64 letters, digits, - and _"),
    "a number for a file": ({"output": 5}, ConfigError, "output is 5; use a file's path"),
    "a checkpoint that is not there": ({"checkpoint": 77}, CheckpointError, "77"),
    "another target": ({"to": "bike"}, ConfigError, "--to is 'bike'; allowed are car, onnx, tflite, openvino"),
    "an archive as ONNX": (
        {"to": "onnx", "output": "a.tar.gz"},
        ConfigError,
        "the name of a model for onnx ends in .onnx",
    ),
    "a folder in the way": ({"output": "taken/model.tar.gz"}, RunError, "cannot be written"),
}


@pytest.mark.parametrize(("options", "error", "says"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_written_is_one_sentence(
    options: dict[str, str],
    error: type[Exception],
    says: str,
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("a file")
    before = set(run.iterdir())
    with pytest.raises(error) as caught:
        export_run(run, **options)  # type: ignore[arg-type]
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert set(run.iterdir()) == before
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_run_that_a_car_cannot_sense_leaves_no_file(tmp_path: Path) -> None:
    run = trained(tmp_path, name="sectors", sensors=("FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR"))
    with pytest.raises(ConfigError, match="DISCRETIZED_SECTOR_LIDAR"):
        export_run(run)
    assert not list(run.glob("*.tar.gz"))


def test_what_holds_no_model_of_a_car_is_one_sentence(run: Path, tmp_path: Path) -> None:
    metadata, graph = ("model_metadata.json", b"{}"), ("agent/model.pb", b"x")
    for name, members, says in (
        ("empty-but-for-a-note", [("note.txt", b"hello")], "has no model_metadata.json at its root"),
        ("no-metadata", [graph], "has no model_metadata.json at its root"),
        ("in-a-folder", [(f"mine/{path}", data) for path, data in (metadata, graph)], "has no model_metadata.json"),
        ("no-graph", [metadata], "has no agent/model.pb"),
    ):
        path = tmp_path / f"{name}.tar.gz"
        with tarfile.open(path, "w:gz") as tar:
            for member, data in members:
                info = tarfile.TarInfo(member)
                info.size = len(data)
                tar.addfile(info, io.BytesIO(data))
        with pytest.raises(SourceError) as caught:
            read_exported(path)
        assert f"archive {path.name} {says}" in str(caught.value)
        assert caught.value.hint.startswith("Give an archive that racecraft export wrote; racecraft import reads")
    with pytest.raises(SourceError, match=r"folder .* has no agent/model\.pb"):
        read_exported(run)
    with pytest.raises(ConfigError, match="path is 5; use the path of"):
        read_exported(5)  # type: ignore[arg-type]


@pytest.mark.parametrize("kept", [0, 1, 30, 300, 1000, -1])
def test_a_damaged_archive_is_one_sentence(kept: int, run: Path, tmp_path: Path) -> None:
    data = export_run(run, output=tmp_path / "model.tar.gz").file.read_bytes()
    (tmp_path / "model.tar.gz").write_bytes(data[:kept])
    with pytest.raises(RacecraftError) as caught:
        read_exported(tmp_path / "model.tar.gz")
    assert "\n" not in str(caught.value)


def test_an_onnx_model_lies_beside_the_run_s_files(run: Path) -> None:
    exported = export_run(run, to="onnx")
    assert exported.file == run / "to.floor.onnx"
    assert exported.notes == ()
    assert exported.size == exported.file.stat().st_size > 100_000


@pytest.mark.parametrize(("to", "module"), [("tflite", "tensorflow"), ("openvino", "openvino")])
def test_a_target_whose_library_is_missing_says_what_brings_it(
    to: str, module: str, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    before = set(run.iterdir())
    with pytest.raises(ConfigError, match=f"needs {module}, which is not installed") as caught:
        export_run(run, to=to)
    assert f"pip install {module}" in caught.value.hint
    assert set(run.iterdir()) == before
