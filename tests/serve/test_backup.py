"""A league is written down while it runs, and goes on from that somewhere else."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import tarfile
import threading
from pathlib import Path

import pytest
import sqlalchemy as sa
from leagues import RunningLeague, ok, running_league, untrained_run
from postgres_servers import PostgresServer

from racecraft.errors import RunError
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.backup import back_up, restore
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Member, Race


def league_verb(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "racecraft", "league", *words], capture_output=True, text=True)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a run, but its lock."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if name != ".lock"}


def grow(league: RunningLeague, until: threading.Event) -> None:
    for _ in range(80):  # as many as somebody may have, nearly
        if until.wait(0.04):
            return
        league.code(league.group("Meanwhile"))


@pytest.mark.slow
def test_a_league_moves_while_it_runs(tmp_path: Path, postgres: PostgresServer) -> None:
    """From SQLite to PostgreSQL, where it does what it did, and back."""
    runs, file, place = tmp_path / "runs", tmp_path / "backup.tar", tmp_path / "elsewhere"
    target = postgres.new_database()
    with running_league(runs) as league:
        group = league.group("5b")
        card = ok(league.owner.post(f"/api/groups/{group}/members", json={"people": [{"name": "Ada"}]}), 201)[0]
        joined = league.join(league.code(group), "Bob")
        untrained_run(runs, "owners-model")
        has_ended = threading.Event()
        busy = threading.Thread(target=grow, args=(league, has_ended))
        busy.start()
        done = league_verb("backup", str(file), "--runs", str(runs))
        has_ended.set()
        busy.join()
        assert done.returncode == 0, done.stderr
        assert ok(joined.get("/api/account"))["name"] == "Bob"
        groups = len(ok(league.owner.get("/api/groups")))
    assert file.stat().st_mode & 0o077 == 0
    restore(ServeSettings(runs=place, database=target), file)
    assert not (tmp_path / "elsewhere.restoring").exists()
    assert contents(place / "owners-model") == contents(runs / "owners-model") != {}
    with running_league(place, "--database", target) as league:
        numbers = [found["id"] for found in ok(league.owner.get("/api/groups"))]
        assert group in numbers
        assert len(numbers) <= groups
        ada, bob = league.stranger(), league.stranger()
        ok(ada.post("/api/door/card", json={"secret": card["link"].split("#")[1]}))
        assert ok(ada.get("/api/account"))["name"] == "Ada"
        assert [found["title"] for found in ok(ada.get("/api/groups"))] == ["5b"]
        bob.cookies.update(joined.cookies)
        assert (len(bob.cookies), bob.get("/api/account").status_code) == (1, 401)
        assert league.group("New") not in numbers
        assert [model["name"] for model in ok(league.owner.get("/api/models"))] == ["owners-model"]
        again = back_up(ServeSettings(runs=place, database=target), tmp_path / "again.tar")
    with pytest.raises(RunError, match="database is not empty"):
        restore(ServeSettings(runs=tmp_path / "third", database=target), file)
    home = ("--runs", str(tmp_path / "home"))
    assert (
        json.loads(league_verb("restore", str(tmp_path / "again.tar"), *home, "--json").stdout)["files"] == again.files
    )
    assert "is not empty" in league_verb("restore", str(file), *home).stderr
    once_more = back_up(ServeSettings(runs=tmp_path / "home"), tmp_path / "more.tar")
    assert once_more.rows == {**again.rows, "sessions": 0}


def races_of_each_other(folder: Path) -> ServeSettings:
    """A database in which a row refers to a later one of its table."""
    settings = ServeSettings(runs=folder)
    settings.state.mkdir(parents=True)
    database = Database(settings.database_url)
    database.migrate()
    with database.transaction() as session:
        first, second = (Race(owner_id=1, title=name, track="oval", ranking="sum") for name in ("first", "second"))
        session.add_all((first, second))
        session.flush()
        first.after_id = second.id
    database.close()
    return settings


def test_what_a_row_refers_to_may_come_later(tmp_path: Path) -> None:
    made = back_up(races_of_each_other(tmp_path / "a"), tmp_path / "a.tar")
    assert restore(ServeSettings(runs=tmp_path / "b"), tmp_path / "a.tar").rows == {"users": 1, "races": 2}
    database = Database(ServeSettings(runs=tmp_path / "b").database_url)
    with database.transaction() as session:
        found = [(race.title, race.after_id, race.closes, race.rules) for race in session.scalars(sa.select(Race))]
    database.close()
    assert (made.files, found) == (0, [("first", 2, None, {}), ("second", None, None, {})])
    with pytest.raises(RunError, match="cannot be written: No such file"):
        back_up(ServeSettings(runs=tmp_path / "b"), tmp_path / "nowhere" / "a.tar")
    for inside in (tmp_path / "b" / "b.tar", tmp_path / "b" / ".racecraft" / "b.tar"):
        with pytest.raises(RunError, match="lies in the league's folder"):
            back_up(ServeSettings(runs=tmp_path / "b"), inside)
        assert not inside.exists()
    with pytest.raises(RunError, match="exists already"):
        back_up(ServeSettings(runs=tmp_path / "b"), tmp_path / "a.tar")


def test_a_backup_is_private_and_whole_whatever_one_before_it_left(tmp_path: Path) -> None:
    settings, file = races_of_each_other(tmp_path / "runs"), tmp_path / "a.tar"
    (tmp_path / "a.tar.partial").write_bytes(b"of one that was killed")
    (tmp_path / "elsewhere").mkdir()
    (settings.runs / "moved").symlink_to(tmp_path / "elsewhere")
    with pytest.warns(UserWarning, match="moved is a link: what it leads to is not in the backup"):
        back_up(settings, file)
    assert file.stat().st_mode & 0o077 == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.tar", "a.tar.partial", "elsewhere", "runs"]
    assert restore(ServeSettings(runs=tmp_path / "b"), file).rows == {"users": 1, "races": 2}


@pytest.mark.costly
def test_a_link_for_a_password_leads_to_an_address(tmp_path: Path) -> None:
    races_of_each_other(tmp_path / "runs")
    for address in ("racing.example.org", "https://racing.example.org/console"):
        done = league_verb("reset", "you", "--runs", str(tmp_path / "runs"), "--address", address)
        assert (done.returncode, done.stdout) == (1, "")
        assert "allowed are https://NAME and http://NAME:PORT" in done.stderr
    done = league_verb("reset", "you", "--runs", str(tmp_path / "runs"), "--address", "http://192.168.1.20:8321")
    assert done.stdout.startswith("http://192.168.1.20:8321/reset#")


def test_the_rows_are_of_one_moment(database_url: str, tmp_path: Path) -> None:
    """Somebody makes a group and comes into it after the groups were read, and before the members are."""
    database = Database(database_url)
    database.migrate()
    settings = ServeSettings(runs=tmp_path / "runs", database=database_url)
    settings.runs.mkdir()
    written: list[int] = []

    def come_in(_: object, __: object, statement: str, *___: object) -> None:
        if "FROM members" in statement and not written:
            written.append(1)
            with database.transaction() as session:
                session.add(Group(id=7, title="Meanwhile"))
                session.flush()
                session.add(Member(group_id=7, user_id=1))

    sa.event.listen(sa.Engine, "before_cursor_execute", come_in)
    try:
        made = back_up(settings, tmp_path / "backup.tar")
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", come_in)
        database.close()
    assert (written, made.rows["groups"], made.rows["members"]) == ([1], 0, 0)
    assert back_up(settings, tmp_path / "later.tar").rows["members"] == 1


def test_what_is_no_whole_backup_leaves_nothing(tmp_path: Path) -> None:
    def tar(name: str, **members: bytes) -> Path:
        with tarfile.open(tmp_path / name, "w") as file:
            for member, data in members.items():
                info = tarfile.TarInfo(member)
                info.size = len(data)
                file.addfile(info, io.BytesIO(data))
        return tmp_path / name

    def sparse(name: str) -> Path:
        """A file of ten gigabytes that is one hole: its map says that there is a single byte, behind the end."""
        hole = tarfile.TarInfo("files/hole")
        hole.pax_headers = {
            "GNU.sparse.major": "0",
            "GNU.sparse.minor": "1",
            "GNU.sparse.size": str(10**10),
            "GNU.sparse.map": f"{10**10},0",
        }
        with tarfile.open(tmp_path / name, "w", format=tarfile.PAX_FORMAT) as file:
            file.addfile(hole)
        return tmp_path / name

    start = {"manifest.json": b'{"format": 1, "created": "", "racecraft": "", "revision": "0001", "rows": {}}'}
    (tmp_path / "text").write_bytes(b"not a tar at all" * 100)
    for source, told in (
        (tmp_path / "text", "no backup of a league"),
        (tar("empty"), "no whole backup"),
        (tar("broken", **start, **{"files/a": b"1"}), "no whole backup"),
        (tar("outside", **start, **{"files/../../x": b"1", "end": b""}), "no place in a league"),
        (tar("old", **start, **{"database.jsonl": b"", "end": b""}), "version 0001"),
        (tar("nameless", **start, **{"": b"1", "end": b""}), "no place in a league"),
        (tmp_path / "nowhere", "No such file"),
        (tmp_path, "Is a directory"),
        (tar("large", **{"manifest.json": b" " * (1 << 20) + start["manifest.json"], "end": b""}), "no backup of"),
        (tar("list", **{"manifest.json": b"[]", "end": b""}), "no backup of a league"),
        (tar("deep", **{"manifest.json": b"[" * 100_000, "end": b""}), "no backup of a league"),
        (tar("undated", **{"manifest.json": b'{"format": 1}', "end": b""}), "no whole backup"),
        (sparse("sparse"), "which is no file"),
    ):
        with pytest.raises(RunError, match=told) as refused:
            restore(ServeSettings(runs=tmp_path / "place"), source)
        assert not str(refused.value).endswith(".."), "one sentence within another"
        assert not list(tmp_path.glob("place*"))
        assert not (tmp_path / "x").exists()
