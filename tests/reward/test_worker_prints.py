"""What a reward function prints is kept, bounded, and shown with its error."""

from __future__ import annotations

import pytest
from workers import function, running

from racecraft.errors import RewardError
from racecraft.reward.worker import LOG_BYTES


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


@pytest.mark.parametrize(
    "opening",
    [
        "logging.basicConfig(filename='reward.log', level=logging.INFO)",
        "logging.basicConfig(filename='/tmp/racecraft-test-reward.log', level=10, filemode='w', force=True)",
        "logging.getLogger().addHandler(logging.FileHandler('reward.log')); logging.getLogger().setLevel(20)",
        "logging.getLogger().addHandler(RotatingFileHandler('a/b.log', maxBytes=9)); logging.getLogger().setLevel(20)",
        "logging.getLogger().addHandler(TimedRotatingFileHandler('b.log')); logging.getLogger().setLevel(20)",
        "logging.getLogger().addHandler(logging.FileHandler('c.log', delay=True)); logging.getLogger().setLevel(20)",
    ],
)
def test_a_log_file_is_told_of_once_and_its_lines_are_kept(track, rows, opening):
    top = f"import logging\nfrom logging.handlers import *\n{opening}\n"
    with running(function("logging.info('at %s', params['x'])", "return 1.0", top=top), track) as worker:
        assert worker(rows[:2]).tolist() == [1.0, 1.0]
        log = worker.read_log()
    assert log.count("[racecraft: no log file is written; its lines are kept here]\n") == 1
    assert "at 0.0\n" in log
    assert "at 1.0\n" in log
    assert "Traceback" not in log


def test_logging_without_a_file_is_printed(track, rows):
    source = function("logging.warning('careful')", "return 1.0", top="import logging\n")
    with running(source, track) as worker:
        worker(rows[:1])
        assert worker.read_log() == "WARNING:root:careful\n"
