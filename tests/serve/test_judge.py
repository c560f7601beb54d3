"""The league's judge: what a child can reach that a stranger's weights got the better of; what its word is worth."""

from __future__ import annotations

import ctypes
import json
import os
import resource
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from leagues import untrained_run

from racecraft.learn.networks import PERCEPTION
from racecraft.race.announcement import Announcement, draw_secret
from racecraft.race.conditions import Conditions
from racecraft.race.entry_file import pack_entry
from racecraft.race.rules import RaceRules
from racecraft.replay.replay import read_replay
from racecraft.reward.sandbox import Confinement, find_confinement
from racecraft.serve.submissions import judge, walls
from racecraft.serve.submissions.judge import AGAIN, DROVE, ENTRY, FAILED, JUDGED
from racecraft.track import load_track

HERE = find_confinement()
locked = pytest.mark.skipif(not HERE.is_complete, reason=f"no {HERE.missing} here")
Told = dict[str, Any]


@pytest.fixture
def told(tmp_path: Path, entry: bytes) -> Told:
    """What a judge is asked, of an entry in a folder of its own."""
    conditions = Conditions(track=load_track("oval"), rules=RaceRules(laps=1, max_resets=1))
    announced = Announcement.of(
        conditions, kind="time-trial", ranking="total", minimum_laps=1, num_trials=1, secret=draw_secret()
    )
    folder = tmp_path / "state" / "submissions" / "mine"
    results = folder / "judging"
    results.mkdir(parents=True)
    (folder / ENTRY).write_bytes(entry)
    about = {"document": dict(announced.document), "commitment": announced.commitment, "track": "oval", "name": "x"}
    return {**about, "seed": 1, "frames": 2, "folder": str(folder), "results": str(results)}


# ---- walls


class Prey:
    """A server's things, of which none is the judge's: each attack says whether it got at one."""

    def __init__(self, root: Path, entry: Path) -> None:
        self.root, self.entry, self.result = root, entry, entry.with_name("judging") / JUDGED
        self.others = root / "state" / "submissions" / "yours" / ENTRY
        self.others.parent.mkdir()
        shutil.copy(entry, self.others)
        self.database, self.secret = root / "state" / "console.db", root / "secret.txt"
        for path in (self.database, self.secret):
            path.write_text("of the server")
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.leaked = os.open(self.secret, os.O_RDWR)
        os.set_inheritable(self.leaked, True)
        self.server = os.getpid()

    def close(self) -> None:
        self.listening.close()
        os.close(self.leaked)

    def attacks(self) -> dict[str, Callable[[], object]]:
        def read(path: Path | str) -> Callable[[], object]:
            return lambda: Path(path).read_bytes()

        def write(path: Path) -> Callable[[], object]:
            return lambda: path.write_text("by the child")

        libc = ctypes.CDLL(None, use_errno=True)

        def call(name: str, *arguments: Any) -> Callable[[], object]:
            def called() -> None:
                if getattr(libc, name)(*arguments) < 0:
                    raise OSError(ctypes.get_errno(), name)

            return called

        return {
            "read the database": read(self.database),
            "read a secret": read(self.secret),
            "read another's weights": read(self.others),
            "read the server's environment": read(f"/proc/{self.server}/environ"),
            "read the people of the machine": read("/etc/passwd"),
            "list the submissions": lambda: os.listdir(self.others.parent.parent),
            "read by a raw call": call("open", bytes(self.database), os.O_RDONLY),
            "use what was left open": lambda: os.pread(self.leaked, 4, 0),
            "change the database": write(self.database),
            "change its own entry": write(self.entry),
            "make a file beside it": write(self.entry.with_name("more")),
            "change its own result by name": write(self.result),
            "write where all may": write(Path("/dev/shm") / f"racecraft-{os.getpid()}"),
            "remove its entry": lambda: self.entry.unlink(),
            "rename another's": lambda: self.others.rename(self.others.with_name("gone")),
            "open a way to the network": lambda: socket.create_connection(self.listening.getsockname(), 1).close(),
            "ask for a name": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close(),
            "signal the server": lambda: os.kill(self.server, 0),
            "signal its judge": lambda: os.kill(os.getppid(), 0),
            "have a child": lambda: os._exit(0) if (child := os.fork()) == 0 else os.waitpid(child, 0),
            "start a program": lambda: os.posix_spawn("/bin/true", ["true"], {}),
        }


@pytest.fixture
def prey(tmp_path: Path, told: Told) -> Iterator[Prey]:
    prey = Prey(tmp_path, Path(told["folder"]) / ENTRY)
    yield prey
    prey.close()


def tried(prey: Prey, told: Told, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What each attack came to, made in a child's place of driving: empty where it got through."""

    def attack(*_: object, **__: object) -> tuple[dict[str, str], bytes]:
        found = {}
        for name, attempt in attacks.items():
            try:
                attempt()
                found[name] = ""
            except Exception as error:
                found[name] = f"{type(error).__name__}: {error}"
        return found, b"the result"

    attacks = prey.attacks()
    monkeypatch.setattr(judge, "_drive", attack)
    status, said = judge._by_a_child(told, number=1)
    assert status == DROVE
    found: dict[str, str] = json.loads(said)
    assert set(found) == set(attacks)
    return found


@locked
def test_a_child_that_was_got_the_better_of_reaches_nothing(
    prey: Prey, told: Told, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = tried(prey, told, monkeypatch)
    assert [name for name, refused in found.items() if not refused] == []
    assert prey.result.read_bytes() == b"the result", "the one thing that it may write"
    assert prey.database.read_text() == "of the server"
    left = sorted(path.name for folder in (prey.entry, prey.result) for path in folder.parent.iterdir())
    assert left == sorted([ENTRY, "judging", JUDGED])


@locked
def test_without_walls_the_same_attacks_get_through(prey: Prey, told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the test above proves walls, and not attacks that never worked."""
    monkeypatch.setattr(walls, "lock_in", lambda **_: None)
    found = tried(prey, told, monkeypatch)
    assert {name: why for name, why in found.items() if why} == {}


def test_a_child_has_nothing_of_its_judge_s_to_read_from_or_to_speak_through(
    told: Told, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The judge's own output is where a verdict is read from."""

    def speak(*_: object, **__: object) -> tuple[dict[str, Any], bytes]:
        for file in (1, 2):
            os.write(file, b"a verdict of its own\n")
        return {"heard": os.read(0, 9).decode(), "place": os.getcwd()}, b""

    monkeypatch.setattr(judge, "_drive", speak)
    mouth, pen = os.pipe()
    os.write(pen, b"a secret")
    before = os.dup(0)
    os.dup2(mouth, 0)
    try:
        status, said = judge._by_a_child(told, number=1)
    finally:
        os.dup2(before, 0)
        for file in (before, mouth, pen):
            os.close(file)
    assert (status, json.loads(said)) == (DROVE, {"heard": "", "place": "/"})
    assert capfd.readouterr() == ("", "")


@locked
def test_a_child_may_have_memory_beyond_what_its_judge_has_loaded(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    def look(*_: object, **__: object) -> tuple[dict[str, int], bytes]:
        return {"most": resource.getrlimit(resource.RLIMIT_AS)[0]}, b""

    monkeypatch.setattr(judge, "_drive", look)
    status, said = judge._by_a_child(told, number=1)
    assert status == DROVE
    assert json.loads(said)["most"] - walls._taken() == pytest.approx(walls.MOST_MEMORY, rel=0.01)


def test_a_heat_s_two_drive_from_their_own_files_under_their_own_names(told: Told, tmp_path: Path) -> None:
    conditions = Conditions(
        track=load_track("oval"), rules=RaceRules(laps=1, max_resets=1, time_limit=2.0), cars_per_race=2
    )
    announced = Announcement.of(
        conditions, kind="head-to-model", ranking="total", minimum_laps=1, num_trials=1, secret=draw_secret()
    )
    folder, results = Path(told["folder"]), Path(told["results"])
    grid = []
    for name, seed in (("second", 2), ("first", 1)):
        (folder / f"{seed}.safetensors").write_bytes(pack_entry(untrained_run(tmp_path, name, seed=seed)))
        grid.append({"file": f"{seed}.safetensors", "name": name})
    about = {"document": dict(announced.document), "commitment": announced.commitment, "track": "oval", "seed": 7}
    status, said = judge.judge({**about, "grid": grid, "folder": str(folder), "results": str(results)})
    assert said == json.dumps({"steps": [128, 64]})
    assert status == DROVE
    assert read_replay(results / JUDGED).names == ("second", "first")


@pytest.mark.costly
def test_what_sees_by_perception_is_judged_by_a_judge_that_never_saw_any(told: Told, tmp_path: Path) -> None:
    """Its weights are read within the walls: in a process of its own, where nothing else had loaded them."""
    run = untrained_run(tmp_path, "seer", network=PERCEPTION)
    (Path(told["folder"]) / ENTRY).write_bytes(pack_entry(run))
    asked = [sys.executable, "-P", "-m", "racecraft.serve.submissions.judge"]
    with subprocess.Popen(asked, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(told) + "\n")
        process.stdin.flush()
        verdict = json.loads(process.stdout.readline())
        process.stdin.close()
    assert verdict["status"] == DROVE
    assert json.loads(verdict["said"])["step"] == 64


@locked
@pytest.mark.skipif(sys.platform != "linux", reason="numbers are Linux's")
def test_a_child_that_looks_into_its_judge_is_ended(
    told: Told, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(judge, "_drive", lambda *_, **__: ctypes.CDLL(None).ptrace(16, os.getppid(), None, None))
    assert judge._by_a_child(told, number=1) == (FAILED, "")
    assert "ended by SIGSYS" in capfd.readouterr().err


def test_where_the_kernel_has_no_walls_it_judges_all_the_same_and_says_so(
    told: Told, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(walls, "find_confinement", Confinement)
    walls._plan.cache_clear()
    try:
        assert walls.missing_walls() == "Landlock and a filter of system calls (seccomp)"
        status, said = judge.judge(told)
    finally:
        walls._plan.cache_clear()
    assert (status, json.loads(said)["step"]) == (DROVE, 64)
    assert not (Path(told["results"]) / AGAIN).exists()
