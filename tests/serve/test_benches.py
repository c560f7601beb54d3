"""The bench of judges: what becomes of one whose worker is killed, and of two that have the same submission."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from courts import Court, announced

from racecraft.errors import RunError
from racecraft.race.rules import race_rules
from racecraft.replay.replay import read_replay
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.submissions import judge, tasks
from racecraft.serve.submissions.bench import RESULTS, Bench, DriverFailed
from racecraft.serve.submissions.judge import ENTRY, FAILED

Told = dict[str, Any]
PATIENCE = 300.0  # s until a worker's judge drives, on a busy machine
GONE = 10.0  # s, on a busy machine; who drives on would for minutes
WORKER = """
import json, sys
from pathlib import Path
from racecraft.serve.submissions.bench import Bench
with Bench().asked(json.loads(sys.argv[1]), folder=Path(sys.argv[2])):
    pass
"""


def asked(seconds: float, trials: int) -> Told:
    """What a judge is told of a race whose trials last so long at least, as nobody gets there."""
    rules = race_rules("drfc", {"laps": 20, "max_resets": 100_000, "time_limit": seconds})
    terms = announced(rules, trials=trials)
    about = {"document": dict(terms.document), "commitment": terms.commitment, "track": "oval", "name": "x"}
    return {**about, "seed": 1, "frames": 2}


# ---- a worker that is gone


@pytest.mark.costly
@pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")
@pytest.mark.parametrize("killed", [0, 1], ids=["the worker", "the judge"])
def test_a_judge_ends_with_its_worker_and_its_child_with_both(entry: bytes, tmp_path: Path, killed: int) -> None:
    """However they end; of a worker that stands still, the judge's child knows nothing."""
    (tmp_path / ENTRY).write_bytes(entry)
    command = [sys.executable, "-c", WORKER, json.dumps(asked(600.0, trials=50)), str(tmp_path)]
    found: list[int] = []
    with subprocess.Popen(command) as worker:
        try:
            found.append(until(lambda: next(iter(children_of(worker.pid)), None)))
            until(lambda: len(list(tmp_path.glob(f"{RESULTS}*/*"))) or None)  # children before only try the walls
            found.append(until(lambda: next(iter(children_of(found[0])), None)))
            if killed:
                worker.send_signal(signal.SIGSTOP)
            os.kill((worker.pid, found[0])[killed], signal.SIGKILL)
            begun = time.monotonic()
            while any(map(lives, found)):
                assert time.monotonic() - begun < GONE, "it drives on for nobody"
                time.sleep(0.02)
        finally:
            worker.kill()
            for process in found:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)


@pytest.mark.parametrize("is_silent", [False, True], ids=["says nothing", "has closed its pipe"])
def test_a_judge_waits_for_no_child_that_nobody_asks_for(is_silent: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    asker, end = os.pipe()
    children: list[int] = []

    def drive(told: Told, pen: int, lifeline: int, *, number: int) -> int:
        os.close(end)  # a child of the real judge has none: the bench starts it as a new program
        if is_silent:
            os.close(pen)
        time.sleep(60.0)
        return FAILED

    fork = os.fork
    monkeypatch.setattr(judge, "_drive_alone", drive)
    monkeypatch.setattr(os, "fork", lambda: children.append(fork()) or children[-1])
    leave = threading.Timer(0.2, os.close, [end])
    leave.start()
    began = time.monotonic()
    with pytest.raises(SystemExit):
        judge._by_a_child({}, number=1, asker=asker)
    leave.join()
    os.close(asker)
    assert time.monotonic() - began < GONE
    with pytest.raises(ProcessLookupError):
        os.kill(children[0], 0)


# ---- a judge after another


@pytest.mark.costly
def test_a_bench_keeps_its_judge_but_one_that_drives_for_too_long(
    entry: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ENTRY).write_bytes(entry)
    bench, judges = Bench(), list[int]()

    def judge_one() -> None:
        with bench.asked(asked(2.0, trials=1), folder=tmp_path):
            assert bench._process is not None
            judges.append(bench._process.pid)

    try:
        judge_one()
        judge_one()
        with monkeypatch.context() as patched:
            patched.setattr("racecraft.serve.submissions.bench.PATIENCE", 1.0)
            with (
                pytest.raises(DriverFailed, match=r"^It drove for more than 1 s and was stopped\.$"),
                bench.asked(asked(600.0, trials=50), folder=tmp_path),
            ):
                pass
        assert not lives(judges[0])
        judge_one()
    finally:
        bench.close()
    assert judges[0] == judges[1] != judges[2]
    assert not lives(judges[2])


# ---- two at the same submission


@pytest.mark.costly
def test_two_judgings_in_one_folder_do_not_disturb_each_other(entry: bytes, tmp_path: Path) -> None:
    """As of a worker that was taken for dead, and of the one after it."""
    (tmp_path / ENTRY).write_bytes(entry)
    told, said = asked(2.0, trials=2), dict[int, Told]()
    replays = dict[int, tuple[str, ...]]()
    benches = [Bench(), Bench()]

    def have_it_judged(number: int) -> None:
        with benches[number].asked(told, folder=tmp_path) as (said[number], driven):
            together.wait()
            replays[number] = read_replay(driven).names

    together = threading.Barrier(2, timeout=PATIENCE)
    threads = [threading.Thread(target=have_it_judged, args=[number]) for number in (0, 1)]
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        for bench in benches:
            bench.close()
    assert said[0] == said[1]
    assert replays[0] == replays[1] == ("x, trial 1", "x, trial 2")
    assert [path.name for path in tmp_path.iterdir()] == [ENTRY]


def test_what_a_killed_worker_left_goes_with_the_next_judging(
    entry: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    court = Court(tmp_path)
    task = court.enter(entry)
    folder = tasks.submission_folder(tmp_path / STATE_FOLDER, task.job.id)
    (folder / f"{RESULTS}before").mkdir()
    monkeypatch.setattr(Bench, "_answer", lambda *_: {"status": FAILED, "said": ""})
    assert "judge's process failed" in str(court.fail(task))
    assert [path.name for path in folder.iterdir()] == [ENTRY]
    court.database.close()


def test_a_submission_whose_folder_is_gone_is_a_sentence(tmp_path: Path) -> None:
    with (
        pytest.raises(RunError, match=r"The file cannot be kept: No such file or directory\."),
        Bench().asked({}, folder=tmp_path / "gone"),
    ):
        pass


# ---- processes


def until(found: Callable[[], int | None]) -> int:
    deadline = time.monotonic() + PATIENCE
    while (number := found()) is None:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return number


def children_of(parent: int) -> Iterator[int]:
    for process in Path("/proc").iterdir():
        with suppress(OSError):
            if process.name.isdigit() and int(fields(process)[1]) == parent:
                yield int(process.name)


def lives(process: int) -> bool:
    """Whether it runs; who waits for its parent's word no longer does."""
    try:
        return fields(Path("/proc") / str(process))[0] != "Z"
    except OSError:
        return False


def fields(process: Path) -> list[str]:
    """State, parent and the rest of what the kernel says of a process."""
    return (process / "stat").read_text().rpartition(")")[2].split()
