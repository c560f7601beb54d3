"""Each wall by itself, what a worker looks like from outside, and what happens where a wall is missing."""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from workers import function, running

from alive_processes import is_alive
from racecraft.errors import RewardError
from racecraft.reward import RewardWorker, keeps_state, launch, load_preset, preset_names, situations
from racecraft.reward.sandbox import UNCONFINED, Confinement, confinement, find_confinement, make_plan
from racecraft.track import load_track

FUNCTIONS = sorted((Path(__file__).parents[1] / "functions").glob("*.py"))
SOURCES = {
    **{path.stem: path.read_text(encoding="utf-8") for path in FUNCTIONS},
    **{name: load_preset(name) for name in preset_names()},
}
HERE = find_confinement()
LANDLOCK_ONLY = Confinement(landlock=HERE.landlock)
SYSCALLS_ONLY = Confinement(syscalls=HERE.syscalls)
NO_WALLS = Confinement()

complete = pytest.mark.skipif(not HERE.is_complete, reason=f"no {HERE.missing} here")
bubbles = pytest.mark.skipif(not HERE.bubblewrap, reason="bubblewrap is not here, or does not work")

# Past the audit hook, so that the kernel answers.
RAW = """
import ctypes, os, struct
libc = ctypes.pythonapi
libc.__errno_location.restype = ctypes.POINTER(ctypes.c_int)
"""


def errno_of(statement: str) -> str:
    return function(f"result = {statement}", "return float(libc.__errno_location()[0] if result < 0 else 0)", top=RAW)


# --- walls


@pytest.mark.costly
@complete
@pytest.mark.parametrize("name", SOURCES)
def test_rewards_are_the_same_to_the_bit_within_walls(name):
    source, track = SOURCES[name], load_track("reinvent_2018")
    rows = np.stack([situation.row for situation in situations(track)])
    options = {"seed": 3, "num_cars": len(rows) if keeps_state(source) else 1}
    found = []
    for walls in (UNCONFINED, HERE, replace(HERE, bubblewrap="")):
        with running(source, track, confinement=walls, timeout_s=5.0, **options) as worker:
            found.append(np.concatenate([worker(rows) for _ in range(3)]))
    for other in found[1:]:
        assert found[0].tobytes() == other.tobytes()


@pytest.mark.skipif(not HERE.landlock, reason="no Landlock here")
def test_landlock_alone(track, rows, tmp_path):
    """Paths, TCP, abstract sockets and signals; what it does not know, goes on."""
    secret = tmp_path / "secret"
    secret.write_text("x")
    refused = {
        f"libc.open({bytes(secret)!r}, 0)": 13,
        f"libc.creat({bytes(tmp_path / 'made')!r}, 0o600)": 13,
        f"libc.unlink({bytes(secret)!r})": 13,
    }
    if HERE.landlock >= 3:
        refused[f"libc.truncate({bytes(secret)!r}, ctypes.c_long(0))"] = 13
    if HERE.landlock >= 4:
        with socket.socket() as listening:
            listening.bind(("127.0.0.1", 0))
            listening.listen(1)
            port = listening.getsockname()[1]
            address = f"struct.pack('<H', 2) + struct.pack('>HI', {port}, 0x7F000001) + bytes(8)"
            assert answer(track, rows, LANDLOCK_ONLY, f"libc.connect(libc.socket(2, 1, 0), {address}, 16)") == 13
            assert answer(track, rows, NO_WALLS, f"libc.connect(libc.socket(2, 1, 0), {address}, 16)") == 0
    if HERE.landlock >= 6:
        refused[f"libc.kill({os.getpid()}, 0)"] = 1
    for statement, number in refused.items():
        assert answer(track, rows, LANDLOCK_ONLY, statement) == number, statement
    assert secret.read_text() == "x"
    assert answer(track, rows, LANDLOCK_ONLY, f"libc.access({bytes(secret)!r}, 0)") == 0
    assert answer(track, rows, NO_WALLS, f"libc.open({bytes(secret)!r}, 0)") == 0


@pytest.mark.skipif(not HERE.syscalls, reason="no filter of system calls here")
def test_the_filter_alone(track, rows, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("x")
    for statement in (
        f"libc.open({bytes(secret)!r}, 0)",
        f"libc.access({bytes(secret)!r}, 0)",
        "libc.open(b'/nowhere/at/all', 0)",  # not even whether it is there
        "libc.socket(2, 2, 0)",
        "libc.fork()",
        f"libc.kill({os.getpid()}, 0)",
    ):
        assert answer(track, rows, SYSCALLS_ONLY, statement) == 1, statement


def answer(track, rows, walls: Confinement, statement: str) -> float:
    """The errno that a statement gets."""
    with running(errno_of(statement), track, confinement=walls) as worker:
        return float(worker(rows[:1])[0])


@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells it in /proc")
@complete
def test_what_a_worker_looks_like_from_outside(track):
    with running(function("return 1.0"), track, confinement=HERE) as worker:
        lines = Path(f"/proc/{worker.process_id}/status").read_text().splitlines()
        limits = Path(f"/proc/{worker.process_id}/limits").read_text()
    status = {name: value.strip() for name, _, value in (line.partition(":") for line in lines)}
    assert status["NoNewPrivs"] == "1"
    assert status["Seccomp"] == "2"
    assert status["Seccomp_filters"] == "2"
    assert status["Threads"] == "1"
    for held in ("CapInh", "CapPrm", "CapEff", "CapAmb"):
        assert int(status[held], 16) & ~4 == 0  # but reading others' folders, where the packages may be
    for line in (
        "Max file size             0                    0",
        "Max core file size        0                    0",
    ):
        assert line in limits


def test_no_wall_is_asked_for_where_there_is_none(track, rows):
    with running(function("return 2.0"), track, confinement=NO_WALLS) as worker:
        assert worker(rows).sum() == 20.0
    assert str(NO_WALLS) == "hard limits"
    assert str(UNCONFINED) == "nothing"


# --- whose code


@pytest.mark.parametrize(
    ("walls", "lacks"),
    [
        (Confinement(), "Landlock and a filter of system calls"),
        (Confinement(landlock=7), "lack of a filter of system calls"),
        (Confinement(syscalls="x86_64"), "lack of Landlock"),
        (Confinement(landlock=7, syscalls="x86_64", limits=False), "lack of limits"),
    ],
)
def test_foreign_code_is_refused_where_a_wall_is_missing(track, tmp_path, walls, lacks):
    marker = tmp_path / "marker"
    source = f"import os\nos.mkdir({str(marker)!r})\n" + function("return 1.0")
    with pytest.raises(RewardError, match=lacks) as caught:
        RewardWorker(source, track, foreign=True, confinement=walls)
    assert "somebody else" in str(caught.value)
    assert "racecraft train --reward" in caught.value.hint
    assert not marker.exists()


@complete
def test_foreign_code_runs_within_all_walls(track, rows):
    with running(function("return 1.0"), track, foreign=True, confinement=HERE) as worker:
        assert worker(rows).sum() == 10.0


@complete
def test_foreign_code_is_not_compiled(track, rows):
    with running(load_preset("racing"), track, foreign=True, compiled=True) as worker:
        assert "comes from somebody else" in worker.interpreted_because
        assert np.isfinite(worker(rows)).all()


# --- what can go wrong with a wall


@complete
@pytest.mark.parametrize(
    "broken",
    [
        {"filters": [b"\x06\x00\x00\x00\x00\x00\xff\x7f" * 5000]},  # longer than the kernel takes
        {"filters": [b"\xff" * 8]},
        {"landlock": 1, "readable": ["/nowhere/at/all"]},
    ],
)
def test_a_worker_that_cannot_be_locked_in_runs_nothing(track, monkeypatch, broken):
    import racecraft.reward.worker as module

    monkeypatch.setattr(module, "make_plan", lambda *a, **k: make_plan(*a, **k) | broken)
    with pytest.raises(RewardError, match=r"cannot be locked in: it raised \w+Error") as caught:
        RewardWorker(function("return 1.0"), track, confinement=replace(HERE, bubblewrap=""))
    assert "racecraft doctor" in caught.value.hint


@complete
def test_a_broken_second_filter_is_an_error_too(track, monkeypatch):
    import racecraft.reward.worker as module

    def broken(*args, **settings):
        plan = make_plan(*args, **settings)
        return plan | {"filters": [plan["filters"][0], b"\xff" * 8]}

    monkeypatch.setattr(module, "make_plan", broken)
    with pytest.raises(RewardError, match="seccomp: Invalid argument"):
        RewardWorker(function("return 1.0"), track)


@pytest.mark.parametrize(
    ("system", "machine", "version", "filters", "expected"),
    [
        ("linux", "x86_64", 7, 0, Confinement(landlock=7, syscalls="x86_64")),
        ("linux", "aarch64", 1, 0, Confinement(landlock=1, syscalls="aarch64")),
        ("linux", "x86_64", -1, 0, Confinement(syscalls="x86_64")),
        ("linux", "x86_64", 4, -1, Confinement(landlock=4)),
        ("linux", "riscv64", 7, 0, Confinement()),
        ("darwin", "arm64", 7, 0, Confinement()),
    ],
)
def test_what_a_kernel_offers_is_found(monkeypatch, system, machine, version, filters, expected):
    class Library:
        def __init__(self, *_: object, **__: object) -> None:
            self.syscall = self

        def __call__(self, number: object, *_: object) -> int:
            return version if number == 444 else filters

    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    monkeypatch.setattr(ctypes, "CDLL", Library)
    monkeypatch.setattr(confinement, "find_bubblewrap", lambda: "")
    assert find_confinement.__wrapped__() == expected


# --- the end

# A crash whose handler, to which no signal comes, never returns.
DEAF = """
    import ctypes, time
    libc = ctypes.pythonapi
    class Action(ctypes.Structure):
        _fields_ = [("handler", ctypes.c_void_p), ("mask", ctypes.c_uint8 * 128), ("rest", ctypes.c_uint64 * 2)]
    def stay(number):
        time.sleep(60)
    handler = ctypes.CFUNCTYPE(None, ctypes.c_int)(stay)
    libc.sigaction(11, ctypes.byref(Action(ctypes.cast(handler, ctypes.c_void_p), (255,) * 128)), None)
    ctypes.string_at(0)
"""


@pytest.mark.costly
@pytest.mark.skipif(sys.platform != "linux", reason="a lifeline is Linux's")
@pytest.mark.parametrize("busy", ["while True: pass", "__import__('time').sleep(60)", DEAF])
@pytest.mark.parametrize("walls", [UNCONFINED, HERE], ids=["unconfined", "confined"])
def test_a_worker_ends_with_its_trainer_whatever_it_does(busy, walls):
    trainer = (
        "from racecraft.reward import RewardWorker, situations\n"
        "from racecraft.reward.sandbox import *\n"
        "from racecraft.track import load_track\n"
        "track = load_track('oval')\n"
        f"worker = RewardWorker({function(busy)!r}, track, timeout_s=50.0, confinement={walls!r})\n"
        "print(worker.process_id, flush=True)\n"
        "worker(situations(track)[1].row[None])\n"
    )
    command = [sys.executable, "-c", trainer]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        worker = int(process.stdout.readline())
        time.sleep(0.2)
        assert is_alive(worker)
        process.kill()
    deadline = time.monotonic() + 30.0  # by itself it would end later
    while time.monotonic() < deadline and is_running(worker):
        time.sleep(0.02)
    alive = is_running(worker)
    with contextlib.suppress(ProcessLookupError):
        os.kill(worker, signal.SIGKILL)
    assert not alive


def is_running(process_id: int) -> bool:
    """Alive, and not only not yet taken note of by whoever is its parent now."""
    try:
        return Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


# --- bubblewrap


@bubbles
def test_bubblewrap_hides_the_file_system(track, rows, tmp_path):
    bubble = Confinement(bubblewrap=HERE.bubblewrap)
    assert answer(track, rows, bubble, f"libc.access({bytes(tmp_path)!r}, 0)") == 2  # no such file
    assert answer(track, rows, NO_WALLS, f"libc.access({bytes(tmp_path)!r}, 0)") == 0


@pytest.mark.costly
@bubbles
@pytest.mark.parametrize(
    ("body", "text", "line"),
    [
        ("while True: pass", "did not return within", 2),
        ("__import__('os')._exit(3)", "exit status 3", -1),
        ("return ctypes.pythonapi.ptrace(16, 1, None, None)", r"SIGSYS \(a system call", -1),
        ("return ctypes.string_at(0)", r"SIGSEGV \(a crash", -1),
    ],
)
def test_a_worker_within_bubblewrap_tells_how_it_ended(track, rows, body, text, line):
    with running(function(body) + "import ctypes\n", track, timeout_s=0.4, confinement=HERE) as worker:
        number = worker.process_id
        with pytest.raises(RewardError, match=text) as caught:
            worker(rows)
    assert line < 0 or caught.value.line == line
    assert not is_running(number)


@bubbles
def test_a_bubblewrap_that_starts_nothing_is_told(track, tmp_path):
    broken = tmp_path / "bwrap"
    broken.write_text("#!/bin/sh\necho no permission >&2\nexit 1\n")
    broken.chmod(0o755)
    with pytest.raises(RewardError, match="bubblewrap did not start"):
        RewardWorker(function("return 1.0"), track, confinement=replace(HERE, bubblewrap=str(broken)))


def test_where_bubblewrap_does_not_work_it_is_left_out(monkeypatch, tmp_path):
    from racecraft.reward.sandbox import bubblewrap

    broken, good = tmp_path / "broken", tmp_path / "good"
    broken.write_text("#!/bin/sh\nexit 1\n")
    good.write_text("#!/bin/sh\nexit 0\n")
    for path in (broken, good):
        path.chmod(0o755)
    monkeypatch.setattr(bubblewrap, "SEARCHED", (str(tmp_path / "none"), str(broken)))
    assert bubblewrap.find_bubblewrap() == ""
    monkeypatch.setattr(bubblewrap, "SEARCHED", (str(broken), str(good)))
    assert bubblewrap.find_bubblewrap() == str(good)


def test_every_descriptor_is_closed_in_the_end(track):
    before = len(os.listdir("/proc/self/fd")) if sys.platform == "linux" else 0
    with running(function("return 1.0"), track, confinement=HERE):
        pass
    with contextlib.suppress(RewardError):
        RewardWorker("raise ValueError", track, confinement=HERE)
    if before:
        assert len(os.listdir("/proc/self/fd")) == before
    assert launch.PROGRAM.exists()
