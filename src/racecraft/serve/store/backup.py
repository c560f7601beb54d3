"""A league in one file: its database as it was at one moment, and its folder.

    backup.tar:  manifest.json   database.jsonl (a row a line, whatever the database)   files/…   end

The database comes first, in one transaction that sees one moment, and the files after it: whatever a row names was
there by then. What is written meanwhile is caught as a killed server would leave it, and from that a server goes on.
"""

from __future__ import annotations

import json
import os
import shutil
import tarfile
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import IO, Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError

from racecraft.errors import RunError
from racecraft.serve.settings import INCOMING, STATE_FOLDER, ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Session, Table, UtcTime, now
from racecraft.version import VERSION

MANIFEST: Final = "manifest.json"
ROWS: Final = "database.jsonl"
FILES: Final = "files"
END: Final = "end"
"""The last member, by which a file that broke off is known."""
LEFT_OUT: Final = (f"{STATE_FOLDER}/console.db", f"{STATE_FOLDER}/{INCOMING}/", f"{STATE_FOLDER}/uploads/")
"""Paths in the folder, or in that of a person: the database is in the backup by its rows, the rest was on its way."""
MAX_MANIFEST: Final = 1 << 20
"""Bytes."""
NOT_OURS: Final = (
    *(tarfile.TarError, ValueError, KeyError, TypeError, AttributeError, EOFError, OverflowError, RecursionError),
)
"""What reading something else raises."""
PASSING: Final = (".lock", ".live")
"""Beginnings of names of what only a running job has."""


@dataclass(frozen=True)
class Backup:
    """What a backup holds."""

    created: str
    racecraft: str
    revision: str
    rows: dict[str, int]
    files: int


def back_up(settings: ServeSettings, to: Path) -> Backup:
    """Write a league down; its server may be running.

    Args:
        settings: Of the league.
        to: The file, which only its owner may read, for it holds what races keep secret.

    Raises:
        RunError: The file exists, lies in the league's folder or cannot be written, or the database cannot be read.
    """
    if to.exists():
        raise RunError(f"{to} exists already.", hint="Name another file.")
    if to.resolve().is_relative_to(settings.runs.resolve()):
        raise RunError(f"{to} lies in the league's folder, of which it is.", hint="Name a file outside of it.")
    database = Database(settings.database_url)
    try:
        revision = database.require_current()
        with tempfile.TemporaryFile() as rows, _growing(to) as stream, tarfile.open(None, "w", stream) as tar:
            counts = _write_rows(database, rows)
            about = {"format": 1, "created": now().isoformat(), "racecraft": VERSION, "revision": revision}
            _add(tar, MANIFEST, json.dumps({**about, "rows": counts}).encode())
            described = tarfile.TarInfo(ROWS)
            described.size = rows.tell()
            rows.seek(0)
            tar.addfile(described, rows)
            files = 0
            for name, data in _files(settings.runs):
                _add(tar, f"{FILES}/{name}", data)
                files += 1
            _add(tar, END, b"")
    except SQLAlchemyError as error:
        raise RunError(f"The league's database cannot be read: {str(error).splitlines()[0]}.") from error
    except OSError as error:
        raise RunError(f"{to} cannot be written: {error.strerror or error}.") from error
    finally:
        database.close()
    return Backup(about["created"], VERSION, revision, counts, files)  # type: ignore[arg-type]


def restore(settings: ServeSettings, source: Path) -> Backup:
    """Put a league where there is none; everybody signs in anew.

    Args:
        settings: Of the place: a folder that is empty or not there, and a database without tables.
        source: What `back_up` wrote.

    Raises:
        RunError: The place is not empty, or the file is no whole backup of this version.
    """
    if settings.runs.exists() and any(settings.runs.iterdir()):
        raise RunError(f"{settings.runs} is not empty.", hint="A league is restored into a folder of its own.")
    incoming = settings.runs.with_name(f"{settings.runs.name}.restoring")
    if incoming.exists():
        raise RunError(f"{incoming} is left of another try.", hint="Remove it first.")
    try:
        about, files = _unpack(source, incoming / FILES, incoming / ROWS)
        folder = incoming / FILES
        folder.joinpath(STATE_FOLDER).mkdir(parents=True, exist_ok=True)
        is_inside = not settings.database  # then it comes with the folder
        database = Database(f"sqlite:///{folder / STATE_FOLDER / 'console.db'}" if is_inside else settings.database)
        try:
            with database.fresh(about["revision"]) as connection, (incoming / ROWS).open("rb") as rows:
                counts = _read_rows(connection, rows)
                if counts != {name: count for name, count in about["rows"].items() if count}:
                    raise RunError("The backup's rows are not those that it counts.")
        finally:
            database.close()
        if settings.runs.exists():
            settings.runs.rmdir()
        settings.runs.parent.mkdir(parents=True, exist_ok=True)
        folder.rename(settings.runs)
    except RunError:  # a ValueError, too, and said already
        raise
    except NOT_OURS as error:
        raise RunError(f"{source} is no backup of a league: {error}.") from error
    except OSError as error:
        raise RunError(f"{source} cannot be restored: {error.strerror or error}.") from error
    finally:
        shutil.rmtree(incoming, ignore_errors=True)
    return Backup(about["created"], about["racecraft"], about["revision"], counts, files)


def _write_rows(database: Database, to: IO[bytes]) -> dict[str, int]:
    """Every row of one moment, a line each; how many by table. Sessions stay behind."""
    counts: dict[str, int] = {}
    with database.one_moment() as connection:
        for table in Table.metadata.sorted_tables:
            counts[table.name] = 0
            if table is Session.__table__:
                continue
            for row in connection.execute(sa.select(table)).mappings():
                line = {"table": table.name, "row": dict(row)}
                to.write(json.dumps(line, default=_told).encode() + b"\n")
                counts[table.name] += 1
    return counts


def _told(value: object) -> str:
    if isinstance(value, datetime):
        return value.isoformat()
    raise TypeError(f"cannot write down a {type(value).__name__}")


def _read_rows(connection: sa.Connection, lines: IO[bytes]) -> dict[str, int]:
    """Put every row into its table; how many by table."""
    counts: dict[str, int] = {}
    tables = Table.metadata.tables
    later: list[tuple[sa.Table, Any, dict[str, Any]]] = []  # what refers to rows of the same table
    for raw in lines:
        line = json.loads(raw)
        table, row = tables[line["table"]], line["row"]
        for column in table.columns:
            if row[column.key] is None:
                row[column.key] = sa.null()  # rather than JSON's
            elif isinstance(column.type, UtcTime):
                row[column.key] = datetime.fromisoformat(row[column.key])
            elif any(key.column.table is table for key in column.foreign_keys):
                later.append((table, row["id"], {column.key: row[column.key]}))
                row[column.key] = None
        connection.execute(sa.insert(table).values(row))
        counts[table.name] = counts.get(table.name, 0) + 1
    for table, number, values in later:
        connection.execute(sa.update(table).where(table.c.id == number).values(values))
    if connection.dialect.name == "postgresql":  # whose counters do not see numbers that are given
        for table in tables.values():
            if "id" in table.c and isinstance(table.c.id.type, sa.Integer) and counts.get(table.name):
                highest = sa.select(sa.func.max(table.c.id)).scalar_subquery()
                counter = sa.func.pg_get_serial_sequence(table.name, "id")
                connection.execute(sa.select(sa.func.setval(counter, highest)))
    return counts


def _is_left_out(name: str) -> bool:
    return any(f"/{part}" in f"/{name}" for part in LEFT_OUT)


def _files(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Every file of a folder that is still there when its turn comes; of links only that they are there is told."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if _is_left_out(name) or path.name.startswith(PASSING):
            continue
        if path.is_symlink():
            warnings.warn(f"{path} is a link: what it leads to is not in the backup.", stacklevel=3)
            continue
        if not path.is_file():
            continue
        try:
            yield name, path.read_bytes()
        except FileNotFoundError:
            continue


def _unpack(source: Path, files: Path, rows: Path) -> tuple[dict[str, Any], int]:
    """Lay a backup out; its manifest, and how many files it has."""
    about: dict[str, Any] = {}
    count, is_whole = 0, False
    files.mkdir(parents=True)
    with tarfile.open(source, "r:") as tar:
        for member in tar:
            is_plain = member.isfile() and not member.issparse()  # whose holes would fill a disk
            stream = tar.extractfile(member) if is_plain else None
            if stream is None:
                raise RunError(f"{source} holds {member.name[:80]!r}, which is no file.")
            is_whole = member.name == END
            if member.name == MANIFEST:
                about = json.loads(stream.read(MAX_MANIFEST))
            elif member.name == ROWS:
                _write(rows, stream)
            elif not is_whole:
                path = PurePosixPath(member.name)
                if path.parts[:1] != (FILES,) or ".." in path.parts or len(path.parts) < 2:
                    raise RunError(f"{source} holds {member.name[:80]!r}, which has no place in a league.")
                _write(files.joinpath(*path.parts[1:]), stream)
                count += 1
    if not is_whole or about.get("format") != 1 or "racecraft" not in about or "created" not in about:
        raise RunError(f"{source} is no whole backup of a league.")
    return about, count


def _write(path: Path, stream: IO[bytes]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        while part := stream.read(1 << 20):
            file.write(part)


def _add(tar: tarfile.TarFile, name: str, data: bytes) -> None:
    described = tarfile.TarInfo(name)
    described.size = len(data)
    tar.addfile(described, BytesIO(data))


@contextmanager
def _growing(path: Path) -> Iterator[IO[bytes]]:
    """A file that only its owner reads, and that has this name once it is whole."""
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", suffix=".partial", delete=False) as file:
        try:
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(file.name, path)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise
