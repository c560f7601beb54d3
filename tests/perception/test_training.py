"""How perception learns."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import CheckpointError, ConfigError, RunError
from racecraft.perception import Lessons, Perceiver, train
from racecraft.perception.answers import NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS, NUMBERS
from racecraft.perception.losses import slopes_of
from racecraft.perception.network import MAX_WEIGHTS, WEIGHTS
from racecraft.perception.packing import STEP
from racecraft.perception.store import Store

pytestmark = pytest.mark.costly

FEW = Lessons(updates=60, minibatch_size=32, store=1024, roads=2, learning_rate=1e-3)


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[float]]:
    """Weights after a few lessons, and the network's losses on the way."""
    losses: list[float] = []
    updates: list[int] = []

    def tell(update: int, loss: float) -> None:
        updates.append(update)
        if update <= FEW.updates:
            losses.append(loss)

    path = tmp_path_factory.mktemp("lessons") / "a.safetensors"
    train(FEW, tell=tell).save(path)
    assert updates == sorted(updates)
    assert updates[-1] == FEW.all_updates  # those of the memory come last
    return path, losses


@pytest.mark.costly
def test_the_same_lessons_give_the_same_bits(learned: tuple[Path, list[float]], tmp_path: Path) -> None:
    train(FEW).save(tmp_path / "b.safetensors")
    assert (tmp_path / "b.safetensors").read_bytes() == learned[0].read_bytes()


def test_it_learns(learned: tuple[Path, list[float]]) -> None:
    _, losses = learned
    assert np.isfinite(losses).all()
    untaught = np.zeros((64, NUM_OUTPUTS), np.float32)
    assert losses[-1] < 0.8 * slopes_of(untaught, _targets(64))[1] + 10.0


def test_slopes_are_those_of_the_loss() -> None:
    rng = np.random.default_rng(7)
    targets = _targets(6)
    outputs = rng.normal(0.0, 0.5, (6, NUM_OUTPUTS)).astype(np.float32)
    slopes, _ = slopes_of(outputs, targets)
    for column in range(NUM_TARGETS):  # the expected error's slope is another likelihood's, below
        above, below = outputs.copy(), outputs.copy()
        above[:, column] += 1e-2
        below[:, column] -= 1e-2
        numeric = (slopes_of(above, targets)[1] - slopes_of(below, targets)[1]) / 2e-2
        assert slopes[:, column].mean() == pytest.approx(numeric, abs=0.03), column


def test_expected_errors_settle_where_they_are_right() -> None:
    targets = np.zeros((1, NUM_TARGETS), np.float32)
    targets[:, NUM_CONTINUOUS:] = 1.0
    outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
    outputs[:, :NUM_CONTINUOUS] = 0.3
    for log, sign in ((np.log(0.3), 0.0), (np.log(0.1), -1.0), (np.log(0.9), 1.0)):
        outputs[:, NUM_TARGETS:] = log
        slopes = slopes_of(outputs, targets)[0][:, NUM_TARGETS:]
        assert np.allclose(np.sign(np.where(np.abs(slopes) < 1e-6, 0.0, slopes)), sign)


def test_beyond_what_is_told_an_expected_error_only_goes_back() -> None:
    targets = np.zeros((1, NUM_TARGETS), np.float32)
    for log, error, sign in ((-7.0, 1e-5, 0.0), (-7.0, 0.3, -1.0), (3.0, 0.3, 1.0), (3.0, 20.0, 0.0)):
        outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
        outputs[:, : len(NUMBERS)] = error
        outputs[:, NUM_TARGETS:] = log
        slopes = slopes_of(outputs, targets)[0][0, NUM_TARGETS : NUM_TARGETS + len(NUMBERS)]
        assert (np.sign(slopes) == sign).all(), (log, error)


def test_a_full_store_forgets_pictures_at_random_and_no_other() -> None:
    rng, store = np.random.default_rng(4), Store(64, (2,))
    store.put(np.full((3, 2), 7, np.uint8), np.ones((3, NUM_TARGETS), np.float32), rng=rng)
    assert (store.draw(100, rng=rng)[0] == 7).all()  # of one that is not full only what it has
    store = Store(64, (2,))
    for number in range(0, 64 * 16, 48):
        marks = np.arange(number, number + 48, dtype=np.float32) + 1.0
        store.put(
            np.stack([marks % 256, marks // 256], axis=1).astype(np.uint8),
            np.repeat(marks[:, None], NUM_TARGETS, 1),
            rng=rng,
        )
    assert store.seen == 22 * 48
    observations, targets = store.draw(4000, rng=rng)
    assert (observations @ np.array([1.0, 256.0]) == targets[:, 0]).all()
    known, often = np.unique(targets[:, 0], return_counts=True)
    assert len(known) == 64  # each of its places has a picture of its own, as likely as another
    assert often.max() < 3 * often.min()
    assert 0.2 < np.mean(known < store.seen - 64) < 0.8  # not only the newest
    observations[:] = 0
    assert store.draw(50, rng=rng)[0].any()


def test_a_column_that_is_not_there_teaches_nothing() -> None:
    targets = np.zeros((1, NUM_TARGETS), np.float32)
    outputs = np.full((1, NUM_OUTPUTS), 0.7, np.float32)
    slopes, _ = slopes_of(outputs, targets)
    assert not slopes[0, len(NUMBERS) : NUM_CONTINUOUS].any()
    assert slopes[0, : len(NUMBERS)].all()


def test_the_weights_brought_along_are_small_and_none_is_lost() -> None:
    from safetensors.numpy import load_file

    assert WEIGHTS.stat().st_size < 1_000_000
    arrays = load_file(WEIGHTS)
    large = {name for name in arrays if f"{name}{STEP}" in arrays}
    assert {arrays[name].dtype for name in large} == {np.dtype(np.int8)}
    assert {array.dtype for name, array in arrays.items() if name not in large and not name.endswith(STEP)} == {
        np.dtype(np.float16)
    }
    assert all(np.isfinite(array).all() for array in arrays.values())


def test_what_is_written_is_read_to_half_a_step(learned: tuple[Path, list[float]], tmp_path: Path) -> None:
    from safetensors.numpy import load_file

    perceiver = Perceiver(learned[0], num_threads=1)
    assert perceiver.memory is not None
    perceiver.save(tmp_path / "again")
    stored, weights = load_file(tmp_path / "again"), perceiver.network.weights()
    steps = [name for name in stored if name.endswith(STEP)]
    assert steps
    for name in steps:
        whole = weights[name.removesuffix(STEP)] / stored[name]
        assert np.abs(whole).max() <= 127.5
        np.testing.assert_allclose(whole, np.rint(whole), atol=1e-3)  # what was read was whole steps already
    assert (tmp_path / "again").read_bytes() == learned[0].read_bytes()


def test_weights_that_are_none_are_refused(learned: tuple[Path, list[float]], tmp_path: Path) -> None:
    stored = learned[0].read_bytes()
    (tmp_path / "cut").write_bytes(stored[: len(stored) // 2])
    (tmp_path / "text").write_text("no weights")
    for name in ("cut", "text", "missing"):
        with pytest.raises(CheckpointError, match="cannot be read"):
            Perceiver(tmp_path / name, num_threads=1)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(CheckpointError, match="no regular file"):
            Perceiver(tmp_path / "pipe", num_threads=1)
    with (tmp_path / "large").open("wb") as file:
        file.truncate(MAX_WEIGHTS + 1)
    with pytest.raises(CheckpointError, match="larger than 16 MB"):
        Perceiver(tmp_path / "large", num_threads=1)


@pytest.mark.parametrize("fault", ["no step", "a step too few", "a step of nothing", "one number"])
def test_whole_numbers_without_their_steps_are_refused(
    learned: tuple[Path, list[float]], tmp_path: Path, fault: str
) -> None:
    from safetensors.numpy import load_file, save_file

    arrays = load_file(learned[0])
    (step,) = [name for name in arrays if name.endswith(STEP)]
    if fault == "no step":
        del arrays[step]
    elif fault == "a step too few":
        arrays[step] = arrays[step][1:].copy()
    elif fault == "a step of nothing":
        arrays[f"policy.conv1.bias{STEP}"] = arrays[step]
    else:
        arrays[step.removesuffix(STEP)] = np.array(3, np.int8)
    save_file(arrays, tmp_path / "w")
    with pytest.raises(CheckpointError, match="cannot be read"):
        Perceiver(tmp_path / "w", num_threads=1)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    from safetensors.numpy import save_file

    save_file({"policy.conv1.weight": np.zeros((2, 2), np.float16)}, tmp_path / "w")
    with pytest.raises(CheckpointError):
        Perceiver(tmp_path / "w", num_threads=1)


def test_weights_that_are_no_numbers_are_refused(learned: tuple[Path, list[float]], tmp_path: Path) -> None:
    from safetensors.numpy import load_file, save_file

    arrays = load_file(learned[0])
    next(iter(arrays.values())).flat[3] = np.nan
    save_file(arrays, tmp_path / "w")
    with pytest.raises(CheckpointError, match="not all finite"):
        Perceiver(tmp_path / "w", num_threads=1)


def test_steps_that_are_too_long_for_a_number_are_refused(learned: tuple[Path, list[float]], tmp_path: Path) -> None:
    from safetensors.numpy import load_file, save_file

    arrays = load_file(learned[0])
    (step,) = [name for name in arrays if name.endswith(STEP)]
    arrays[step][:] = np.finfo(np.float32).max
    save_file(arrays, tmp_path / "w")
    with pytest.raises(CheckpointError, match="not all finite"):
        Perceiver(tmp_path / "w", num_threads=1)


def test_weights_are_written_whole_or_not_at_all(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"nowhere/w cannot be written: No such file or directory\."):
        Perceiver(None, num_threads=1).save(tmp_path / "nowhere" / "w")
    (tmp_path / "w").write_bytes(b"older")
    Perceiver(None, num_threads=1).save(tmp_path / "w")
    assert [path.name for path in tmp_path.iterdir()] == ["w"]
    Perceiver(tmp_path / "w", num_threads=1)


def test_lessons_have_limits() -> None:
    for wrong in ({"updates": 0}, {"roads": 0}, {"store": 8}, {"learning_rate": 2.0}, {"seed": -1}):
        with pytest.raises(ConfigError):
            Lessons(**wrong)


def _targets(count: int) -> np.ndarray:
    rng = np.random.default_rng(3)
    targets = rng.normal(0.0, 0.5, (count, NUM_TARGETS)).astype(np.float32)
    targets[:, NUM_CONTINUOUS:] = targets[:, NUM_CONTINUOUS:] > 0.0
    return targets
