"""The database: opened, brought up to date, handed out as short transactions. SQLite or PostgreSQL, the same code."""

from __future__ import annotations

import re
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from racecraft.errors import ConfigError, RunError
from racecraft.serve.store.tables import Table, User, now

MIGRATIONS = Path(__file__).parent / "migrations"
SQLITE: Final = "sqlite:///"
LOCAL_USER = "you"  # of a console of one's own
PATIENCE: Final = 10.0
"""s that SQLite waits for another who writes."""
LOCK: Final = 0x7261636563726166
"""Of PostgreSQL: who holds it changes tables."""


class Database:
    """A pool of connections.

    Args:
        url: SQLAlchemy URL; the file of a ``sqlite:///FILE`` is taken to the letter.

    Raises:
        ConfigError: This is no such URL.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        try:
            self.engine = sa.create_engine(_opened(url), pool_pre_ping=not url.startswith("sqlite"))
        except (sa.exc.ArgumentError, ValueError) as error:  # whose message may hold a part of the password
            raise ConfigError(
                "The address of the console's database cannot be read.",
                hint="Allowed is postgresql+psycopg://USER:PASSWORD@HOST:PORT/NAME; in a password @ is %40, / is %2F.",
            ) from error
        if url.startswith("sqlite"):
            sa.event.listen(self.engine, "connect", _prepare_sqlite)
        self._sessions = sessionmaker(self.engine, expire_on_commit=False)

    def migrate(self) -> None:
        """Bring the tables up to date; a fresh database gets them all. Of those who begin together one does it.

        Where nothing is to be done nobody who writes is waited for.

        Raises:
            RunError: The database cannot be opened.
        """
        try:
            with self.engine.connect() as connection:
                if _is_ready(connection):
                    return
            with self._alone() as connection:  # and look again: meanwhile another may have done it
                version = _version(connection)
                if version == "":
                    _make(connection, _newest())
                elif version != _newest():
                    upgrade(connection)
                if not _is_ready(connection):
                    connection.execute(sa.insert(User).values(name=LOCAL_USER, handle=LOCAL_USER, role="admin"))
        except SQLAlchemyError as error:
            raise RunError(f"The console's database cannot be opened: {_reason(error)}.") from error

    def require_current(self) -> str:
        """Refuse a database that another version of Racecraft made; nothing is changed.

        Returns:
            Its version.

        Raises:
            RunError: It is one, or it cannot be opened.
        """
        try:
            with self.engine.connect() as connection:
                version = connection.scalar(sa.text("SELECT version_num FROM alembic_version"))
        except SQLAlchemyError as error:
            raise RunError(
                f"The console's database cannot be opened: {_reason(error)}.", hint="Start the console first."
            ) from error
        if version != _newest():
            raise RunError(
                f"The console's database is of version {version}, this worker's is {_newest()}.",
                hint="Install the same version of Racecraft on both machines.",
            )
        return str(version)

    @contextmanager
    def fresh(self, version: str) -> Iterator[sa.Connection]:
        """A transaction in which the tables are made, without a row, where there are none; kept if the block ends well.

        Args:
            version: Of the tables that are meant.

        Raises:
            RunError: There are tables, they cannot be made, or this Racecraft's are of another version.
        """
        if version != _newest():
            raise RunError(
                f"The tables are of version {version[:20]}, this Racecraft's are {_newest()}.",
                hint="Install the version of Racecraft that wrote them; a newer one brings them up to date later.",
            )
        try:
            with self.engine.begin() as connection:
                names = sa.inspect(connection).get_table_names()
                if names:
                    raise RunError(f"The database is not empty: it has a table {names[0]!r}.")
                _make(connection, version)
                yield connection
        except SQLAlchemyError as error:
            raise RunError(f"The database does not take this: {_reason(error)}.") from error

    @contextmanager
    def _alone(self) -> Iterator[sa.Connection]:
        """A transaction to change tables in; another process that wants one waits for its end."""
        with self.engine.connect() as connection:
            is_sqlite = connection.dialect.name == "sqlite"
            if is_sqlite:  # it changes a table by making it anew, while others refer to it
                connection.exec_driver_sql("PRAGMA foreign_keys=OFF")
                connection.commit()
            with connection.begin():
                connection.exec_driver_sql("BEGIN IMMEDIATE" if is_sqlite else f"SELECT pg_advisory_xact_lock({LOCK})")
                yield connection
            if is_sqlite:
                connection.exec_driver_sql("PRAGMA foreign_keys=ON")
                connection.commit()

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """A session whose changes are kept when the block ends well, and dropped otherwise."""
        with self._sessions.begin() as session:
            yield session

    @contextmanager
    def one_moment(self) -> Iterator[sa.Connection]:
        """A connection for several questions that all see the same moment, whatever is written meanwhile."""
        is_sqlite = self.engine.dialect.name == "sqlite"
        isolation = "SERIALIZABLE" if is_sqlite else "REPEATABLE READ"
        with self.engine.connect().execution_options(isolation_level=isolation) as connection:
            if is_sqlite:  # whose driver begins no transaction to read
                connection.exec_driver_sql("BEGIN")
            yield connection

    @contextmanager
    def asking(self) -> Iterator[sa.Connection]:
        """A connection for a question of columns that is asked all the time: a quarter of what a session costs."""
        with self.engine.connect() as connection:
            yield connection

    def moment(self, session: Session) -> datetime:
        """Now by the database's clock, which all machines share; SQLite's is this machine's."""
        if self.url.startswith("sqlite"):
            return now()
        found: datetime = session.execute(sa.select(sa.func.now())).scalar_one()
        return found

    def answers(self) -> None:
        """Read something.

        Raises:
            DBAPIError: It cannot be read.
        """
        with self.engine.connect() as connection:
            connection.execute(sa.text("SELECT version_num FROM alembic_version"))

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()


def _opened(url: str) -> str | sa.URL:
    """A folder's name may hold what an address takes for its own, such as ? and %."""
    file = url.removeprefix(SQLITE)
    return url if file == url else sa.URL.create("sqlite", database=file)


def _version(connection: sa.Connection) -> str:
    """Of the tables; empty for a fresh database."""
    if not sa.inspect(connection).has_table("alembic_version"):
        return ""
    return str(connection.scalar(sa.text("SELECT version_num FROM alembic_version")))


def _is_ready(connection: sa.Connection) -> bool:
    """Whether the tables are the newest, and somebody is there."""
    return _version(connection) == _newest() and connection.scalar(sa.select(User.id).limit(1)) is not None


def upgrade(connection: sa.Connection, to: str = "head") -> None:
    """Bring tables up to a version, in a transaction of `Database._alone`."""
    from alembic import command  # takes its time to load, and most starts do without
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.attributes["connection"] = connection
    command.upgrade(config, to)


def _make(connection: sa.Connection, version: str) -> None:
    """All tables as they are now; tests hold the migrations to giving the same."""
    Table.metadata.create_all(connection)
    connection.execute(sa.text("CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL PRIMARY KEY)"))
    connection.execute(sa.text("INSERT INTO alembic_version VALUES (:version)"), {"version": version})


def _reason(error: SQLAlchemyError) -> str:
    return str(getattr(error, "orig", None) or error).splitlines()[0]


def _newest() -> str:
    """The newest migration's revision; their files are in order."""
    newest = max((MIGRATIONS / "versions").glob("[0-9]*.py"), key=lambda path: path.name)
    found = re.search(r'^revision = "(.+)"$', newest.read_text(encoding="utf-8"), re.MULTILINE)
    return found[1] if found else ""


def _prepare_sqlite(connection: Any, _: object) -> None:
    """Readers beside a writer, no lost commits, and a wait instead of an error when two write."""
    cursor = connection.cursor()
    for pragma in (f"busy_timeout={1000 * PATIENCE:.0f}", "synchronous=NORMAL", "foreign_keys=ON"):
        cursor.execute(f"PRAGMA {pragma}")
    until = time.monotonic() + PATIENCE
    while True:  # of two who make one file write-ahead together SQLite refuses one at once
        try:
            cursor.execute("PRAGMA journal_mode=WAL")
            break
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:
                raise
            time.sleep(0.01)
    cursor.close()
