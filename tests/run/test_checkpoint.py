import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import CheckpointError
from racecraft.run import CheckpointStore, CheckpointWarning
from racecraft.run.checkpoint import MANIFEST

ROOT = Path(__file__).parents[2]


def arrays(step, size=1000):
    random_numbers = np.random.default_rng(step)
    return {"policy.weight": random_numbers.normal(size=size).astype(np.float32), "steps": np.array(step)}


def save(store, *steps, **more):
    for step in steps:
        store.save(step, arrays(step), metadata={"step": step}, **more)


def assert_good(checkpoint):
    expected = arrays(checkpoint.step, len(checkpoint.arrays["policy.weight"]))
    assert checkpoint.metadata == {"step": checkpoint.step}
    assert checkpoint.arrays.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(checkpoint.arrays[name], values)


@pytest.fixture
def store(tmp_path):
    return CheckpointStore(tmp_path / "checkpoints", aws_index=tmp_path / "model" / "deepracer_checkpoints.json")


def test_every_kind_of_array_comes_back_bit_for_bit(store):
    saved = {
        "scalar": np.array(1.5),
        "empty": np.zeros((0, 3), np.float32),
        "fortran": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "strided": np.arange(10, dtype=np.int64)[::3],
        "reversed": np.arange(4, dtype=np.uint8)[::-1],
        "big_endian": np.arange(3, dtype=">f4"),
        "flags": np.array([True, False]),
        "special": np.array([np.nan, np.inf, -0.0, 5e-324]),
    }
    store.save(1, saved)
    loaded = store.load().arrays
    assert loaded.keys() == saved.keys()
    for name, values in saved.items():
        assert loaded[name].shape == values.shape, name
        assert loaded[name].tobytes() == values.astype(values.dtype.newbyteorder("=")).tobytes(), name
        loaded[name][...] = 0  # the caller's own


def test_weights_alone_may_lie_in_halves_and_a_trainings_own_arrays_never_change(store):
    """Every finite half is a number of float32 to the bit, and what is none stays none."""
    halves = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    saved = {"weights/a": halves, "weights/b": np.float32([1 / 3]), "counts": np.arange(3, dtype=np.int8)}
    store.save(0, saved, metadata={"origin": {"format": "racecraft"}})
    found = store.find()
    assert found.kinds["weights/a"] == ("F32", halves.shape)
    assert found.path.stat().st_size < 2 * halves.size + 1000
    for arrays in (store.load().arrays, found.read(saved)):
        assert {name: array.dtype for name, array in arrays.items()} == {
            **{"weights/a": np.float32, "weights/b": np.float32, "counts": np.int8}
        }
        np.testing.assert_array_equal(arrays["weights/a"].astype(np.float16), halves)
        assert np.array_equal(np.isfinite(arrays["weights/a"]), np.isfinite(halves))
        assert arrays["weights/b"] == np.float32(1 / 3)

    store.save(64, saved, metadata={"network": {}})
    own = store.load()
    assert store.find().kinds["weights/a"] == ("F16", halves.shape)
    assert own.arrays["weights/a"].tobytes() == halves.tobytes()
    with pytest.raises(CheckpointError, match="weights/a is float16 instead of float32"):
        own.check_arrays({"weights/a": np.zeros(1 << 16, np.float32)})


def test_a_file_of_a_given_time_repeats_to_the_bit(store, tmp_path):
    again = CheckpointStore(tmp_path / "again")
    for each in (store, again):
        each.save(0, arrays(0), time_stamp=1.5e9)
    (entry,) = store.entries()
    assert entry == again.entries()[0]
    assert entry.time_stamp == 1.5e9


def test_metadata_keeps_large_integers_and_numpy_scalars(store):
    state = np.random.default_rng(7).bit_generator.state
    store.save(1, {}, metadata={"generator": state, "share": np.float64(0.5)}, metrics={"loss": np.nan, "reward": 2})
    checkpoint = store.load()
    assert checkpoint.metadata == {"generator": state, "share": 0.5}
    assert checkpoint.metrics == {"loss": None, "reward": 2.0}


def test_last_four_and_best_are_kept(store):
    for step, score in [(100, 1.0), (200, 9.0), (300, 2.0), (400, 3.0), (500, 4.0), (600, 5.0), (700, 6.0)]:
        save(store, step, score=(score,))
    assert [entry.step for entry in store.entries()] == [200, 400, 500, 600, 700]
    assert len(list(store.folder.iterdir())) == 6
    assert (store.best.step, store.last.step) == (200, 700)
    for which in ("best", "last", 500):
        assert_good(store.load(which))
    assert store.load("best").step == store.load("200").step == 200
    index = json.loads(store.aws_index.read_text())
    assert index["best_checkpoint"]["avg_eval_metric"] == 9.0
    assert index["last_checkpoint"]["name"] == store.last.file
    assert index.keys() == {"best_checkpoint", "last_checkpoint"}
    assert index["last_checkpoint"].keys() == {"name", "avg_eval_metric", "time_stamp"}


def test_what_a_run_began_with_is_kept(store):
    save(store, 0)
    for step in range(100, 900, 100):
        save(store, step, score=(float(step),))
    assert [entry.step for entry in store.entries()] == [0, 500, 600, 700, 800]
    assert_good(store.load("0"))


def test_without_scores_the_best_is_the_last(store):
    for step in (100, 200, 300):
        save(store, step)
    assert store.best.step == store.last.step == 300
    index = json.loads(store.aws_index.read_text())
    assert index["best_checkpoint"]["name"] == index["last_checkpoint"]["name"] == store.last.file
    manifest = json.loads((store.folder / MANIFEST).read_text())
    assert manifest["best"] == manifest["last"] == store.last.file


def test_what_no_manifest_lists_is_removed_and_what_is_no_checkpoint_stays(store):
    save(store, 100)
    unlisted = store.folder / "000000050-0123abcd.safetensors"
    unfinished = store.folder / "000000200-0123abcd.safetensors.tmp"
    others = [store.folder / name for name in ("notes.txt", "mine.safetensors", "000000050.safetensors")]
    for path in (unlisted, unfinished, *others):
        path.write_bytes(b"x")
    save(store, 200)
    left = {path.name for path in store.folder.iterdir()}
    assert left == {"manifest.json", *(entry.file for entry in store.entries()), *(path.name for path in others)}
    assert [entry.step for entry in store.entries()] == [100, 200]


def test_of_equal_scores_the_later_is_best_and_lap_time_decides_between_full_laps(store):
    save(store, 100, score=(1.0, -9.0))
    save(store, 200, score=(1.0, -8.0))
    save(store, 300, score=(1.0, -8.0))
    save(store, 400, score=(0.9, -1.0))
    save(store, 500)
    assert store.best.step == 300


def test_last_is_what_was_saved_last_whatever_its_step(store):
    save(store, 100, 200)
    store.save(100, arrays(100), metadata={"step": 100, "again": True})
    assert [entry.step for entry in store.entries()] == [100, 200, 100]
    assert store.load("last").metadata == store.load(100).metadata == {"step": 100, "again": True}


@pytest.mark.parametrize(
    ("which", "words"),
    [
        ("worst", "allowed is 'last', 'best' or a step"),
        ("²", "allowed is 'last', 'best' or a step"),
        ("٣", "allowed is 'last', 'best' or a step"),
        ("1" * 5000, "allowed is 'last', 'best' or a step"),
        (300, "no checkpoint of step 300; allowed are 100, 200"),
        ("0", "no checkpoint of step 0; allowed are 100, 200"),
    ],
)
def test_wrong_choice_is_told(store, which, words):
    save(store, 100, 200)
    with pytest.raises(CheckpointError) as error:
        store.load(which)
    assert words in str(error.value)


def test_no_checkpoint_yet(store):
    assert (store.entries(), store.last, store.best) == ([], None, None)
    with pytest.raises(CheckpointError, match="has no checkpoint"):
        store.load()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"arrays": {"x": np.array(["a"])}}, "array 'x' has type"),
        ({"arrays": {"x": np.array([object()])}}, "array 'x' has type object"),
        ({"arrays": {}, "metadata": {"x": object()}}, "must be JSON"),
        ({"arrays": {}, "metadata": {"x": float("nan")}}, "must be JSON"),
        ({"arrays": {}, "score": (float("nan"),)}, "allowed are finite numbers"),
    ],
)
def test_what_cannot_be_saved_is_refused_and_leaves_the_old(store, arguments, words):
    save(store, 100)
    with pytest.raises(CheckpointError) as error:
        store.save(200, **arguments)
    assert words in str(error.value)
    assert_good(store.load())


def remove(path):
    path.unlink()


def truncate(path):
    path.write_bytes(path.read_bytes()[:-10])


def flip(path):
    data = bytearray(path.read_bytes())
    data[random.Random(len(data)).randrange(len(data))] ^= 1
    path.write_bytes(data)


def empty(path):
    path.write_bytes(b"")


def grow(path):
    path.write_bytes(path.read_bytes() + b"\0")


@pytest.mark.parametrize("damage", [remove, truncate, flip, empty, grow])
def test_damaged_last_falls_back_with_a_warning(store, damage):
    save(store, 100, 200, 300)
    damage(store.folder / store.last.file)
    with pytest.warns(CheckpointWarning, match="Using step 200"):
        checkpoint = store.load("last")
    assert checkpoint.step == 200
    assert_good(checkpoint)
    with pytest.raises(CheckpointError):
        store.load(300)


@pytest.mark.parametrize("damage", [truncate, flip, empty])
def test_all_damaged_is_an_error(store, damage):
    save(store, 100, 200)
    for entry in store.entries():
        damage(store.folder / entry.file)
    with pytest.raises(CheckpointError, match=r"checksum is wrong|bytes instead of"):
        store.load()


@pytest.mark.parametrize("damage", [remove, truncate, empty, lambda path: path.write_text("[1]")])
def test_without_the_manifest_whole_files_are_found_again(store, damage):
    save(store, 100, score=(2.0,))
    save(store, 200, 300, score=(1.0,))
    damage(store.folder / "manifest.json")
    flip(store.folder / next(p.name for p in store.folder.iterdir() if p.name.startswith("000000300")))
    with pytest.warns(CheckpointWarning, match="2 whole checkpoints"):
        last = store.load("last")
    assert last.step == 200
    assert_good(last)
    with pytest.warns(CheckpointWarning):
        assert store.load("best").step == 100
    with pytest.warns(CheckpointWarning):
        save(store, 400)
    assert [entry.step for entry in store.entries()] == [100, 200, 400]


def test_any_flipped_bit_of_the_file_is_noticed(store):
    save(store, 100)
    path = store.folder / store.last.file
    good = path.read_bytes()
    for place in range(0, len(good), max(1, len(good) // 200)):
        bad = bytearray(good)
        bad[place] ^= 1 << place % 8
        path.write_bytes(bad)
        with pytest.raises(CheckpointError):
            store.load()


def test_manifest_cannot_point_elsewhere(store, tmp_path):
    save(store, 100)
    manifest = store.folder / "manifest.json"
    document = json.loads(manifest.read_text())
    document["checkpoints"][0]["file"] = "../secret"
    manifest.write_text(json.dumps(document))
    with pytest.warns(CheckpointWarning, match="not the name of a checkpoint"):
        assert_good(store.load())


@pytest.mark.parametrize("field", ["step", "size", "time_stamp", "score", "metrics"])
@pytest.mark.parametrize("text", ["Infinity", "NaN", '"nan"', "1" + "0" * 400, "[NaN]", '["nan"]', '{"lap": "nan"}'])
def test_a_manifest_with_numbers_that_are_none_is_done_without(store, field, text):
    save(store, 100)
    manifest = store.folder / "manifest.json"
    document = json.loads(manifest.read_text())
    document["checkpoints"][0][field] = "HERE"
    manifest.write_text(json.dumps(document).replace('"HERE"', text))
    with pytest.warns(CheckpointWarning, match="is damaged"):
        assert_good(store.load())


def test_manifest_of_a_later_version_is_left_alone(store):
    save(store, 100)
    manifest = store.folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"format": 1', '"format": 2'))
    before = sorted(store.folder.iterdir())
    for call in (store.load, lambda: save(store, 200)):
        with pytest.raises(CheckpointError, match="has format 2, this version reads 1"):
            call()
    assert sorted(store.folder.iterdir()) == before


def test_unreadable_folder_is_not_taken_for_an_empty_one(store, monkeypatch):
    save(store, 100, 200)
    before = sorted(store.folder.iterdir())

    def fail(*arguments, **more):
        raise OSError(errno.EIO, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", fail)
        for call in (store.entries, store.load, lambda: save(store, 300)):
            with pytest.raises(CheckpointError, match="Input/output error"):
                call()
    assert sorted(store.folder.iterdir()) == before


def test_numpy_steps(store):
    store.save(np.int64(100), {}, metrics={"reward": np.float32(1)}, score=np.array([1.0]))
    assert store.load(np.int64(100)).step == store.best.step == 100
    with pytest.raises(CheckpointError, match="step is -1"):
        store.save(-1, {})


CALLS = ("open", "write", "fsync", "replace", "close")


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_an_error_at_any_call_leaves_the_old_ones_good(store, monkeypatch, call, number):
    save(store, 100, 200)
    original, count = getattr(os, call), 0

    def fail(*arguments, **more):
        nonlocal count
        count += 1
        if count == number:
            if call == "close":
                original(*arguments)
            raise OSError(errno.ENOSPC, "No space left on device")
        return original(*arguments, **more)

    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail)
        try:
            save(store, 300)
        except CheckpointError as error:
            failed = str(error)
            assert "Checkpoint 300 could not be saved" in failed
            assert "No space left" in failed
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_good(store.load(200))
        last = store.load("last")
    assert last.step in (200, 300)
    assert_good(last)
    assert not list(store.folder.glob("*.tmp"))
    save(store, 400)
    assert store.load().step == 400
    assert len(list(store.folder.glob("*.safetensors"))) == len(store.entries())


def test_half_written_data_is_written_on(store, monkeypatch):
    original = os.write
    monkeypatch.setattr(os, "write", lambda descriptor, data: original(descriptor, data[:777]))
    save(store, 100)
    assert_good(store.load())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission(store):
    save(store, 100)
    store.folder.chmod(0o500)
    try:
        with pytest.raises(CheckpointError, match="Permission denied"):
            save(store, 200)
    finally:
        store.folder.chmod(0o700)
    assert_good(store.load())


def test_folder_that_is_a_file(tmp_path):
    (tmp_path / "checkpoints").write_text("")
    with pytest.raises(CheckpointError, match="could not be saved"):
        save(CheckpointStore(tmp_path / "checkpoints"), 100)


SAVER = """
import sys, numpy as np
sys.path.insert(0, sys.argv[2])
from test_checkpoint import arrays
from racecraft.run import CheckpointStore
store = CheckpointStore(sys.argv[1])
step = store.last.step if store.last else 0
while True:
    step += 1
    store.save(step, arrays(step, 300_000), metadata={"step": step})
    print(step, flush=True)
"""


@pytest.mark.costly
def test_kill_in_the_middle_of_saving_loses_at_most_one(tmp_path):
    store = CheckpointStore(tmp_path / "checkpoints")
    dice = random.Random(1)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), *sys.path])}
    for _ in range(4):
        command = [sys.executable, "-c", SAVER, str(store.folder), str(Path(__file__).parent)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
            confirmed = int(process.stdout.readline())
            time.sleep(dice.uniform(0, 0.1))
            process.send_signal(signal.SIGKILL)
            confirmed = max([confirmed, *map(int, process.stdout.read().split())])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            checkpoint = store.load()
        assert checkpoint.step in (confirmed, confirmed + 1)
        assert_good(checkpoint)
