"""What a worker gives for its rows, what it refuses of its caller, and how it ends."""

from __future__ import annotations

import contextlib
import gc
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from workers import function, running

from alive_processes import is_alive
from racecraft.errors import ConfigError, RewardError, ShapeError
from racecraft.reward import worker_process
from racecraft.reward.source import load_preset
from racecraft.reward.worker import MAX_BATCH, RewardWorker
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track.track import Track


def test_rewards_are_those_of_the_function_called_here(track, rows):
    source = load_preset("centerline")
    with running(source, track) as worker:
        rewards = worker(rows)
    assert rewards.dtype == np.float64
    assert rewards.tolist() == [1.0, 1.0, 0.5, 0.5, 0.5, 0.1, 0.1, 0.1, 0.1, 1e-3]


def test_several_threads_may_ask_it(track, rows):
    with running(function("return params['steps']"), track) as worker, ThreadPoolExecutor(4) as threads:
        batches = [np.tile(rows[:1], (count, 1)) for count in range(1, 121)]
        for number, batch in enumerate(batches):
            batch[:, ROW_COLUMNS.index("steps")] = 2 + number
        for number, rewards in enumerate(threads.map(worker, batches)):
            assert rewards.tolist() == [2.0 + number] * (number + 1)


@pytest.mark.parametrize(
    ("expression", "expected"),
    [("True", 1.0), ("7", 7.0), ("-0.0", 0.0), ("1e5", 1e5), ("-1e5", -1e5), ("10**5", 1e5)],
)
def test_numbers_are_taken_as_floats(track, rows, expression, expected):
    with running(function(f"return {expression}"), track) as worker:
        assert worker(rows[:1]).tolist() == [expected]


@pytest.mark.parametrize(
    "expression",
    [
        *("np.float32(0.5)", "np.float64(0.5)", "np.array(0.5)", "np.array([0.5])", "np.array([[0.5]], np.float32)"),
        *("np.ones(1, bool) / 2", "Decimal('0.5')", "Fraction(1, 2)"),
    ],
)
def test_scalars_of_other_libraries_are_taken_as_floats(track, rows, expression):
    top = "import numpy as np\nfrom decimal import Decimal\nfrom fractions import Fraction\n"
    with running(function(f"return {expression}", top=top), track) as worker:
        assert worker(rows[:2]).tolist() == [0.5, 0.5]


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(0, 40), max_size=6), seed=st.integers(0, 2**32 - 1))
def test_any_split_into_batches_gives_the_same_rewards(shared_worker, cuts, seed):
    rng = np.random.default_rng(seed)
    batch = rng.uniform(0.0, 0.9, (40, len(ROW_COLUMNS)))
    whole = shared_worker(batch)
    parts = np.split(batch, sorted(cuts))
    assert np.concatenate([shared_worker(part) for part in parts]).tobytes() == whole.tobytes()


@pytest.fixture(scope="module")
def shared_worker(track):
    with RewardWorker(load_preset("racing"), track) as worker:
        yield worker


def test_batches_larger_than_the_shared_memory(track, rows):
    many = np.tile(rows, (MAX_BATCH // 10 + 7, 1))
    with running(function("return params['x'] + params['steps']"), track) as worker:
        assert np.array_equal(worker(many), many[:, 2] + many[:, 1])
        assert worker(many[:0]).shape == (0,)


def test_the_result_belongs_to_the_caller(track, rows):
    with running(function("return params['x']"), track) as worker:
        first = worker(rows)
        worker(rows[::-1])
    assert np.array_equal(first, rows[:, 2])


def test_waypoints_of_several_tracks_and_directions(track, make_row):
    line = np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [0.0, 0.0]])
    other = Track("triangle", line, 0.9 * line, 1.1 * line)
    rows = np.stack([make_row(track_index=i) for i in range(4)])
    with running(
        function("return 100 * len(params['waypoints']) + params['waypoints'][1][0]"), [track, other]
    ) as worker:
        rewards = worker(rows)
    line = track.centerline
    assert rewards.tolist() == [2500 + line[1, 0], 409.0, 2500 + line[-2, 0], 400.0]


def test_the_prepare_step_has_no_reward_and_no_call(track, make_row):
    assert ROW_COLUMNS[worker_process.STEPS] == "steps"
    rows = np.stack([make_row(steps=1.0, status=0.0), make_row(), make_row(steps=1.0, status=0.0), make_row()])
    source = function("global calls", "calls += 1", "return calls", top="calls = 0\n")
    with running(source, track) as worker:
        assert worker(rows).tolist() == [0.0, 1.0, 0.0, 2.0]


def test_changes_to_params_do_not_reach_the_next_call(track, rows):
    body = (
        "assert len(params['waypoints']) == 25 and params['closest_waypoints'] == [0, 1]",
        "assert params['objects_location'] == [] and 'mine' not in params and params['speed'] == 1.0",
        "params['mine'] = params['speed'] = 9",
        "params['waypoints'].clear(); params['closest_waypoints'].reverse()",
        "params['objects_location'].append((1, 2)); params['closest_objects'][0] = 5",
        "return params['closest_objects'][0]",
    )
    with running(function(*body), track) as worker:
        assert worker(rows).tolist() == [5.0] * 10
        assert worker(rows).tolist() == [5.0] * 10


def test_globals_live_on_between_calls(track, rows):
    source = function("global calls", "calls += 1", "return calls", top="calls = 0\n")
    with running(source, track) as worker:
        assert worker(rows[:3]).tolist() == [1.0, 2.0, 3.0]
        assert worker(rows[:2]).tolist() == [4.0, 5.0]


def test_each_car_can_have_its_own_globals(track, rows):
    source = function("global calls", "calls += 1", "return calls", top="calls = 0\n")
    with running(source, track, num_cars=5) as worker:
        assert worker(rows[:5]).tolist() == [1.0] * 5
        assert worker(rows[:10]).tolist() == [2.0] * 5 + [3.0] * 5


@pytest.mark.costly
def test_random_numbers_repeat_with_the_seed(track, rows):
    top = "import random\nimport numpy as np\nshift = random.random()\n"
    source = function("return shift + random.random() + np.random.rand() + hash('a') % 7", top=top)
    results = []
    for seed in (1, 1, 2):
        with running(source, track, seed=seed) as worker:
            results.append(worker(rows).tolist())
    assert results[0] == results[1] != results[2]


def test_dataclasses_enums_and_imports_inside_functions(track, rows):
    top = (
        "from __future__ import annotations\nfrom dataclasses import dataclass, field\nimport enum\n"
        "@dataclass\nclass Memory:\n    speeds: list[float] = field(default_factory=list)\nmemory = Memory()\n"
    )
    source = function("import math", "memory.speeds.append(1.0)", "return math.floor(len(memory.speeds))", top=top)
    with running(source, track) as worker:
        assert worker(rows[:3]).tolist() == [1.0, 2.0, 3.0]


@pytest.mark.costly
def test_scientific_packages_are_at_hand(track, rows):
    top = "import numpy, scipy.spatial, shapely\n"
    source = function("return shapely.LineString(params['waypoints']).length", top=top)
    with running(source, track, timeout_s=5.0) as worker:
        assert worker(rows[:1])[0] == pytest.approx(track.length)


@pytest.mark.parametrize("shape", [(24,), (3, 23), (3, 25), (2, 3, 24), ()])
def test_wrong_shapes(shared_worker, shape):
    with pytest.raises(ShapeError, match="expected"):
        shared_worker(np.zeros(shape))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_rows_that_are_not_finite(shared_worker, rows, value):
    bad = rows.copy()
    bad[4, 5] = value
    with pytest.raises(ShapeError, match="NaN or infinity"):
        shared_worker(bad)


@pytest.mark.parametrize(
    "options", [{"timeout_s": 0}, {"timeout_s": float("nan")}, {"num_cars": 0}, {"memory_limit_mb": 1}]
)
def test_options_out_of_range(track, options):
    with pytest.raises(ConfigError, match=next(iter(options))):
        RewardWorker(load_preset("racing"), track, **options)


@pytest.mark.parametrize("index", [-1.0, 2.0, 1e9])
def test_rows_of_another_track(shared_worker, make_row, index):
    with pytest.raises(ShapeError, match="track_index"):
        shared_worker(np.stack([make_row(track_index=0), make_row(track_index=index)]))
    assert shared_worker(make_row()[None]).shape == (1,)


def test_closing(track, rows):
    worker = RewardWorker(function("return 1.0"), track)
    process_id = worker.process_id
    worker.close()
    worker.close()
    assert not is_alive(process_id)
    with pytest.raises(RewardError, match="closed"):
        worker(rows)


def test_a_forgotten_worker_ends_with_its_object(track):
    worker = RewardWorker(function("return 1.0"), track)
    process_id = worker.process_id
    del worker
    gc.collect()
    assert not is_alive(process_id)


def test_no_descriptor_leaks(track, rows):
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    for source in [function("return 1.0"), function("return None")] * 3:
        with running(source, track) as worker, contextlib.suppress(RewardError):
            worker(rows)
    with contextlib.suppress(RewardError):
        RewardWorker("x", track)
    del worker  # its log stays readable after the end
    if before:
        assert len(os.listdir("/proc/self/fd")) == before
