"""A real console for each file of tests, and a database of either kind for each test of the queue."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from leagues import running_league, untrained_run
from postgres_servers import PostgresServer, binaries, postgres_server
from running_consoles import RunningConsole, running_console
from running_workers import processes_on
from s3_servers import S3Server, s3_server
from schools import School

from racecraft.race.entry_file import pack_entry

if TYPE_CHECKING:
    from racecraft.serve.store.database import Database

pytest.importorskip("fastapi")

ON_BOTH = ("test_api", "test_archives", "test_races_api")
"""Files of tests that ask a console for what only its database knows."""


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    """A PostgreSQL server; skips where there is none."""
    pytest.importorskip("psycopg")
    if binaries() is None:
        pytest.skip("PostgreSQL is not installed: apt-get install postgresql")
    with postgres_server() as server:
        yield server


@pytest.fixture(scope="session")
def s3() -> Iterator[S3Server]:
    """An S3 server; skips where moto is not installed."""
    pytest.importorskip("moto.server")
    with s3_server() as server:
        yield server


ON_POSTGRESQL = pytest.param("postgresql", marks=pytest.mark.costly)
"""The second time that the same tests run."""


@pytest.fixture(params=["sqlite", ON_POSTGRESQL])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The URL of an empty database."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'console.db'}"
    server: PostgresServer = request.getfixturevalue("postgres")
    return server.new_database()


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    """A new console's, on SQLite, in this process; files that ask more of it have one of their own."""
    from racecraft.serve.store.database import Database

    database = Database(f"sqlite:///{tmp_path / 'console.sqlite'}")
    database.migrate()
    yield database
    database.close()


@pytest.fixture(scope="session")
def entry(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file to enter a race with, of a network that was never trained."""
    return pack_entry(untrained_run(tmp_path_factory.mktemp("runs"), "novice"))


@pytest.fixture
def runs(tmp_path: Path) -> Iterator[Path]:
    """A folder on which nothing works after the test any more: jobs of a console that was killed go on without it."""
    folder = tmp_path / "runs"
    yield folder
    for process in processes_on(folder):
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run what depends on the database on both, and pages, drives and the like on SQLite alone."""
    if "console" in metafunc.fixturenames:
        databases = ["sqlite", ON_POSTGRESQL] if metafunc.module.__name__ in ON_BOTH else ["sqlite"]
        metafunc.parametrize("console", databases, indirect=True, scope="module")


@pytest.fixture(scope="module")
def console(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningConsole]:
    """A console on the database that `pytest_generate_tests` chose."""
    options = []
    if request.param == "postgresql":
        server: PostgresServer = request.getfixturevalue("postgres")
        options = ["--database", server.new_database()]
    with running_console(tmp_path_factory.mktemp("console") / "runs", *options) as running:
        yield running


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[School]:
    with running_league(tmp_path_factory.mktemp("access") / "runs") as league:
        yield School(league)
