"""Files that a worker may have made and a page shows: what would fill the memory is refused before it does."""

from __future__ import annotations

import json
import struct
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.errors import RacecraftError, ReplayError, RunError
from racecraft.film.ghost_source import check_sources
from racecraft.race import Autopilot, RaceRules, evaluate
from racecraft.replay import Replay, read_replay, write_replay
from racecraft.replay.codec import pack, pack_column, unpack
from racecraft.replay.header import check_header
from racecraft.run import RunFolder
from racecraft.run.simtrace import COLUMNS, read_simtrace
from racecraft.serve.contests import routes as contests
from racecraft.serve.contests.files import MAX_CONTENTS, MAX_MATCH, read_match
from racecraft.serve.context import Computes
from racecraft.serve.evaluations.objects import MAX_SHOWN, objects_of
from racecraft.serve.evaluations.traces import read_laps, read_start
from racecraft.serve.problems import NotFound
from racecraft.serve.races import routes as races
from racecraft.serve.races.ghosts import BESIDE, MAX_BESIDE, read_beside
from racecraft.serve.races.replays import trial_of
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES, row_width
from racecraft.track import load_track

MEMORY = 64 << 20
"""Bytes that a refusal may take; the files below ask for hundreds of megabytes."""
RACE = {"track": "oval", "cars": [{"trace": [], "laps": [], "objects": []}] * 2}


@contextmanager
def in_little_memory() -> Iterator[None]:
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < MEMORY
    finally:
        tracemalloc.stop()


@pytest.fixture(scope="module")
def endless(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A replay of 14 kB that says it drove for days."""
    driven = evaluate(
        Autopilot(), load_track("oval"), rules=RaceRules(laps=1, time_limit=1.0), num_trials=1, sees="state"
    )
    path = write_replay(Replay.of(driven), tmp_path_factory.mktemp("replays") / "endless.replay")
    document, body = unpack(path.read_bytes(), name="it")
    track = check_header(document, name="it").track
    lines = bytes(body[: 8 * 6 * track.waypoints]) if set(track.types) == {"f8"} else b""
    assert lines, "whose lines are kept as they are"
    width = row_width(0)
    steps = MAX_SHOWN // width + 1
    status = np.full(steps, STATUS_NAMES.index("in_progress"))
    status[0] = STATUS_NAMES.index("prepare")
    kind, still = pack_column(np.zeros(steps))
    columns = [still] * (width + 2)
    columns[3 + ROW_COLUMNS.index("status") - (ROW_COLUMNS.index("status") > ROW_COLUMNS.index("time"))] = pack_column(
        status
    )[1]
    document["cars"][0] |= {"steps": steps, "types": [kind] * len(columns)}
    path.write_bytes(pack(document, [lines, *columns]))
    return path


def test_a_replay_without_end_is_not_read_to_be_shown(endless: Path, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    there = folder.evaluation_replay("20261129")
    there.parent.mkdir(parents=True)
    there.write_bytes(endless.read_bytes())
    assert there.stat().st_size < 100_000
    oval = load_track("oval")
    shown: list[Callable[[], Any]] = [
        lambda: trial_of(there, 0, entry=1, model="a", max_numbers=MAX_SHOWN),
        lambda: check_sources([str(there)], oval, RaceRules(), run=None, max_numbers=MAX_SHOWN),
    ]
    for read in shown:
        with in_little_memory(), pytest.raises(ReplayError, match="holds more than 8,000,000 numbers"):
            read()
    with in_little_memory():
        assert objects_of(folder, "20261129", []) == {}
    assert read_replay(there).num_steps > MAX_SHOWN // row_width(0), "who has the memory may"


def test_a_trial_that_a_replay_does_not_have_is_not_shown(tmp_path: Path) -> None:
    driven = evaluate(
        Autopilot(), load_track("oval"), rules=RaceRules(laps=1, time_limit=1.0), num_trials=1, sees="state"
    )
    path = write_replay(Replay.of(driven), tmp_path / "race.replay")
    assert trial_of(path, 0, entry=1, model="a").trace
    with pytest.raises(ReplayError, match=r"has no trial 2\."):
        trial_of(path, 1, entry=1, model="a")


def test_what_reads_replays_takes_a_place() -> None:
    for room, path in ((contests, "/api/contests/{contest}/replay"), (races, "/api/races/{race_id}/replay")):
        (route,) = [one for one in room.router.routes if one.path == path]  # type: ignore[attr-defined]
        assert Computes in route.dependencies  # type: ignore[attr-defined]


def archive(path: Path, content: bytes = b"", *, times: int = 1) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file, file.open("0.json", "w") as member:
        for _ in range(times):
            member.write(content or json.dumps(RACE).encode())
    return path


def refused(path: Path) -> None:
    with in_little_memory(), pytest.raises(NotFound, match=r"The ladder has no race 0\."):
        read_match(path, 0)


@pytest.mark.costly
def test_a_race_of_a_ladder_is_not_unpacked_without_end(tmp_path: Path) -> None:
    path = tmp_path / "matches.zip"
    assert read_match(archive(path), 0) == RACE
    refused(archive(path, bytes(1 << 20), times=(MAX_MATCH >> 20) + 200))
    assert path.stat().st_size < 1 << 20


@pytest.mark.costly
@pytest.mark.parametrize("is_long", [False, True])
def test_a_ladder_is_not_told_of_millions_of_races(tmp_path: Path, is_long: bool) -> None:
    data = archive(tmp_path / "matches.zip").read_bytes()
    begin = data.index(b"PK\1\2")
    entry, end = data[begin : data.index(b"PK\5\6")], data[data.index(b"PK\5\6") :]
    count = MAX_CONTENTS // len(entry) + 1
    size = count * len(entry)
    if is_long:  # the sizes of an archive of more than 65,535 members stand elsewhere
        long = struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, count, count, size, begin)
        locator = struct.pack("<4sLQL", b"PK\6\7", 0, begin + size, 1)
        end = long + locator + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0)
    else:
        end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 0xFFFF, 0xFFFF, size, begin, 0)
    path = tmp_path / "many.zip"
    path.write_bytes(data[:begin] + entry * count + end)
    with zipfile.ZipFile(path) as whole:
        assert len(whole.namelist()) == count, "a table of contents that Python would read"
    refused(path)


@pytest.mark.parametrize(
    "content",
    [b"[" * 100_000, b"[]", b"{}", b'{"track": 7, "cars": []}', b'{"track": "oval", "cars": NaN}', b"\xff", b'{"a'],
)
def test_a_race_of_a_ladder_that_is_none(tmp_path: Path, content: bytes) -> None:
    refused(archive(tmp_path / "matches.zip", content))


def test_an_archive_of_races_that_is_damaged(tmp_path: Path) -> None:
    whole = archive(tmp_path / "matches.zip").read_bytes()
    begin = whole.index(b"PK\1\2")
    encrypted = whole[: begin + 8] + b"\1" + whole[begin + 9 :]
    method = whole[: begin + 10] + b"\x63" + whole[begin + 11 :]
    other = whole[:40] + b"\xff\xff\xff" + whole[43:]
    for bad in (b"", b"PK", whole[:-1], whole + b"x", encrypted, method, other, b"PK\5\6" + bytes(18)):
        (tmp_path / "bad.zip").write_bytes(bad)
        refused(tmp_path / "bad.zip")


def test_a_line_of_steps_is_not_read_without_end(tmp_path: Path) -> None:
    path = tmp_path / "0-iteration.csv"
    head = ",".join(COLUMNS)
    for begin in ("", f"{head}\n"):
        path.write_text(f"{begin}{',' * (16 << 20)}\n")
        with in_little_memory():
            with pytest.raises(RunError, match="a line has more than 16,384 characters"):
                read_simtrace(path)
            assert read_laps(path) == []
            assert read_start(path) == []


def test_ghosts_of_days_are_not_read(tmp_path: Path) -> None:
    (tmp_path / BESIDE).write_bytes(b'{"ghosts": [' + b"0," * (MAX_BESIDE // 2) + b"0]}")
    with in_little_memory(), pytest.raises(RacecraftError, match="too large"):
        read_beside(tmp_path)
