"""The same bits: for any batch, thread count and instruction set, after a reset of others, after load, in a mirror."""

from __future__ import annotations

import gc
import hashlib
import math
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np
import pytest

from racecraft import _native
from racecraft.errors import ShapeError
from racecraft.sim import CameraSpec, Simulation, Start, Vehicle
from racecraft.sim.saved_state import SEAL_BYTES
from racecraft.track import Track, load_track

OVAL = load_track("oval")
SMALL = CameraSpec(width=32, height=24)
MESSY = Start(mode="random", lateral_jitter=0.1, heading_jitter=0.3)
CARS = 64
STEPS = 60

# Rows, states and vehicles of 64 cars over 60 steps. Only a change of physics, rules or starts on purpose changes it.
GOLDEN = "1e3409bb1e23b3b58d8de05b1d7642a475ab0b00dc95c8268bc1ecf3773689d3"


def octagon() -> Track:
    """A track of literal numbers, so that the golden hash depends on no library."""
    corners = [[4, 0], [3, 2], [0, 3], [-3, 2], [-4, 0], [-3, -2], [0, -3], [3, -2], [4, 0]]
    return Track("octagon", *(scale * np.array(corners, dtype=float) for scale in (1.0, 0.875, 1.125)))


def drive(batch: int, num_threads: int, choose, record, *, camera: CameraSpec | None = None) -> str:
    """One hash of all that 64 cars did, driven in simulations of `batch` cars each."""
    digests = []
    for first in range(0, CARS, batch):
        cars = np.arange(first, min(first + batch, CARS))
        settings = {"start": MESSY, "direction": "alternate", "max_steps": 40, "num_threads": num_threads}
        simulation = Simulation(octagon(), num_envs=len(cars), camera=camera, **settings)
        simulation.reset(seeds=cars.astype(np.uint64))
        hashes = [hashlib.sha256() for _ in cars]
        for step in range(STEPS):
            simulation.step(choose(step, cars))
            for car_hash, seen in zip(hashes, record(simulation), strict=True):
                car_hash.update(seen)
            simulation.reset(simulation.terminated | simulation.truncated)
        digests += [car_hash.digest() for car_hash in hashes]
    return hashlib.sha256(b"".join(digests)).hexdigest()


@pytest.fixture
def every_isa():
    best = _native.isa()
    yield _native.available_isas()
    _native.set_isa(best)


@pytest.mark.parametrize("batch", [1, 7, 64])
@pytest.mark.parametrize("num_threads", [1, 2, 7])
def test_golden_hash(batch, num_threads, choose, record):
    assert drive(batch, num_threads, choose, record) == GOLDEN


def test_golden_hash_on_every_instruction_set(every_isa, choose, record):
    for isa in every_isa:
        _native.set_isa(isa)
        assert _native.isa() == isa
        assert drive(64, 1, choose, record) == GOLDEN


@pytest.mark.costly
def test_frames_do_not_depend_on_batch_threads_or_instruction_set(every_isa, choose, record):
    expected = drive(64, 1, choose, record, camera=SMALL)
    assert drive(7, 2, choose, record, camera=SMALL) == expected
    for isa in every_isa:
        _native.set_isa(isa)
        assert drive(64, 7, choose, record, camera=SMALL) == expected


@pytest.mark.costly
def test_the_environment_chooses_the_instruction_set_and_a_training_says_so():
    def train(isa):
        verb = [
            sys.executable,
            "-m",
            "racecraft",
            "train",
            "--track",
            "oval",
            "--num-envs",
            "8",
            "--until",
            "128 steps",
        ]
        with tempfile.TemporaryDirectory() as folder:
            return subprocess.run(
                verb, env={**os.environ, "RACECRAFT_ISA": isa}, cwd=folder, capture_output=True, text=True, check=False
            )

    best = _native.best_isa()
    if best != "portable":
        told = train("portable")
        assert told.returncode == 0
        first = told.stderr.splitlines()[0]
        assert first.startswith("The native core runs on the instruction set portable and not on this machine's")
    assert "instruction set" not in train(_native.available_isas()[-1]).stderr
    refused = train("sse9")
    assert refused.returncode != 0
    assert "'sse9' cannot run here" in refused.stderr


def test_an_unknown_instruction_set_is_refused():
    with pytest.raises(ValueError, match="'sse9' cannot run here; choose one of 'portable'"):
        _native.set_isa("sse9")


def test_the_same_seed_gives_the_same_bits_and_another_does_not(choose, record):
    def run(seed: int) -> list[bytes]:
        simulation = Simulation([OVAL, octagon()], num_envs=6, seed=seed, camera=SMALL, start=MESSY)
        for step in range(20):
            simulation.step(choose(step, np.arange(6)))
        return record(simulation)

    assert run(5) == run(5)
    assert all(a != b for a, b in zip(run(5), run(2**64 - 1), strict=True))


def test_a_reset_of_some_leaves_the_others_untouched(choose, record):
    cars = np.arange(9)
    one, other = (Simulation(OVAL, num_envs=9, camera=SMALL, start=MESSY) for _ in range(2))
    mask = np.array([False, True, False] * 3)
    for step in range(30):
        one.step(choose(step, cars))
        other.step(choose(step, cars))
        if step % 7 == 3:
            before = record(other)
            other.reset(mask)
            after = record(other)
            for car in cars:
                assert (before[car] == after[car]) == (not mask[car])
        assert [r for r, m in zip(record(one), mask, strict=True) if not m] == [
            r for r, m in zip(record(other), mask, strict=True) if not m
        ]


def test_load_goes_on_to_the_bit(choose, record):
    settings = {"num_envs": 7, "camera": SMALL, "start": MESSY, "direction": "alternate", "max_steps": 25}
    one, other = Simulation([OVAL, octagon()], **settings), Simulation([OVAL, octagon()], seed=9, **settings)
    one.parameters[0] *= 1.1
    one.track_choice[2] = 0
    for step in range(80):
        one.step(choose(step, np.arange(7)))
        if step == 30:
            other.load(one.save())
        if step >= 30:
            if step > 30:
                other.step(choose(step, np.arange(7)))
            assert record(one) == record(other)
        for simulation in (one, other):
            simulation.reset(simulation.terminated | simulation.truncated)
    assert (one.save() == other.save()).all()


def test_foreign_bytes_are_refused_and_change_nothing(choose, record):
    simulation = Simulation(OVAL, num_envs=2, camera=SMALL)
    simulation.step(choose(0, np.arange(2)))
    good, before = simulation.save(), record(simulation)
    for bad in (good[:-1], np.zeros(0, np.uint8), np.full_like(good, 255), Simulation(OVAL, num_envs=3).save()):
        with pytest.raises(ShapeError):
            simulation.load(bad)
        assert record(simulation) == before


def test_the_bytes_of_another_track_are_refused_and_change_nothing(choose, record):
    simulation = Simulation([OVAL, octagon()], num_envs=2, camera=SMALL)
    simulation.step(choose(0, np.arange(2)))
    before = record(simulation)
    for tracks in ([octagon(), OVAL], [moved(OVAL, 0.0, (0.0, 0.0), scale=1.001), octagon()]):
        with pytest.raises(ShapeError, match="was saved on another track"):
            simulation.load(Simulation(tracks, num_envs=2, camera=SMALL).save())
        assert record(simulation) == before


def test_a_track_of_the_same_length_is_another_one_and_a_state_without_a_seal_is_still_taken(choose, record):
    simulation = Simulation(octagon(), num_envs=2, camera=SMALL)
    simulation.step(choose(0, np.arange(2)))
    before = record(simulation)
    turned = Simulation(moved(octagon(), math.pi / 2, (0.0, 0.0)), num_envs=2, camera=SMALL)
    assert turned.tracks[0].length == pytest.approx(simulation.tracks[0].length, abs=1e-9)
    with pytest.raises(ShapeError, match="was saved on another track"):
        simulation.load(turned.save())
    assert record(simulation) == before
    sealed = simulation.save()
    simulation.step(choose(1, np.arange(2)))
    simulation.load(sealed[:-SEAL_BYTES])  # as versions before it wrote it, and as the tab does
    assert record(simulation) == before
    assert (simulation.save() == sealed).all()


# --- symmetry


def moved(
    track: Track, angle: float, shift: tuple[float, float], *, mirrored: bool = False, scale: float = 1.0
) -> Track:
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    flip = np.array([1.0, -1.0 if mirrored else 1.0])
    return Track(
        "moved", *((scale * line * flip) @ rotation.T + shift for line in (track.centerline, track.inner, track.outer))
    )


@pytest.mark.parametrize(("angle", "shift"), [(0.0, (3.0, -7.0)), (1.0, (0.0, 0.0)), (-2.5, (-5.0, 2.0))])
def test_a_world_moved_and_turned_is_the_same_world(angle, shift, choose):
    cars = np.arange(1, 9)
    one, other = (Simulation(track, num_envs=8, camera=SMALL) for track in (OVAL, moved(OVAL, angle, shift)))
    for step in range(25):
        one.step(choose(step, cars))
        other.step(choose(step, cars))
        np.testing.assert_allclose(one.column("progress"), other.column("progress"), atol=1e-5)
        np.testing.assert_allclose(one.column("offset"), other.column("offset"), atol=1e-4)
        np.testing.assert_allclose(one.vehicles[3:], other.vehicles[3:], atol=1e-3)
        np.testing.assert_array_equal(one.terminated, other.terminated)
        np.testing.assert_allclose(one.state, other.state, atol=2e-2)
    # The room's walls follow the axes of the world, so only the ground in front of the car is the same.
    difference = np.abs(one.frames[:, 12:].astype(int) - other.frames[:, 12:].astype(int))
    assert np.median(difference) <= 1
    assert difference.mean() < 3.0


def test_a_mirrored_car_on_a_mirrored_track_is_the_mirror_image(choose):
    mirror_image, straight = moved(OVAL, 0.0, (0.0, 0.0), mirrored=True), Vehicle(steering_bias=0.0)
    one, other = (Simulation(track, num_envs=8, camera=SMALL, vehicle=straight) for track in (OVAL, mirror_image))
    cars = np.arange(1, 9)
    for step in range(40):
        actions = choose(step, cars)
        one.step(actions)
        other.step(actions * np.float32([-1, 1]))
        flip = np.array([1, -1, -1, 1, -1, -1, -1], dtype=np.float32)[:, None]
        np.testing.assert_array_equal(one.vehicles, flip * other.vehicles)  # to the bit
        np.testing.assert_array_equal(one.column("progress"), other.column("progress"))
        np.testing.assert_array_equal(one.column("offset"), -other.column("offset"))
        for column in ("all_wheels_on_track", "status", "steps", "closest_prev", "track_width"):
            np.testing.assert_array_equal(one.column(column), other.column(column))


# --- memory and threads


@pytest.mark.costly
def test_views_keep_the_core_alive():
    simulation = Simulation(OVAL, num_envs=3, camera=SMALL)
    frames, rows, terminated = simulation.frames, simulation.rows, simulation.terminated
    expected = frames.copy(), rows.copy()
    del simulation
    gc.collect()
    for _ in range(20):
        Simulation(octagon(), num_envs=3, camera=SMALL)
    assert (frames == expected[0]).all()
    assert (rows == expected[1]).all()
    assert not terminated.any()


def test_other_threads_run_during_a_step():
    simulation = Simulation(OVAL, num_envs=2000, num_threads=1, start=Start(spread=True))
    actions = np.tile(np.float32([0.0, 0.1]), (2000, 1))
    ticks, stop = [], threading.Event()

    def tick() -> None:
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    ticker = threading.Thread(target=tick)
    ticker.start()
    begin = time.perf_counter()
    simulation.step(actions)
    end = time.perf_counter()
    stop.set()
    ticker.join()
    assert sum(begin < t < end for t in ticks) >= 2


def test_calls_from_several_threads_wait_for_each_other():
    simulation = Simulation(OVAL, num_envs=16, camera=SMALL, num_threads=2)
    errors: list[Exception] = []

    def use() -> None:
        try:
            for _ in range(30):
                simulation.step(np.zeros((16, 2)))
                simulation.reset(simulation.terminated)
                simulation.load(simulation.save())
        except Exception as error:  # to be shown by the test's own thread
            errors.append(error)

    users = [threading.Thread(target=use) for _ in range(3)]
    for user in users:
        user.start()
    for user in users:
        user.join(timeout=60)
        assert not user.is_alive()
    assert errors == []


@pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning")  # from Python 3.12 on
def test_a_forked_child_steps_to_the_same_bits_and_ends():
    simulation = Simulation(OVAL, num_envs=64, camera=SMALL, num_threads=2)
    actions = np.tile([0.2, 2.0], (64, 1))
    simulation.step(actions)
    begun = simulation.save()

    def bits() -> bytes:
        for _ in range(5):
            simulation.step(actions)
        return b"".join(a.tobytes() for a in (simulation.rows, simulation.vehicles, simulation.frames))

    def drive_and_drop() -> None:
        nonlocal simulation
        there.send_bytes(bits())
        del simulation
        gc.collect()

    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    child = context.Process(target=drive_and_drop, daemon=True)
    child.start()
    try:
        assert here.poll(30)
        found = here.recv_bytes()
        child.join(30)
        assert child.exitcode == 0
    finally:
        child.kill()
        child.join()
    simulation.load(begun)
    assert bits() == found


def test_a_car_takes_little_memory():
    assert Simulation(OVAL, num_envs=1000).num_bytes / 1000 - 160 * 120 < 25_000
    assert Simulation(OVAL, num_envs=1000, camera=None).num_bytes / 1000 < 1_000


def peak_memory() -> int:
    """Bytes; the peak of the process, which a leak pushes up for ever."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


@pytest.mark.costly
def test_a_thousand_simulations_leave_nothing_behind():
    track = octagon()
    for _ in range(100):
        Simulation(track, num_envs=20, camera=SMALL, num_threads=2).step(np.zeros((20, 2)))
    before = peak_memory()
    for _ in range(1000):
        Simulation(track, num_envs=20, camera=SMALL, num_threads=2).step(np.zeros((20, 2)))
    assert peak_memory() - before < 5_000_000
