"""Whatever a reward function does, the worker gives one clear error, in bounded time."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from workers import function, running

from alive_processes import is_alive
from racecraft.errors import RewardError
from racecraft.reward import worker as worker_module
from racecraft.reward.worker import MAX_BATCH

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
    (function("return numpy.array(['1.0'])", top="import numpy\n"), 3, "returned the text '1.0'"),
    (function("return numpy.array([None])", top="import numpy\n"), 3, "returned None"),
    (function("return numpy.zeros(2)", top="import numpy\n"), 3, "type ndarray"),
    (function("class Odd:", "    size, item = 1, 2", "return Odd()"), 4, "type Odd"),
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


@pytest.mark.skipif(np.lib.NumpyVersion(np.__version__) < "2.4.0", reason="this NumPy still makes a number of it")
def test_what_numpy_no_longer_makes_a_number_of_is_told_with_what_to_write_instead(track, rows):
    source = function("return float(numpy.array([params['x']]))", top="import numpy\n")
    with running(source, track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert "since 2.4" in caught.value.hint
    assert "array.item()" in caught.value.hint


HINTED = (
    (("there = params['objects_location']", "return there[0][0]"), ""),
    (("return params['objects_location'][0][0]",), "Choose a race with objects"),
    (("return 1.0 / [2.0, 3.0][params['steps']]",), "int(params['steps'])"),
    (("return float(sum(range(params['steps'])))",), "int(params['steps'])"),
    (("return params.has_key('speed')",), "Write 'speed' in params"),
    (("return [1.0][2]",), ""),
    (("return 1 / 0",), ""),
)


@pytest.mark.parametrize(("body", "hint"), HINTED)
def test_what_fails_here_as_at_aws_is_told_with_what_to_write_instead(track, rows, body, hint):
    with running(function(*body), track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert hint in caught.value.hint
    assert bool(hint) == bool(caught.value.hint)


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


@pytest.mark.costly
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
    assert time.perf_counter() - start < 30.0  # it would never end by itself; the machine may be busy
    assert not is_alive(process_id)


def test_a_busy_loop_is_ended_by_the_time_it_had_a_core(track, rows, monkeypatch):
    monkeypatch.setattr(worker_module, "PATIENCE", 200.0)  # by the wall it may take a minute
    monkeypatch.setattr(worker_module, "MOST_PATIENCE", 1e4)
    start = time.perf_counter()
    with running(function("while True: pass"), track, timeout_s=0.3) as worker, pytest.raises(RewardError):
        worker(rows)
    assert time.perf_counter() - start < 45.0


@pytest.mark.costly
def test_a_worker_that_gets_no_core_is_waited_for(track, rows):
    """A busy machine is no fault of the function: here its process stands still for three times its limit."""
    with running(function("return 1.0"), track, timeout_s=0.3) as worker:
        os.kill(worker.process_id, signal.SIGSTOP)
        wake = threading.Timer(0.9, os.kill, (worker.process_id, signal.SIGCONT))
        wake.start()
        try:
            assert worker(rows).sum() == 10.0
        finally:
            wake.join()


@pytest.mark.costly
def test_the_time_limit_is_for_one_call_and_not_for_the_batch(track, rows):
    source = function("import time", "time.sleep(0.12)", "return 1.0")
    with running(source, track, timeout_s=1.0) as worker:  # ten calls take longer; the machine may be busy
        assert worker(rows).sum() == 10.0


@pytest.mark.costly
def test_a_hang_in_the_middle_of_a_batch_names_its_row(track, rows):
    source = function("while params['x'] == 6.0:", "    pass", "return 1.0")
    with running(source, track, timeout_s=1.0) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert caught.value.row_index == 6
    assert caught.value.params["x"] == 6.0


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (("import os", "os._exit(3)"), "exit status 3"),
        (("import os", "os._exit(0)"), "exit status 0"),
        (("import os", "os.abort()"), "SIGSEGV"),  # it may not even send itself a signal
        (("import ctypes", "ctypes.string_at(0)"), "SIGSEGV"),
        (("import ctypes", "ctypes.pythonapi.syscall(101, 0, 0, 0, 0)"), "SIGSYS"),
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


@pytest.fixture
def many_open() -> Iterator[None]:
    """As in a server of many browsers: files get numbers that `select.select` does not take."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < 1400:
        pytest.skip("so many files cannot be open here")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 1400), hard))
    held = [os.open(os.devnull, os.O_RDONLY) for _ in range(1100)]
    yield
    for descriptor in held:
        os.close(descriptor)
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_crash_is_told_where_a_thousand_files_are_open(track, rows, many_open):
    crash = function("import ctypes", "return ctypes.string_at(0)")
    with running(crash, track) as worker, pytest.raises(RewardError, match="SIGSEGV") as caught:
        worker(rows)
    assert caught.value.line == 3


def test_killed_from_outside(track, rows):
    with running(function("return 1.0"), track) as worker:
        worker(rows)
        os.kill(worker.process_id, signal.SIGKILL)
        with pytest.raises(RewardError, match=r"SIGKILL \(killed from outside, or by the system"):
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


def test_no_descriptor_can_be_closed(track, rows):
    source = function("import os", "os.closerange(0, 100)", "return 1.0")
    with running(source, track) as worker:
        assert worker(rows).sum() == worker(rows).sum() == 10.0


@pytest.mark.parametrize(("written", "is_believed"), [("1e5", True), ("1e5 + 0.1", False), ("-1e6", False)])
def test_rewards_that_user_code_wrote_past_the_checks_are_checked_again(track, rows, written, is_believed):
    """It runs in the process that checks its rewards, so the trainer does not take that process's word."""
    source = function(
        "frame = sys._getframe()",
        "while 'self' not in frame.f_locals:",
        "    frame = frame.f_back",
        f"frame.f_locals['self']._rewards[0] = {written}",  # from the second row on, over what was good
        "return 1.0",
        top="import sys\n",
    )
    with running(source, track) as worker:
        if is_believed:
            assert worker(rows).tolist() == [1e5] + [1.0] * (len(rows) - 1)
        else:
            with pytest.raises(RewardError, match="wrote into its memory"):
                worker(rows)
