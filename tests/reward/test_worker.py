"""Whatever a reward function does, the worker gives rewards or one clear error, in bounded time."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecraft.errors import ConfigError, RewardError, ShapeError
from racecraft.reward import worker_process
from racecraft.reward.source import load_preset
from racecraft.reward.worker import LOG_BYTES, MAX_BATCH, RewardWorker
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.track.track import Track

INDENT = "    "


def function(*body: str, top: str = "") -> str:
    """The source of a reward function with this body; the body starts in line 2, after the top's lines."""
    return top + "def reward_function(params):\n" + "".join(f"{INDENT}{line}\n" for line in body)


@contextlib.contextmanager
def running(source, track, **options):
    options = {"timeout_s": 1.0} | options
    with RewardWorker(source, track, **options) as worker:
        yield worker


# --- results


def test_rewards_are_those_of_the_function_called_here(track, rows):
    source = load_preset("centerline")
    with running(source, track) as worker:
        rewards = worker(rows)
    assert rewards.dtype == np.float64
    assert rewards.tolist() == [1.0, 1.0, 0.5, 0.5, 0.5, 0.1, 0.1, 0.1, 0.1, 1e-3]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [("True", 1.0), ("7", 7.0), ("-0.0", 0.0), ("1e5", 1e5), ("-1e5", -1e5), ("10**5", 1e5)],
)
def test_numbers_are_taken_as_floats(track, rows, expression, expected):
    with running(function(f"return {expression}"), track) as worker:
        assert worker(rows[:1]).tolist() == [expected]


@pytest.mark.parametrize(
    "expression", ["np.float32(0.5)", "np.float64(0.5)", "np.array(0.5)", "Decimal('0.5')", "Fraction(1, 2)"]
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


def test_scientific_packages_are_at_hand(track, rows):
    top = "import numpy, scipy.spatial, shapely\n"
    source = function("return shapely.LineString(params['waypoints']).length", top=top)
    with running(source, track, timeout_s=5.0) as worker:
        assert worker(rows[:1])[0] == pytest.approx(track.length)


# --- prints


def test_prints_are_kept_and_disturb_nothing(track, rows):
    source = function(
        "print('at', params['x'])", "import sys, os", "sys.stderr.write('!')", "os.write(1, b'x'); return 1.0"
    )
    with running(source, track) as worker:
        assert worker(rows[:2]).tolist() == [1.0, 1.0]
        assert worker.read_log() == "at 0.0\n!at 1.0\n!"
        assert worker.read_log() == ""
        worker(rows[5:6])
        assert worker.read_log() == "at 5.0\n!"


def test_huge_prints_keep_the_end(track, rows):
    source = function("print('é' * 10**6, params['steps'])", "return 0.0")
    with running(source, track) as worker:
        for _ in range(3):
            worker(rows)
        log = worker.read_log()
    assert log.endswith("é 11.0\n")
    assert LOG_BYTES - 2 <= len(log.encode()) <= LOG_BYTES + 2


def test_what_was_too_much_at_once_is_counted(track, rows):
    source = function("print('x' * 999)", "return 0.0")  # 1,000 bytes with the line's end
    with running(source, track) as worker:
        worker(rows)
        assert (len(worker.read_log()), worker.num_lost) == (10_000, 0)
        for _ in range(7):
            worker(rows)
        assert (len(worker.read_log()), worker.num_lost) == (LOG_BYTES, 70_000 - LOG_BYTES)
        assert (worker.read_log(), worker.num_lost) == ("", 0)


def test_an_error_shows_what_was_printed_last(track, rows):
    source = function(
        "print('call', params['steps'], '\\x1b[31m' + 'y' * 300)", "print()", "return 1.0 if params['x'] < 7 else None"
    )
    with running(source, track) as worker:
        with pytest.raises(RewardError) as caught:
            worker(rows)
        lines = str(caught.value).partition("It printed last:\n")[2].splitlines()
        assert [line.split()[:2] for line in lines] == [["call", f"{step}.0"] for step in (5, 6, 7, 8, 9)]
        assert all(line.isprintable() and 200 <= len(line) < 220 for line in lines)
        assert worker.read_log().count("call") == 8  # it is still there to be kept


def test_an_error_of_a_silent_function_does_not_speak_of_prints(track, rows):
    with running(function("return None"), track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert "printed" not in str(caught.value)


# --- errors in the function

FAULTS = [
    (function("x = 1", "return x / 0"), 3, "ZeroDivisionError: division by zero"),
    (function("return params['speeed']"), 2, "KeyError: 'speeed'"),
    (function("return nothing"), 2, "NameError"),
    (function("pass"), 2, "returned None"),
    (function("if params['x'] < 0:", "    return 1.0"), 2, "returned None"),
    (function("return float('nan')"), 2, "returned nan"),
    (function("x = float('inf')", "return -x"), 3, "returned -inf"),
    (function("return 100000.1"), 2, "returned 100000.1"),
    (function("return -10**6"), 2, "returned -1000000.0"),
    (function("return 10**400"), 2, "type int, which is not a number"),
    (function("return 'fast'"), 2, "returned the text 'fast'"),
    (function("return '1.0'"), 2, "returned the text '1.0'"),
    (function("return [1.0]"), 2, "type list"),
    (function("return 1j"), 2, "type complex"),
    (function("return lambda: 1"), 2, "type function"),
    (function("yield 1.0"), -1, "type generator"),
    ("async def reward_function(params):\n    return 1.0", -1, "type coroutine"),
    (function("return reward_function(params)"), 2, "RecursionError"),
    (
        function("return helper()", top="def helper():\n    raise ValueError('deep\\ndown')\n"),
        2,
        "ValueError: deep down",
    ),
    (function("import sys", "sys.exit(3)"), 3, "called sys.exit(3)"),
    (function("raise KeyboardInterrupt"), 2, "KeyboardInterrupt"),
    (function("raise SystemExit"), 2, "called sys.exit()"),
    (function("return [0] * 10**11"), 2, "MemoryError"),
    (function("x = bytearray(3 * 10**9)", "return 1.0"), 2, "MemoryError"),
    (function("open('/tmp/racecraft-test', 'w').write('x' * 10000)", "return 1.0"), 2, "may not write files"),
    (function("open('/dev/null', 'r+b')", "return 1.0"), 2, "may not write files"),
    (function("import os", "os.open('/dev/null', os.O_WRONLY)", "return 1.0"), 3, "may not write files"),
    (function("import os", "os.remove('/racecraft-test')", "return 1.0"), 3, "may not use os.remove"),
    (function("import os", "os.rename('/racecraft-test', '/x')", "return 1.0"), 3, "may not use os.rename"),
    (function("import os", "os.mkdir('/racecraft-test')", "return 1.0"), 3, "may not use os.mkdir"),
    (function("import os", "os.fork()", "return 1.0"), 3, "may not use os.fork"),
    (function("import subprocess", "subprocess.run(['true'])", "return 1.0"), 3, "may not use"),
    (function("import os", "os.kill(os.getppid(), 9)", "return 1.0"), 3, "may not use os.kill"),
    (function("import socket", "socket.socket()", "return 1.0"), 3, "may not use socket"),
    (function("class Bad(Exception):", "    def __str__(self): raise self", "raise Bad"), 4, "Bad"),
    (function("raise ValueError('x' * 10**7)"), 2, "ValueError: xxx"),
]


@pytest.mark.parametrize(("source", "line", "text"), FAULTS, ids=[text for _, _, text in FAULTS])
def test_errors_name_line_and_params(track, rows, source, line, text):
    with running(source, track) as worker:
        with pytest.raises(RewardError) as caught:
            worker(rows[3:])
        error = caught.value
        assert text in str(error)
        assert error.row_index == 0
        assert error.params is not None
        assert error.params["x"] == 3.0
        assert len(error.params["waypoints"]) == 25
        assert "'x': 3.0" in str(error)
        assert len(str(error)) < 4000
        if line > 0:
            assert error.line == line
            assert f"line {line}" in str(error)
            assert source.splitlines()[line - 1].strip() in str(error)
        with pytest.raises(RewardError, match="cannot be called again"):
            worker(rows)


def test_the_row_at_fault_is_named(track, rows):
    many = np.tile(rows, (MAX_BATCH // 10 + 1, 1))
    many[:, 2] = np.arange(len(many))
    with (
        running(function("return 1.0 / (params['x'] - 4099)"), track) as worker,
        pytest.raises(RewardError) as caught,
    ):
        worker(many)
    assert caught.value.row_index == 4099
    assert caught.value.params["x"] == 4099.0


@pytest.mark.parametrize(
    ("body", "line"),
    [
        (("while True:", "    pass"), (2, 3)),
        (("return 9**9**9",), (2,)),
        (("import time", "time.sleep(99)"), (3,)),
    ],
)
def test_a_hang_is_ended(track, rows, body, line):
    start = time.perf_counter()
    with running(function(*body), track, timeout_s=0.3) as worker:
        process_id = worker.process_id
        with pytest.raises(RewardError, match=r"did not return within 0\.3 s") as caught:
            worker(rows)
    assert caught.value.line in line
    assert caught.value.row_index == 0
    assert time.perf_counter() - start < 3.0
    assert not _exists(process_id)


def test_the_time_limit_is_for_one_call_and_not_for_the_batch(track, rows):
    source = function("import time", "time.sleep(0.12)", "return 1.0")
    with running(source, track, timeout_s=0.3) as worker:
        assert worker(rows).sum() == 10.0


def test_a_hang_in_the_middle_of_a_batch_names_its_row(track, rows):
    source = function("while params['x'] == 6.0:", "    pass", "return 1.0")
    with running(source, track, timeout_s=0.2) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert caught.value.row_index == 6
    assert caught.value.params["x"] == 6.0


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (("import os", "os._exit(3)"), "exit status 3"),
        (("import os", "os._exit(0)"), "exit status 0"),
        (("import os", "os.abort()"), "SIGABRT"),
        (("import faulthandler", "faulthandler._sigsegv()"), "SIGSEGV"),
    ],
)
def test_a_crash_is_told(track, rows, body, text):
    with running(function("if params['x'] < 2: return 1.0", *body), track) as worker:
        with pytest.raises(RewardError, match=text) as caught:
            worker(rows)
        assert caught.value.row_index == 2
        with pytest.raises(RewardError, match="cannot be called again"):
            worker(rows)


def test_endless_recursion_in_c_is_told_with_its_line(track, rows):
    top = "import sys\nsys.setrecursionlimit(10**9)\nclass A:\n    def __repr__(self): return repr(self) + repr(A())\n"
    with (
        running(function("return repr(A())", top=top), track) as worker,
        pytest.raises(RewardError) as caught,
    ):
        worker(rows)
    assert caught.value.line in (4, 6)


def test_killed_from_outside(track, rows):
    with running(function("return 1.0"), track) as worker:
        worker(rows)
        os.kill(worker.process_id, signal.SIGKILL)
        with pytest.raises(RewardError, match="SIGKILL"):
            worker(rows)


def test_a_memory_bomb_ends(track, rows):
    source = function("x = []", "while True: x.append(bytearray(10**7))")
    options = {"timeout_s": 10.0, "memory_limit_mb": 300}
    with running(source, track, **options) as worker, pytest.raises(RewardError, match="MemoryError") as caught:
        worker(rows)
    assert caught.value.line == 3


@pytest.mark.parametrize("junk", ["b'x'", "b'\\\\x02' * 13", "b'\\\\x03' * 13", "b'junk' * 50"])
def test_writing_into_the_pipes_is_no_reward(track, rows, junk):
    source = function(
        "for descriptor in range(3, 20):",
        "    try: os.write(descriptor, " + junk.replace("\\\\", "\\") + ")",
        "    except OSError: pass",
        "os._exit(0)",
        top="import os\n",
    )
    with running(source, track) as worker, pytest.raises(RewardError):
        worker(rows)


def test_closing_every_descriptor_is_an_error(track, rows):
    source = function("import os", "os.closerange(0, 100)", "return 1.0")
    with running(source, track) as worker, pytest.raises(RewardError):
        worker(rows)


# --- loading


@pytest.mark.parametrize(
    ("source", "line", "text"),
    [
        ("def reward_function(params:\n    return 1", 1, "SyntaxError"),
        ("x = 1\n y = 2", 2, "IndentationError"),
        ("x = 1", None, "no function 'reward_function"),
        ("reward_function = 3", None, "no function 'reward_function"),
        ("import nothing_like_this\n" + function("return 1.0"), 1, "ModuleNotFoundError"),
        ("x = 1\nraise ValueError('no')\n" + function("return 1.0"), 2, "ValueError: no"),
        ("import os\nos._exit(5)", None, "exit status 5"),
        ("import sys\nsys.exit()", 2, "sys.exit"),
        ("", None, "no function"),
        ("x = '\0'", None, "null bytes"),
    ],
)
def test_a_source_that_does_not_load(track, source, line, text):
    with pytest.raises(RewardError, match=r"before the first call") as caught:
        RewardWorker(source, track)
    assert text in str(caught.value)
    assert caught.value.line == line
    assert caught.value.row_index is None
    assert caught.value.params is None


def test_a_missing_package_says_how_to_get_it(track, monkeypatch):
    monkeypatch.setattr("racecraft.reward.launch.package_paths", list)
    with pytest.raises(RewardError, match=r"needs shapely, which is not installed here: pip install shapely") as caught:
        RewardWorker("import math\nimport shapely\n" + function("return 1.0"), track)
    assert caught.value.line == 2


def test_a_source_that_hangs_while_it_loads(track):
    with pytest.raises(RewardError, match=r"within 0\.3 s") as caught:
        RewardWorker("x = 1\nwhile True: pass", track, start_timeout_s=0.3)
    assert caught.value.line == 2


def test_racecraft_and_the_environment_are_out_of_reach(track, rows, monkeypatch):
    monkeypatch.setenv("RACECRAFT_TEST_SECRET", "1")
    source = function(
        "import os, sys", "return float('RACECRAFT_TEST_SECRET' in os.environ) + ('racecraft' in sys.modules)"
    )
    with running(source, track) as worker:
        assert worker(rows[:1]).tolist() == [0.0]


# --- the caller's mistakes


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
        shared_worker(make_row(track_index=index)[None])
    assert shared_worker(make_row()[None]).shape == (1,)


def test_closing(track, rows):
    worker = RewardWorker(function("return 1.0"), track)
    process_id = worker.process_id
    worker.close()
    worker.close()
    assert not _exists(process_id)
    with pytest.raises(RewardError, match="closed"):
        worker(rows)


def test_a_forgotten_worker_ends_with_its_object(track):
    worker = RewardWorker(function("return 1.0"), track)
    process_id = worker.process_id
    del worker
    gc.collect()
    assert not _exists(process_id)


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


def _exists(process_id: int) -> bool:
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    return True
