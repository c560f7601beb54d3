"""The trainer believes nothing: whatever the worker writes into its pipes and memory, there is one `RewardError`, soon.

The worker has walls, and still the two pipes, the memory and the time that it was given. Here its own `Server`, dug up
from the interpreter's memory, is turned against the caller.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time

import numpy as np
import pytest
from workers import function, running

from racecraft.errors import RewardError
from racecraft.reward import worker as worker_module
from racecraft.reward.sandbox import UNCONFINED

DIG = """
import gc, os, struct, time
server = next(thing for thing in gc.get_objects() if type(thing).__name__ == "Server")
descriptors = range(3, 40)

def everywhere(data):
    for descriptor in descriptors:
        try: os.write(descriptor, data)
        except OSError: pass

def reply(status, row=0, line=-1, size=0):
    os.write(server._replies, struct.pack("<BIiI", status, row, line, size))
"""
TIMEOUT_S = 0.3


def hostile(*body: str) -> str:
    return function(*body, top=DIG)


@pytest.mark.parametrize(
    ("body", "text"),
    [
        (("reply(2)", "reply(2)", "os._exit(0)"), "without all rewards"),
        (("reply(1)", "return 1.0"), "makes no sense"),
        (("reply(4)", "return 1.0"), "makes no sense"),
        (("reply(77)", "return 1.0"), "makes no sense"),
        (("reply(3, row=10**9)", "return 1.0"), "makes no sense"),
        (("reply(3, size=2**32 - 1)", "return 1.0"), "makes no sense"),
        (("reply(3, row=3, line=2**31 - 1, size=8192)", "return 1.0"), "reward_function.py"),
        (("reply(3, row=3, line=-2**31, size=0)", "return 1.0"), "reward_function.py"),
        (("os.write(server._replies, b'x')", "os._exit(0)"), "exit status 0"),
        (("server._rewards[:] = server._rewards[:1].tobytes() and [9e9]", "return 1.0"), "."),
        (("for row in range(10): server._rewards[row] = 9e9", "reply(2)", "time.sleep(9)"), "without all rewards"),
        (("for row in range(10): server._rewards[row] = float('inf')", "reply(2)"), "without all rewards"),
        (("everywhere(b'\\xff' * 4096)", "os._exit(0)"), "makes no sense"),
    ],
)
def test_a_reply_that_lies(track, rows, body, text):
    begun = time.monotonic()
    with running(hostile(*body), track, timeout_s=TIMEOUT_S) as worker, pytest.raises(RewardError, match=text):
        worker(rows)
    assert time.monotonic() - begun < 20.0


def ring_for_ever(worker):
    for _ in range(1_000_000):
        worker._ring(1, 0)


def test_a_worker_that_takes_no_requests_does_not_block_the_trainer(track):
    """It could answer by itself, always; its caller would write into a full pipe, for ever."""
    with running(function("return 1.0"), track) as worker:
        os.kill(worker.process_id, signal.SIGSTOP)
        with pytest.raises(RewardError, match="without taking requests"):
            ring_for_ever(worker)


@pytest.mark.costly
def test_progress_that_is_none_ends(track, rows, monkeypatch):
    """The first reward that is missing, now here, now there: every look finds another number of rows done, for ever."""
    monkeypatch.setattr(worker_module, "PATIENCE", 1.0)  # as it sleeps between looks
    source = hostile(
        "until = time.monotonic() + 4.0",
        "while time.monotonic() < until:",
        "    for row in range(1000): server._rewards[row] = 1.0",
        "    for row in reversed(range(1000)):",  # of all that seemed to be done ever fewer are, and then all again
        "        server._rewards[row] = float('nan')",
        "        time.sleep(0.005)",
        "os._exit(0)",
    )
    many = np.tile(rows, (100, 1))
    begun = time.monotonic()
    with running(source, track, timeout_s=TIMEOUT_S) as worker, pytest.raises(RewardError, match="did not return"):
        worker(many)
    assert time.monotonic() - begun < 20.0


def test_rewards_that_change_after_the_answer(track, rows):
    """A process beside the worker, which only an unconfined one can start, goes on writing into the memory."""
    top = DIG + (
        "import ctypes\n"
        "if ctypes.pythonapi.fork() == 0:\n"
        "    until = time.monotonic() + 2.0\n"
        "    while time.monotonic() < until:\n"
        "        for row in range(10): server._rewards[row] = float('nan')\n"
        "        for row in range(10): server._rewards[row] = 2.0\n"
        "    os._exit(0)\n"
    )
    source = function("return 1.0", top=top)
    with running(source, track, confinement=UNCONFINED) as worker, contextlib.suppress(RewardError):
        for _ in range(2000):
            rewards = worker(rows)
            assert np.isfinite(rewards).all()
            assert not np.shares_memory(rewards, worker._rewards)


def test_a_stack_that_is_no_stack(track, rows):
    """The line of a crash comes from text that user code can write, too."""
    lines = "b'File \"reward_function.py\", line ' + b'9' * 5000"
    with running(hostile(f"everywhere({lines})", "os._exit(1)"), track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert caught.value.line is None
    with pytest.raises(RewardError) as caught, running(DIG + "everywhere(b'\\x1b[2J' * 9999)\nos._exit(1)", track):
        pass
    assert "\x1b" not in str(caught.value)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize(
    "body",
    [
        "raise ValueError('\\x1b]0;title\\x07\\x1b[2J')",
        "raise ValueError('\\u202e\\u0000')",
        "print('\\x1b[2J') or 1 / 0",
        "return 1 / 0 # \x1b[2J",
    ],
)
def test_no_text_from_the_worker_drives_a_terminal(track, rows, body):
    with running(function(body), track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert "".join(str(caught.value).split("\n")).isprintable()


def test_a_log_that_claims_more_than_there_is(track, rows):
    source = hostile(
        "ring = next(thing for thing in gc.get_objects() if type(thing).__name__ == 'PrintRing')",
        "ring._head[:] = b'\\xff' * 8",
        "return 1.0",
    )
    with running(source, track) as worker:
        worker(rows)
        assert len(worker.read_log()) <= 65536
        assert worker.num_lost >= 0


def test_a_signal_without_a_name(track, rows):
    source = function("import ctypes, os", "ctypes.pythonapi.kill(os.getpid(), 40)", "return 1.0")
    with (
        running(source, track, confinement=UNCONFINED) as worker,
        pytest.raises(RewardError, match="ended the worker process with signal 40"),
    ):
        worker(rows)


def test_what_user_code_leaves_behind_is_not_run(track, rows, tmp_path):
    """Its finalizers, exit handlers and representations stay in its own process, and end with it."""
    marker = tmp_path / "marker"
    source = function(
        "raise Bad()",
        top="import atexit, os\n"
        f"def leave(*_): os.mkdir({str(marker)!r})\n"
        "atexit.register(leave)\n"
        "class Bad(Exception):\n"
        "    __repr__ = __str__ = __del__ = leave\n",
    )
    with running(source, track) as worker, pytest.raises(RewardError, match="Bad"):
        worker(rows)
    assert not marker.exists()
