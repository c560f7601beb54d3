"""Memory over what is seen: its arithmetic, how it learns, what it is worth, and when it begins anew."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from safetensors.numpy import load_file, save_file
from unseen_roads import unseen_roads

from racecraft.errors import CheckpointError
from racecraft.film.encoding import write_video
from racecraft.perceiving import PerceptionDriver, perceive
from racecraft.perceiving.reading import read_pictures
from racecraft.perception import Belief, Perceiver, Watcher
from racecraft.perception.answers import IN_SIGHT, MIDDLES, NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS, NUMBERS
from racecraft.perception.belief import believe
from racecraft.perception.lessons import Lessons
from racecraft.perception.losses import slopes_of
from racecraft.perception.memory import (
    ANSWERS,
    MOST_COMMANDED,
    NUM_SEEN,
    SHAPES,
    UNITS,
    Memory,
    seen_of,
    unknown,
    unseen,
)
from racecraft.perception.mirror import mirrored_answers, mirrored_commands
from racecraft.perception.network import MEMORY, WEIGHTS
from racecraft.perception.recalling import STRETCH, Drives, _minibatch, gradient, taught
from racecraft.perception.truth import Truth
from racecraft.race.autopilot import Autopilot


def some_memory(seed: int = 1) -> Memory:
    rng = np.random.default_rng(seed)
    return Memory({name: 0.2 * rng.standard_normal(shape) for name, shape in SHAPES.items()})


def some_outputs(*shape: int, seed: int = 2) -> NDArray[np.float32]:
    return np.random.default_rng(seed).normal(0.0, 1.0, (*shape, NUM_OUTPUTS)).astype(np.float32)


def some_commands(*shape: int, seed: int = 7) -> NDArray[np.float32]:
    """Half of them are not known."""
    rng = np.random.default_rng(seed)
    commands = rng.uniform([-0.5, 0.5], [0.5, 4.0], (*shape, 2)).astype(np.float32)
    commands[rng.random(shape) < 0.5] = np.nan
    return commands


def some_targets(*shape: int) -> NDArray[np.float32]:
    targets = np.random.default_rng(3).normal(0.0, 0.5, (*shape, NUM_TARGETS)).astype(np.float32)
    targets[..., NUM_CONTINUOUS:] = targets[..., NUM_CONTINUOUS:] > 0.0
    return targets


def test_it_corrects_where_the_lens_is_and_nothing_else() -> None:
    memory, outputs, commands = some_memory(), some_outputs(5), some_commands(5)
    better, state = memory(outputs, commands, unseen(5))
    others = np.setdiff1d(np.arange(NUM_OUTPUTS), ANSWERS)
    assert (better[:, others] == outputs[:, others]).all()
    assert (better[:, ANSWERS] != outputs[:, ANSWERS]).all()
    again, _ = memory(outputs, commands, state)
    assert (again[:, ANSWERS] != better[:, ANSWERS]).any()


def test_how_many_are_looked_at_together_changes_no_bit() -> None:
    memory, outputs, commands = some_memory(), some_outputs(33, 4), some_commands(33, 4)
    together, state = [], unseen(33)
    for step in range(4):
        better, state = memory(outputs[:, step], commands[:, step], state)
        together.append(better)
    for lens in (0, 7, 32):
        alone = unseen(1)
        for step in range(4):
            better, alone = memory(outputs[[lens], step], commands[[lens], step], alone)
            assert (better[0] == together[step][lens]).all()


def test_sums_are_exact_in_any_order() -> None:
    memory, outputs = some_memory(), some_outputs(40)
    order = np.random.default_rng(5).permutation(NUM_SEEN)
    seen = seen_of(outputs, some_commands(40))
    turned = seen[:, order] @ memory.weights["seen"][order]
    assert (seen @ memory.weights["seen"] == turned).all()


def test_it_is_told_no_columns_of_rows_without_a_middle_and_nothing_out_of_bounds() -> None:
    outputs = some_outputs(50)
    outputs[0] = 1e9
    seen = seen_of(outputs, unknown(50))
    is_there = outputs[:, IN_SIGHT] > 0.0
    assert 0.3 < is_there.mean() < 0.7
    assert (seen[:, MIDDLES][is_there] != 0.0).mean() > 0.99
    assert not seen[:, MIDDLES][~is_there].any()
    assert np.abs(seen).max() == 4.0


def test_it_is_told_commands_and_whether_they_are_known() -> None:
    commands = np.array([[0.25, 3.0], [-0.5, 0.0], [np.nan, np.nan], [9.0, -1e30], [0.25, np.nan]], np.float32)
    told = seen_of(some_outputs(5), commands)[:, NUM_OUTPUTS:]
    most = MOST_COMMANDED
    assert told.tolist() == [[1.0, 0.5, 1.5], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [1.0, most, -most], [0.0, 0.0, 0.0]]


def test_in_a_mirror_it_remembers_the_same() -> None:
    memory, outputs, commands = some_memory(), some_outputs(6, 3), some_commands(6, 3)
    state, turned = unseen(6), unseen(6)
    for step in range(3):
        better, state = memory(outputs[:, step], commands[:, step], state)
        reflected, turned = memory(
            mirrored_answers(outputs[:, step]), commands[:, step] * np.array([-1.0, 1.0], np.float32), turned
        )
        assert better == pytest.approx(mirrored_answers(reflected), abs=1e-6)


def test_its_slopes_are_those_of_the_loss() -> None:
    begins = np.zeros((6, 3), bool)
    begins[3, 1] = True
    stretches = Drives(some_outputs(6, 3, seed=4), some_targets(6, 3), some_commands(6, 3), begins)
    weights = {name: array.copy() for name, array in some_memory(6).weights.items()}
    # how far off it may be learns by another loss, which does not move what it is told of
    weights["answer"][:, 3:] = weights["answer_bias"][:, 3:] = 0.0
    slopes, _ = gradient(Memory(weights), stretches)
    for name in SHAPES:
        step = 2.0**-10 * np.sign(slopes[name])
        if name.startswith("answer"):
            step[:, 3:] = 0.0
        up, down = (gradient(Memory({**weights, name: weights[name] + way}), stretches)[1] for way in (step, -step))
        assert 0.5 * (up - down) * begins.size == pytest.approx((slopes[name] * step).sum(), rel=0.03), name


def test_what_came_before_a_beginning_teaches_nothing() -> None:
    begins = np.zeros((4, 2), bool)
    begins[2] = True
    whole = Drives(some_outputs(4, 2), some_targets(4, 2), some_commands(4, 2), begins)
    other = replace(whole, outputs=whole.outputs.copy(), commands=whole.commands.copy())
    other.outputs[:2], other.commands[:2] = some_outputs(2, 2, seed=9), some_commands(2, 2, seed=9)
    _, loss = gradient(some_memory(), replace(part_of(whole, slice(2, 4)), begins=np.zeros((2, 2), bool)))
    losses = [gradient(some_memory(), each)[1] * 4 for each in (whole, other)]
    early = [gradient(some_memory(), part_of(each, slice(0, 2)))[1] * 2 for each in (whole, other)]
    assert np.subtract(losses, early) == pytest.approx(2 * loss, rel=1e-5)


def part_of(drives: Drives, rows: slice) -> Drives:
    return Drives(*(array[rows] for array in vars(drives).values()))


def test_it_learns_what_was_told_of_half_of_the_stretches_and_looks_at_half_in_a_mirror() -> None:
    outputs, targets = some_outputs(STRETCH, 5), some_targets(STRETCH, 5)
    commands = np.random.default_rng(9).uniform(0.1, 0.5, (STRETCH, 5, 2)).astype(np.float32)
    before = commands.copy()
    some = _minibatch(
        [Drives(outputs, targets, commands, np.zeros((STRETCH, 5), bool))],
        np.random.default_rng(3),
    )
    withheld = np.isnan(some.commands).all(axis=(0, 2))
    assert (np.isnan(some.commands).any(axis=(0, 2)) == withheld).all()
    assert 0.3 < withheld.mean() < 0.7
    assert 0.2 < withheld[::2].mean() < 0.8  # not only of those in a mirror
    for place in range(some.outputs.shape[1]):
        seen, there, told = some.outputs[:, place], some.targets[:, place], some.commands[:, place]
        if place % 2 == 0:
            seen, there, told = mirrored_answers(seen), mirrored_answers(there), mirrored_commands(told)
        (car,) = np.flatnonzero((outputs == seen[:, None]).all(axis=(0, 2)))
        assert (targets[:, car] == there).all()
        assert withheld[place] or (commands[:, car] == told).all()
    assert (commands == before).all()  # what is remembered of drives stays as it was


@pytest.mark.costly
def test_it_learns_what_was_seen_before_and_the_same_bits_of_the_same() -> None:
    rng = np.random.default_rng(8)
    outputs = np.zeros((STRETCH, 64, NUM_OUTPUTS), np.float32)
    bends = list(NUMBERS).index("curvature_far")
    outputs[0, :, bends] = rng.choice([-1.0, 1.0], 64)
    targets = np.zeros((STRETCH, 64, NUM_TARGETS), np.float32)
    targets[..., bends] = outputs[..., bends]
    targets[..., 0] = 0.2 * outputs[0, :, bends]  # where the lens is, only a drive's first picture shows
    steering = rng.choice([-0.4, 0.4], (STRETCH, 64)).astype(np.float32)
    targets[..., 1] = 0.5 * steering  # how it is turned only commands tell
    commands = np.stack([steering, np.ones_like(steering)], axis=2)
    begins = np.zeros((STRETCH, 64), bool)
    losses: list[float] = []
    untaught = slopes_of(outputs.reshape(-1, NUM_OUTPUTS), targets.reshape(-1, NUM_TARGETS))[1]
    drives, lessons = [Drives(outputs, targets, commands, begins)], Lessons(updates=960)
    memory = taught(drives, lessons, tell=lambda _, loss: losses.append(loss))
    assert losses[-1] < untaught - 0.3
    off = []
    for told in (commands[0], -commands[0], unknown(64)):
        better, _ = memory(outputs[0], told, unseen(64))
        off.append(np.abs(better[:, 1] - targets[0, :, 1]).mean())
    assert off[0] + 0.01 < off[2] < off[1] - 0.01
    again = taught(drives, lessons)
    assert all((again.weights[name] == array).all() for name, array in memory.weights.items())


# --- what it is worth


@pytest.fixture(scope="module")
def perceiver() -> Perceiver:
    return Perceiver(num_threads=2)


@dataclass(frozen=True)
class Seen:
    """Pictures of roads that were never learned from, under strong conditions, of cars that drive by what is seen."""

    told: Belief
    """With memory that is told the commands."""
    remembered: Belief
    """With memory over the pictures alone."""
    alone: Belief
    """Of each picture by itself."""
    truth: NDArray[np.float32]


@pytest.fixture(scope="module")
def seen(perceiver: Perceiver) -> Seen:
    """Every fifth picture from the eighth of a drive on."""
    simulation = unseen_roads()
    truth, knowing, watcher = Truth(simulation), Watcher(perceiver), Watcher(perceiver)
    driver = PerceptionDriver(perceiver, autopilot=Autopilot(speed=1.5))
    targets, ages = [], np.zeros(96, int)
    kept: list[list[Belief]] = []
    for step in range(60):
        commands = driver(simulation.frames)
        simulation.step(commands)
        begins = simulation.terminated | simulation.truncated
        simulation.reset(begins)
        knowing.tell(commands)
        for one in (driver, knowing, watcher):
            one.forget(begins)
        ages = np.where(begins, 1, ages + 1)
        beliefs = [knowing(simulation.frames), watcher(simulation.frames)]
        if step % 5 == 4 and step > 7:
            beliefs.append(perceiver(simulation.frames))
            targets.append(truth.targets()[ages >= 8])
            kept.append([Belief(**{name: array[ages >= 8] for name, array in vars(one).items()}) for one in beliefs])
    together = [
        Belief(**{name: np.concatenate([vars(one)[name] for one in each]) for name in vars(each[0])})
        for each in zip(*kept, strict=True)
    ]
    return Seen(*together, np.concatenate(targets))


def errors_of(belief: Belief, truth: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """How far off it is: m and degrees."""
    found = {
        name: np.abs(vars(belief)[name] - truth[:, list(NUMBERS).index(name)] * NUMBERS[name])
        for name in ("offset", "heading", "heading_ahead")
    }
    return {name: error if name == "offset" else np.degrees(error) for name, error in found.items()}


@pytest.mark.costly
def test_with_memory_it_knows_the_roads_direction_beside_the_lens(seen: Seen) -> None:
    told, remembered, alone = (errors_of(each, seen.truth) for each in (seen.told, seen.remembered, seen.alone))
    assert len(seen.truth) > 500
    for errors in (told, remembered):
        assert np.percentile(errors["offset"], 90) <= 0.02
        assert np.percentile(errors["heading"], 90) <= 2.0
        assert np.percentile(errors["heading_ahead"], 90) <= 2.2
    assert np.percentile(alone["heading"], 90) > 4.0  # no single picture shows it


@pytest.mark.costly
def test_who_is_told_the_commands_knows_it_better(seen: Seen) -> None:
    told, remembered = (errors_of(each, seen.truth)["heading"] for each in (seen.told, seen.remembered))
    assert np.percentile(told, 90) < np.percentile(remembered, 90)
    assert told.mean() < 0.97 * remembered.mean()


@pytest.mark.costly
@pytest.mark.parametrize("who", ["told", "remembered"])
def test_with_memory_it_knows_how_far_off_it_may_be(seen: Seen, who: str) -> None:
    belief: Belief = getattr(seen, who)
    for name in ("offset", "heading", "heading_ahead"):
        error = np.abs(vars(belief)[name] - seen.truth[:, list(NUMBERS).index(name)] * NUMBERS[name])
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
def test_lenses_are_told_the_commands_since_the_picture_before_and_nobody_elses(perceiver: Perceiver) -> None:
    frames, told, memory = pictures(3), np.array([[0.3, 2.0], [-0.2, 1.0]], np.float32), perceiver.memory
    assert memory is not None
    outputs = perceiver.outputs(frames)
    wanted, state = memory(outputs, unknown(3), unseen(3))
    watcher = Watcher(perceiver)
    assert (watcher(frames).heading == believe(wanted).heading).all()
    watcher.tell(told, np.array([2, 0]))
    again, state = memory(outputs, np.array([told[1], [np.nan, np.nan], told[0]], np.float32), state)
    assert (watcher(frames).heading == believe(again).heading).all()
    last, _ = memory(outputs, unknown(3), state)  # what was told once is not told for ever
    assert (watcher(frames).heading == believe(last).heading).all()
    watcher.tell(told)
    watcher.forget(np.array([0, 1]))
    watcher.forget()
    watcher.tell(np.zeros((0, 2), np.float32))
    assert (watcher(frames).heading == believe(wanted).heading).all()


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
