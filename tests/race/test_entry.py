"""What an entrant's files decide of a race: how its car drives, and nothing else, whatever they say."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load

from racecraft import train
from racecraft.agent import ModelMetadata
from racecraft.errors import CheckpointError, ConfigError, NonFiniteAction, RacecraftError
from racecraft.judging.ladder import rate_models
from racecraft.judging.race import race_models
from racecraft.learn import NetworkSpec, PPOConfig
from racecraft.race.conditions import STANDARD_CAR
from racecraft.race.entry import load_entries, load_entry
from racecraft.race.entry_file import _digest, pack_entry, read_entry_file
from racecraft.replay import read_replay
from racecraft.run import CheckpointStore, RunFolder
from racecraft.run.checkpoint import HEADER_KEY, header_of
from racecraft.run.tensor_file import tensor_file
from racecraft.sim import MAX_STEERING, Simulation, Start
from racecraft.sim.camera import CameraSpec
from racecraft.sim.vehicle import PRESETS
from racecraft.track import load_track

SOON = {"max_resets": 1, "time_limit": 6.0}
Arrays = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    root = tmp_path_factory.mktemp("runs")
    return train("oval", ppo=ppo, until="64 steps", evaluation_trials=1, num_threads=1, name="honest", root=root).run


@pytest.fixture
def run(honest: Path, tmp_path: Path) -> Path:
    """A copy for an entrant to edit."""
    return Path(shutil.copytree(honest, tmp_path / "runs" / "cheat"))


def edit(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def resave(run: Path, change: Callable[[Arrays, dict[str, Any]], object]) -> None:
    """Other arrays or another description in the checkpoint, with checksums that fit."""
    store = CheckpointStore(run / "checkpoints")
    saved = store.load("best")
    change(saved.arrays, saved.metadata)
    shutil.rmtree(store.folder)
    store.save(saved.step, saved.arrays, metadata=saved.metadata)


def driven(run: Path, root: Path, **settings: Any) -> Any:
    given = {"track": "oval", "laps": 1, "changes": SOON, "video": False, "num_threads": 1, **settings}
    return race_models([run], root=root, **given)


# ---- what run.json says of the car, the road and the race


def test_the_car_in_the_entrants_run_json_is_not_driven(honest: Path, run: Path, tmp_path: Path) -> None:
    def tune(document: dict[str, Any]) -> None:
        settings = document["settings"]
        settings["vehicle"] |= {"front_friction": 1.9, "rear_friction": 1.9, "speed_gain": 1.5}
        settings["randomize"] = "none"
        settings["objects"] = {"obstacles": {"count": 1}}
        settings["camera"] = {"horizontal_fov": 2.8}

    edit(run / "run.json", tune)
    (run / "race_rules.json").write_text(json.dumps({"offtrack_penalty": 0.0, "laps": 1}))
    fair, edited = (driven(path, tmp_path / "races") for path in (honest, run))
    assert edited.contest.conditions.vehicle == PRESETS["v5"] == PRESETS[STANDARD_CAR]
    assert edited.contest.conditions.rules.offtrack_penalty == 5.0
    assert edited.contest.conditions.num_objects == 0
    assert fair.contest.standings == edited.contest.standings
    (path,) = edited.folder.glob("*.replay")
    assert read_replay(path).conditions.vehicle == PRESETS["v5"]
    ladders = [
        rate_models([path, path], tracks=["oval"], starts=1, changes=SOON, num_threads=1) for path in (honest, run)
    ]
    assert ladders[0].matches == ladders[1].matches


def test_a_run_json_that_is_no_run_changes_nothing_either(honest: Path, run: Path) -> None:
    edit(run / "run.json", lambda document: document.update(settings={"vehicle": {"wings": 2}}, track="nowhere"))
    frames = np.random.default_rng(1).integers(0, 256, (4, 120, 160), dtype=np.uint8)
    assert np.array_equal(load_entry(run).policy(frames), load_entry(honest).policy(frames))


@pytest.mark.parametrize("num_threads", [None, -1, 1.5, "2"])
def test_a_number_of_threads_that_is_none_is_told(honest: Path, num_threads: Any) -> None:
    with pytest.raises(ConfigError, match="num_threads is"):
        load_entry(honest, num_threads=num_threads)


def test_the_command_line_names_the_same_car_as_the_library() -> None:
    import inspect

    from racecraft.cli.races import ladder, race

    for verb in (race, ladder):
        assert inspect.signature(verb).parameters["vehicle"].default == STANDARD_CAR


# ---- model_metadata.json


def metadata(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    return lambda run: edit(run / "model_metadata.json", change)


def actions(*pairs: tuple[Any, Any]) -> list[dict[str, Any]]:
    return [{"steering_angle": angle, "speed": speed} for angle, speed in pairs]


LIMITS = {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 0.5, "high": 8}}


@pytest.mark.parametrize(
    "change",
    [
        lambda document: document["action_space"][0].update(speed=12.5),
        lambda document: document["action_space"][0].update(speed=-4.0),
        lambda document: document["action_space"][0].update(speed=float("nan")),
        lambda document: document["action_space"][0].update(speed=1e308),
        lambda document: document["action_space"][0].update(steering_angle=60.0),
        lambda document: document["action_space"][0].update(steering_angle=31.0),
        lambda document: document.update(action_space=actions(*[(0, 1)] * 31)),
        lambda document: document.update(action_space=LIMITS, action_space_type="continuous"),
        lambda document: document.update(sensor=["EYES"]),
        lambda document: document.update(sensor=["FRONT_FACING_CAMERA", "STEREO_CAMERAS"]),
        lambda document: document.update(sensor=["FRONT_FACING_CAMERA", "LIDAR", "SECTOR_LIDAR"]),
        lambda document: document.update(sensor=["FRONT_FACING_CAMERA", "LIDAR"]),  # its network has no such branch
        lambda document: document.update(
            sensor=["FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR"], lidar_config={"clipping_dist": 100}
        ),
    ],
)
def test_what_the_network_may_not_do_or_see_is_refused(run: Path, change: Callable[[dict[str, Any]], object]) -> None:
    metadata(change)(run)
    with pytest.raises((ConfigError, CheckpointError)):
        load_entry(run)


def test_the_wheels_of_an_old_file_turn_no_further_than_everybodys(run: Path) -> None:
    """Files of 2018 may say 45°, which the car of 2018 drove as 30, too."""

    def old(document: dict[str, Any]) -> None:
        document["version"] = "1"
        for action in document["action_space"]:
            action.update(steering_angle=45.0, speed=4.0)

    metadata(old)(run)
    policy = load_entry(run).policy
    commands = policy.action_space.to_commands(np.arange(policy.action_space.size))
    assert commands[:, 1].max() <= 4.0
    fair = np.column_stack([commands[:, 0].clip(-MAX_STEERING, MAX_STEERING), commands[:, 1]])
    driven = []
    for told in (commands, fair):
        cars = Simulation(load_track("oval"), num_envs=len(told), camera=None, start=Start(mode="fixed"))
        for _ in range(10):
            cars.step(told)
        driven.append(cars.vehicles.copy())
    np.testing.assert_array_equal(*driven)


def test_no_file_says_where_the_lens_is(run: Path) -> None:
    metadata(lambda document: document.update(camera={"pitch": 0.0}, horizontal_fov=2.8, palette="2020"))(run)
    assert load_entry(run).policy.sensors.camera() == CameraSpec()


def test_what_a_lidar_config_only_says_makes_no_other_entry() -> None:
    def digest(sensor: str, **config: Any) -> str:
        document = {"action_space": actions((-10, 1), (10, 1)), "sensor": ["FRONT_FACING_CAMERA", sensor]}
        given = {**document, "lidar_config": config} if config else document
        return _digest(NetworkSpec(num_actions=2), ModelMetadata.from_dict(given), {})

    sectors = digest("DISCRETIZED_SECTOR_LIDAR", num_sectors=4)
    assert digest("DISCRETIZED_SECTOR_LIDAR", num_sectors=4, note="mine") == sectors
    assert digest("DISCRETIZED_SECTOR_LIDAR", clipping_distance=0.5) != digest("DISCRETIZED_SECTOR_LIDAR")
    assert sectors != digest("DISCRETIZED_SECTOR_LIDAR", num_sectors=8) == digest("DISCRETIZED_SECTOR_LIDAR")
    assert digest("LIDAR", num_sectors=4) == digest("LIDAR")


# ---- the checkpoint


def network(**values: Any) -> Callable[[Arrays, dict[str, Any]], object]:
    return lambda arrays, document: document["network"].update(values)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (network(name="HUGE"), "has the network 'HUGE'"),
        (network(name="TEACHER", state_size=20), "has the network 'TEACHER'"),
        (network(name=["RACECRAFT_SMALL"]), "has the network"),
        (network(name="DEEP_CONVOLUTIONAL_NETWORK_DEEP"), "does not hold the weights of DEEP"),
        (network(frame_shape=[12000, 16000]), "frame_shape is"),
        (network(frame_shape=None), "frame_shape is None"),
        (network(num_actions=10**9), "num_actions is 1000000000"),
        (network(num_actions=True), "num_actions is True"),
        (network(is_discrete=1), "is_discrete is 1"),
        (network(is_discrete=False), "is_discrete is False"),
        (network(lidar_size=10**6), "lidar_size is"),
        (network(lenses=2), "lenses is 2"),
        (network(state_size=10**12), "state_size"),
        (network(state_size=-1), "state_size"),
        (network(is_squashed="yes"), "is_squashed"),
        (network(noise=0.5), "'noise'"),
        (lambda arrays, document: document.update(network="SMALL"), "does not describe"),
        (lambda arrays, document: document.pop("network"), "does not describe"),
        (lambda arrays, document: arrays.update({"weights/policy.wing": np.zeros(3, np.float32)}), "policy.wing"),
        (lambda arrays, document: arrays.update({"weights/critic.wing": np.zeros(3, np.float32)}), "critic.wing"),
        (lambda arrays, document: arrays.update({"weights/other": np.zeros(3, np.float32)}), "other"),
        (lambda arrays, document: arrays.pop("weights/policy.head.bias"), "is missing in the file"),
        (lambda arrays, document: arrays.pop("weights/critic.head.bias"), "is missing in the file"),
        (lambda arrays, document: arrays.update({"weights/policy.head.bias": np.zeros(11, np.float32)}), r"\(11,\)"),
        (lambda arrays, document: arrays.update({"weights/policy.head.bias": np.zeros((10, 1), np.float32)}), "shape"),
        (lambda arrays, document: arrays.update({"weights/policy.head.bias": np.zeros(10)}), "F64"),
        (lambda arrays, document: arrays.update({"weights/policy.head.bias": np.zeros(10, np.float16)}), "F16"),
        (lambda arrays, document: arrays.update({"weights/policy.head.bias": np.zeros(10, np.int32)}), "I32"),
    ],
)
def test_only_a_known_network_with_exactly_its_weights_drives(
    run: Path, change: Callable[[Arrays, dict[str, Any]], object], words: str
) -> None:
    resave(run, change)
    with pytest.raises(CheckpointError, match=words):
        load_entry(run)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_weights_that_are_no_numbers_do_not_start(run: Path, value: float) -> None:
    def poison(arrays: Arrays, document: dict[str, Any]) -> None:
        arrays["weights/policy.conv1.weight"][3, 0, 2, 2] = value

    resave(run, poison)
    with pytest.raises(CheckpointError, match=r"NaN or infinite: policy\.conv1\.weight"):
        load_entry(run)


def in_halves(value: float | None = None) -> Callable[[Arrays, dict[str, Any]], object]:
    """The weights alone, as a starter keeps them; one of them this number, if given."""

    def change(arrays: Arrays, document: dict[str, Any]) -> None:
        for name in list(arrays):
            if name.startswith("weights/"):
                arrays[name] = arrays[name].astype(np.float16)
            else:
                del arrays[name]
        if value is not None:
            arrays["weights/policy.conv1.weight"][3, 0, 2, 2] = value
        document["origin"] = {"format": "racecraft"}

    return change


def test_weights_alone_drive_from_halves_as_their_numbers_say(honest: Path, run: Path) -> None:
    resave(run, in_halves())
    (path,) = (run / "checkpoints").glob("*.safetensors")
    assert {kind for kind, _ in header_of(path)[1].values()} == {"F16"}
    whole, driving = load_entry(honest).policy.learner.weights(), load_entry(run).policy.learner.weights()
    for name in (name for name in whole if name.startswith("policy.")):
        rounded = whole[name].astype(np.float16).astype(np.float32)
        assert driving[name].tobytes() == rounded.tobytes(), name


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_halves_that_are_no_numbers_do_not_start(run: Path, value: float) -> None:
    resave(run, in_halves(value))
    with pytest.raises(CheckpointError, match=r"NaN or infinite: policy\.conv1\.weight"):
        load_entry(run)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda arrays: arrays.update({"weights/policy.wing": np.zeros(3, np.float16)}), "policy.wing"),
        (lambda arrays: arrays.pop("weights/policy.head.bias"), "is missing in the file"),
        (lambda arrays: arrays.update({"weights/policy.head.bias": np.zeros(11, np.float16)}), r"F32 of shape \(11,\)"),
        (lambda arrays: arrays.update({"weights/policy.head.bias": np.zeros(10, np.int16)}), "I16"),
    ],
)
def test_halves_are_exactly_the_networks_weights_as_well(
    run: Path, change: Callable[[Arrays], object], words: str
) -> None:
    resave(run, lambda arrays, document: (in_halves()(arrays, document), change(arrays)))
    with pytest.raises(CheckpointError, match=words):
        load_entry(run)


def test_other_arrays_are_not_even_read(honest: Path, run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Moments, other means of the weights, and a tensor of any size: a race has no use for them."""
    from racecraft.run.checkpoint import StoredCheckpoint

    def stuff(arrays: Arrays, document: dict[str, Any]) -> None:
        arrays["bomb"] = np.full(2_000_000, np.nan)
        for name in [name for name in arrays if name.startswith("average/")]:
            arrays[name] = arrays[name] * 2.0

    resave(run, stuff)
    read: list[str] = []
    original = StoredCheckpoint.read
    monkeypatch.setattr(
        StoredCheckpoint, "read", lambda self, names: original(self, [read.append(name) or name for name in names])
    )
    frames = np.random.default_rng(1).integers(0, 256, (4, 120, 160), dtype=np.uint8)
    assert np.array_equal(load_entry(run).policy(frames), load_entry(honest).policy(frames))
    assert read
    assert all(name.startswith("weights/policy.") for name in read)


def test_a_checkpoint_that_is_a_pipe_is_not_waited_for(run: Path) -> None:
    import os

    (path,) = (run / "checkpoints").glob("*.safetensors")
    path.unlink()
    os.mkfifo(path)
    edit(run / "checkpoints" / "manifest.json", lambda document: document["checkpoints"][0].update(size=0))
    with pytest.raises(CheckpointError, match="is no file"):
        load_entry(run)


def test_a_best_marker_only_chooses_among_ones_own_checkpoints(run: Path) -> None:
    def boast(document: dict[str, Any]) -> None:
        document["checkpoints"][0].update(score=[1e308, 1e308], metrics={"best_lap": 0.001})

    edit(run / "checkpoints" / "manifest.json", boast)
    assert load_entry(run).step == 64
    edit(run / "checkpoints" / "manifest.json", lambda document: document["checkpoints"][0].update(step=10**30))
    with pytest.warns(UserWarning, match="is damaged"):
        assert load_entry(run).step == 64


# ---- names


@pytest.mark.parametrize("name", ["\x1b[31mred\x1b[0m", "a\u202egnp.exe", "bell\a", "[bold]x[/bold]", "<b>x</b>"])
def test_a_name_drives_no_terminal_and_leaves_no_folder(
    honest: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from racecraft.cli.text import say_raced

    run = shutil.copytree(honest, tmp_path / "runs" / name.replace("/", "_"))
    entry = load_entry(run)
    assert entry.name.isprintable()
    found = driven(Path(run), tmp_path / "races")
    assert found.folder.parent == tmp_path / "races"
    assert all(path.resolve().is_relative_to(found.folder.resolve()) for path in found.files.values())
    say_raced(found)
    table = capsys.readouterr().out.split("Race folder")[0]
    assert entry.name[:8] in table  # as it is: no markup, no escapes
    assert "\x1b" not in table
    assert "\u202e" not in table


def test_two_names_that_look_the_same_are_told_apart(honest: Path, tmp_path: Path) -> None:
    runs = [shutil.copytree(honest, tmp_path / name) for name in ("x\a", "x\b")]
    names = [entry.name for entry in load_entries(runs)]
    assert len(set(names)) == 2


def test_nothing_of_a_refused_entry_is_driven(run: Path, tmp_path: Path) -> None:
    resave(run, network(name="HUGE"))
    with pytest.raises(RacecraftError):
        driven(run, tmp_path / "races")
    assert not (tmp_path / "races").exists()


# ---- weights that are numbers and give none


def overflow(arrays: Arrays, _: dict[str, Any]) -> None:
    for name, array in arrays.items():
        if name.startswith("weights/policy."):
            array[:] = np.resize(np.float32([3e38, -3e38]), array.shape)


def test_choices_among_no_numbers_are_no_choice(honest: Path, run: Path, tmp_path: Path) -> None:
    resave(run, overflow)
    with pytest.raises(NonFiniteAction, match=r"cheat cannot drive: Its network gives -?(nan|inf)"):
        driven(run, tmp_path / "races")
    races = race_models(
        [honest, run],
        track="oval",
        kind="head-to-model",
        laps=1,
        changes=SOON,
        video=False,
        num_threads=1,
        root=tmp_path / "races",
    )
    others, (own,) = races.contest.trials
    assert own.recording.actions[:, 1].max() == 0.0
    assert others[0].recording.actions[:, 1].max() > 0.0
    assert races.contest.standings[0].car == 0


def test_the_digest_is_of_what_drives_and_nothing_else(honest: Path, tmp_path: Path) -> None:
    data = pack_entry(RunFolder(honest))
    length = int.from_bytes(data[:8], "little")
    header, arrays = json.loads(json.loads(data[8 : 8 + length])["__metadata__"][HEADER_KEY]), load(data)

    def digest(arrays: dict[str, Any], **changes: Any) -> str:
        path = tmp_path / "entry.safetensors"
        path.write_bytes(b"".join(tensor_file(arrays, {HEADER_KEY: json.dumps({**header, **changes})})))
        return read_entry_file(path).digest

    same = digest(arrays)
    metadata = header["model_metadata"]
    assert digest(arrays, step=1) == same
    assert digest(dict(reversed(arrays.items())), model_metadata={**metadata, "note": "mine"}) == same
    name = next(iter(arrays))
    assert digest({**arrays, name: arrays[name] + np.float32(1e-3)}) != same
    actions = [{**metadata["action_space"][0], "speed": 0.5}, *metadata["action_space"][1:]]
    assert digest(arrays, model_metadata={**metadata, "action_space": actions}) != same
