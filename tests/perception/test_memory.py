"""Memory over what is seen: its arithmetic, how it learns, what it is worth, and when it begins anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from safetensors.numpy import load_file, save_file
from unseen_roads import unseen_roads

from racecraft.errors import CheckpointError
from racecraft.film.encoding import write_video
from racecraft.perception import Belief, Perceiver, PerceptionDriver, Watcher, perceive
from racecraft.perception.answers import IN_SIGHT, MIDDLES, NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS, NUMBERS
from racecraft.perception.lessons import Lessons
from racecraft.perception.losses import slopes_of
from racecraft.perception.memory import ANSWERS, SHAPES, UNITS, Memory, seen_of, unseen
from racecraft.perception.mirror import mirrored_answers
from racecraft.perception.network import MEMORY, WEIGHTS
from racecraft.perception.reading import read_pictures
from racecraft.perception.recalling import STRETCH, Drives, gradient, taught
from racecraft.perception.truth import Truth
from racecraft.race.autopilot import Autopilot


def some_memory(seed: int = 1) -> Memory:
    rng = np.random.default_rng(seed)
    return Memory({name: 0.2 * rng.standard_normal(shape) for name, shape in SHAPES.items()})


def some_outputs(*shape: int, seed: int = 2) -> NDArray[np.float32]:
    return np.random.default_rng(seed).normal(0.0, 1.0, (*shape, NUM_OUTPUTS)).astype(np.float32)


def some_targets(*shape: int) -> NDArray[np.float32]:
    targets = np.random.default_rng(3).normal(0.0, 0.5, (*shape, NUM_TARGETS)).astype(np.float32)
    targets[..., NUM_CONTINUOUS:] = targets[..., NUM_CONTINUOUS:] > 0.0
    return targets


def test_it_corrects_where_the_lens_is_and_nothing_else() -> None:
    memory, outputs = some_memory(), some_outputs(5)
    better, state = memory(outputs, unseen(5))
    others = np.setdiff1d(np.arange(NUM_OUTPUTS), ANSWERS)
    assert (better[:, others] == outputs[:, others]).all()
    assert (better[:, ANSWERS] != outputs[:, ANSWERS]).all()
    again, _ = memory(outputs, state)
    assert (again[:, ANSWERS] != better[:, ANSWERS]).any()


def test_how_many_are_looked_at_together_changes_no_bit() -> None:
    memory, outputs = some_memory(), some_outputs(33, 4)
    together, state = [], unseen(33)
    for step in range(4):
        better, state = memory(outputs[:, step], state)
        together.append(better)
    for lens in (0, 7, 32):
        alone = unseen(1)
        for step in range(4):
            better, alone = memory(outputs[lens : lens + 1, step], alone)
            assert (better[0] == together[step][lens]).all()


def test_sums_are_exact_in_any_order() -> None:
    memory, outputs = some_memory(), some_outputs(40)
    order = np.random.default_rng(5).permutation(NUM_OUTPUTS)
    seen = seen_of(outputs)
    turned = seen[:, order] @ memory.weights["seen"][order]
    assert (seen @ memory.weights["seen"] == turned).all()


def test_it_is_told_no_columns_of_rows_without_a_middle_and_nothing_out_of_bounds() -> None:
    outputs = some_outputs(50)
    outputs[0] = 1e9
    seen = seen_of(outputs)
    is_there = outputs[:, IN_SIGHT] > 0.0
    assert 0.3 < is_there.mean() < 0.7
    assert (seen[:, MIDDLES][is_there] != 0.0).mean() > 0.99
    assert not seen[:, MIDDLES][~is_there].any()
    assert np.abs(seen).max() == 4.0


def test_in_a_mirror_it_remembers_the_same() -> None:
    memory, outputs = some_memory(), some_outputs(6, 3)
    state, turned = unseen(6), unseen(6)
    for step in range(3):
        better, state = memory(outputs[:, step], state)
        reflected, turned = memory(mirrored_answers(outputs[:, step]), turned)
        assert better == pytest.approx(mirrored_answers(reflected), abs=1e-6)


def test_its_slopes_are_those_of_the_loss() -> None:
    outputs, targets = some_outputs(6, 3, seed=4), some_targets(6, 3)
    begins = np.zeros((6, 3), bool)
    begins[3, 1] = True
    weights = {name: array.copy() for name, array in some_memory(6).weights.items()}
    # how far off it may be learns by another loss, which does not move what it is told of
    weights["answer"][:, 3:] = weights["answer_bias"][:, 3:] = 0.0
    slopes, _ = gradient(Memory(weights), outputs, targets, begins)
    for name in SHAPES:
        step = 2.0**-10 * np.sign(slopes[name])
        if name.startswith("answer"):
            step[:, 3:] = 0.0
        up, down = (
            gradient(Memory({**weights, name: weights[name] + way}), outputs, targets, begins)[1]
            for way in (step, -step)
        )
        assert 0.5 * (up - down) * begins.size == pytest.approx((slopes[name] * step).sum(), rel=0.03), name


def test_what_came_before_a_beginning_teaches_nothing() -> None:
    outputs, targets = some_outputs(4, 2), some_targets(4, 2)
    begins = np.zeros((4, 2), bool)
    begins[2] = True
    others = outputs.copy()
    others[:2] = some_outputs(2, 2, seed=9)
    _, loss = gradient(some_memory(), outputs[2:], targets[2:], np.zeros((2, 2), bool))
    losses = [gradient(some_memory(), each, targets, begins)[1] * 4 for each in (outputs, others)]
    early = [gradient(some_memory(), each[:2], targets[:2], begins[:2])[1] * 2 for each in (outputs, others)]
    assert np.subtract(losses, early) == pytest.approx(2 * loss, rel=1e-5)


@pytest.mark.costly
def test_it_learns_what_was_seen_before_and_the_same_bits_of_the_same() -> None:
    rng = np.random.default_rng(8)
    outputs = np.zeros((STRETCH, 64, NUM_OUTPUTS), np.float32)
    bends = list(NUMBERS).index("curvature_far")
    outputs[0, :, bends] = rng.choice([-1.0, 1.0], 64)
    targets = np.zeros((STRETCH, 64, NUM_TARGETS), np.float32)
    targets[..., bends] = outputs[..., bends]
    targets[..., 0] = 0.2 * outputs[0, :, bends]  # where the lens is, only a drive's first picture shows
    begins = np.zeros((STRETCH, 64), bool)
    losses: list[float] = []
    untaught = slopes_of(outputs.reshape(-1, NUM_OUTPUTS), targets.reshape(-1, NUM_TARGETS))[1]
    drives, lessons = [Drives(outputs, targets, begins)], Lessons(updates=960)
    memory = taught(drives, lessons, tell=lambda _, loss: losses.append(loss))
    assert losses[-1] < untaught - 0.3
    again = taught(drives, lessons)
    assert all((again.weights[name] == array).all() for name, array in memory.weights.items())


# --- what it is worth


@pytest.fixture(scope="module")
def perceiver() -> Perceiver:
    return Perceiver(num_threads=2)


@pytest.fixture(scope="module")
def remembered(perceiver: Perceiver) -> tuple[Belief, Belief, NDArray[np.float32]]:
    """Roads that were never learned from, under strong conditions: with and without memory, and the truth.

    Of every fifth picture from the eighth of a drive on; drives are by what is seen.
    """
    simulation = unseen_roads()
    truth, watcher = Truth(simulation), Watcher(perceiver)
    driver = PerceptionDriver(perceiver, autopilot=Autopilot(speed=1.5))
    frames, targets, ages = [], [], np.zeros(96, int)
    kept: list[Belief] = []
    for step in range(60):
        simulation.step(driver(simulation.frames))
        begins = simulation.terminated | simulation.truncated
        simulation.reset(begins)
        for one in (driver, watcher):
            one.forget(begins)
        ages = np.where(begins, 1, ages + 1)
        belief = watcher(simulation.frames)
        if step % 5 == 4 and step > 7:
            frames.append(simulation.frames[ages >= 8].copy())
            targets.append(truth.targets()[ages >= 8])
            kept.append(Belief(**{name: array[ages >= 8] for name, array in vars(belief).items()}))
    together = Belief(**{name: np.concatenate([vars(one)[name] for one in kept]) for name in vars(kept[0])})
    return together, perceiver(np.concatenate(frames)), np.concatenate(targets)


def errors_of(belief: Belief, truth: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """How far off it is: m and degrees."""
    found = {
        name: np.abs(vars(belief)[name] - truth[:, list(NUMBERS).index(name)] * NUMBERS[name])
        for name in ("offset", "heading", "heading_ahead")
    }
    return {name: error if name == "offset" else np.degrees(error) for name, error in found.items()}


@pytest.mark.costly
def test_with_memory_it_knows_the_roads_direction_beside_the_lens(
    remembered: tuple[Belief, Belief, NDArray[np.float32]],
) -> None:
    belief, alone, truth = remembered
    with_it, without = errors_of(belief, truth), errors_of(alone, truth)
    assert len(truth) > 500
    assert np.percentile(with_it["offset"], 90) <= 0.02
    assert np.percentile(with_it["heading"], 90) <= 2.0
    assert np.percentile(with_it["heading_ahead"], 90) <= 2.2
    assert np.percentile(without["heading"], 90) > 4.0  # no single picture shows it


@pytest.mark.costly
def test_with_memory_it_knows_how_far_off_it_may_be(
    remembered: tuple[Belief, Belief, NDArray[np.float32]],
) -> None:
    belief, _, truth = remembered
    for name in ("offset", "heading", "heading_ahead"):
        error = np.abs(vars(belief)[name] - truth[:, list(NUMBERS).index(name)] * NUMBERS[name])
        expected = vars(belief)[f"{name}_error"]
        assert 0.6 < expected.mean() / error.mean() < 1.7, name
        surest = expected < np.median(expected)
        assert error[surest].mean() < 0.85 * error[~surest].mean(), name


# --- whose memory it is


def pictures(count: int) -> NDArray[np.uint8]:
    return np.random.default_rng(11).integers(40, 200, (count, 120, 160)).astype(np.uint8)


@pytest.mark.costly
def test_lenses_are_told_apart_and_forgotten_one_by_one(perceiver: Perceiver) -> None:
    frames, watcher = pictures(3), Watcher(perceiver)
    first = watcher(frames)
    second = watcher(frames[[2, 0]], np.array([2, 0]))
    alone = Watcher(perceiver)
    assert alone(frames[2:]).heading[0] == first.heading[2]
    assert alone(frames[2:]).heading[0] == second.heading[0] != first.heading[2]
    watcher.forget(np.array([True, False, False]))
    third = watcher(frames)
    assert third.heading[0] == first.heading[0]
    assert third.heading[1] != first.heading[1]
    watcher.forget(np.array([9]))
    watcher.forget(np.array([False, False, False, True, True]))
    watcher.forget()
    assert (watcher(frames).heading == first.heading).all()


@pytest.mark.costly
def test_a_film_goes_on_where_it_ended_and_begins_anew_where_it_is_cut(perceiver: Perceiver) -> None:
    frames, watcher = pictures(6), Watcher(perceiver)
    cuts = np.array([True, False, False, False, True, False])
    whole = watcher.film(frames, cuts).heading
    parts = Watcher(perceiver)
    apart = [parts.film(frames[part], cuts[part]).heading for part in (slice(0, 3), slice(3, 6))]
    assert (np.concatenate(apart) == whole).all()
    assert (Watcher(perceiver).film(frames[4:], cuts[4:]).heading == whole[4:]).all()
    watcher = Watcher(perceiver)
    first = watcher(frames[:3]).heading
    watcher.film(frames[3:], cuts[:3])
    assert watcher(frames[:3]).heading[2] != first[2]  # the other lenses' pictures are not forgotten over it
    still = np.array([True, False, True, True, True, True])  # the second is a picture by itself
    assert Watcher(perceiver).film(frames, cuts, still).heading[1] == perceiver(frames).heading[1]
    assert whole[1] != perceiver(frames).heading[1]


@pytest.mark.costly
def test_a_video_is_remembered_and_the_same_pictures_in_a_folder_are_not(perceiver: Perceiver, tmp_path: Path) -> None:
    blurred = np.kron(pictures(70)[:, ::20, ::20], np.ones((1, 80, 80), np.uint8))  # more than are looked at together
    write_video([np.repeat(grey[..., None], 3, axis=2) for grey in blurred], tmp_path / "a.mp4")
    (tmp_path / "still").mkdir()
    seen = []
    for place, picture in enumerate(read_pictures([tmp_path / "a.mp4"])):
        Image.fromarray(picture.seen).save(tmp_path / "still" / f"{place:03}.png")
        seen.append(picture.seen)
    frames, begins = np.stack(seen), np.arange(70) == 0
    film, still = (
        [one["heading_rad"] for one in perceive([tmp_path / name], perceiver=perceiver)] for name in ("a.mp4", "still")
    )
    assert film == pytest.approx(Watcher(perceiver).film(frames, begins).heading, abs=6e-5)
    assert still == pytest.approx(perceiver(frames).heading, abs=6e-5)
    assert np.abs(np.subtract(film, still)).max() > 0.01
    after = perceive([tmp_path / "a.mp4", tmp_path / "still", tmp_path / "a.mp4"], perceiver=perceiver)
    assert [one["heading_rad"] for one in after] == [*film, *still, *film]


@pytest.mark.costly
def test_weights_without_a_memory_look_at_each_picture_by_itself(perceiver: Perceiver, tmp_path: Path) -> None:
    arrays = {name: array for name, array in load_file(WEIGHTS).items() if not name.startswith(MEMORY)}
    save_file(arrays, tmp_path / "old.safetensors")
    old, frames = Perceiver(tmp_path / "old.safetensors", num_threads=1), pictures(3)
    assert old.memory is None
    assert (old(frames).heading == perceiver(frames).heading).all()
    for watcher in (Watcher(old), Watcher(old)):
        assert (watcher(frames).heading == old(frames).heading).all()
        assert (watcher.film(frames, np.zeros(3, bool)).heading == old(frames).heading).all()


@pytest.mark.parametrize("fault", ["missing", "another shape", "unknown"])
def test_weights_of_another_memory_are_refused(tmp_path: Path, fault: str) -> None:
    arrays = load_file(WEIGHTS)
    if fault == "missing":
        del arrays[f"{MEMORY}state"]
    elif fault == "another shape":
        arrays[f"{MEMORY}bias"] = np.zeros((1, UNITS), np.float16)
    else:
        arrays[f"{MEMORY}more"] = np.zeros((1, UNITS), np.float16)
    save_file(arrays, tmp_path / "w")
    with pytest.raises(CheckpointError, match="its memory are others"):
        Perceiver(tmp_path / "w", num_threads=1)


def test_what_the_package_brings_along_is_small() -> None:
    remembers = [array for name, array in load_file(WEIGHTS).items() if name.startswith(MEMORY)]
    assert 0 < sum(array.nbytes for array in remembers) < 45_000
    assert {array.dtype for array in remembers} == {np.dtype(np.float16)}
