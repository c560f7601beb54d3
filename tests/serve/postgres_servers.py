"""A real PostgreSQL of the tests' own: in a folder of its own, reached by a Unix socket, run without privileges."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

USER = "racecraft"
PATIENCE = 300.0  # s


def binaries() -> Path | None:
    """The folder of initdb and postgres; Debian keeps them off PATH."""
    found = [Path(path).resolve().parent for path in (shutil.which("initdb"), shutil.which("postgres")) if path]
    found += sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    return next((path for path in found if (path / "initdb").exists() and (path / "postgres").exists()), None)


@dataclass
class PostgresServer:
    """A running server."""

    folder: Path
    process: subprocess.Popen[bytes]
    count: int = 0

    def url(self, name: str = "postgres") -> str:
        return f"postgresql+psycopg://{USER}@/{name}?host={self.folder}"

    def new_database(self) -> str:
        """The URL of a fresh database."""
        import psycopg

        self.count += 1
        name = f"console_{self.count}"
        with psycopg.connect(f"user={USER} host={self.folder} dbname=postgres", autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return self.url(name)

    def restart(self) -> None:
        """Cut all connections, as a restarted server does."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE)
        self.process = _start(self.folder)


@contextmanager
def postgres_server() -> Iterator[PostgresServer]:
    folder = Path(tempfile.mkdtemp(prefix="racecraft-postgres-"))
    try:
        if os.geteuid() == 0:  # PostgreSQL refuses to run as root
            shutil.chown(folder, "nobody", "nogroup")
        arguments = ["-D", str(folder / "data"), "-U", USER, "-A", "trust", "-E", "UTF8", "--no-sync"]
        done = subprocess.run([_binary("initdb"), *arguments], **_unprivileged(folder), capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        server = PostgresServer(folder, _start(folder))
        try:
            yield server
        finally:
            server.process.send_signal(signal.SIGINT)
            server.process.wait(PATIENCE)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _start(folder: Path) -> subprocess.Popen[bytes]:
    settings = {
        "listen_addresses": "",
        "unix_socket_directories": str(folder),
        "fsync": "off",
        "shared_buffers": "16MB",
    }
    options = [part for name, value in settings.items() for part in ("-c", f"{name}={value}")]
    with (folder / "server.log").open("ab") as log:
        process = subprocess.Popen(
            [_binary("postgres"), "-D", str(folder / "data"), *options], stdout=log, stderr=log, **_unprivileged(folder)
        )
    import psycopg

    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            psycopg.connect(f"user={USER} host={folder} dbname=postgres").close()
            return process
        except psycopg.OperationalError:
            assert process.poll() is None, (folder / "server.log").read_text()
            assert time.monotonic() < deadline
            time.sleep(0.05)


def _binary(name: str) -> str:
    folder = binaries()
    assert folder is not None
    return str(folder / name)


def _unprivileged(folder: Path) -> dict[str, object]:
    identity = {"user": "nobody", "group": "nogroup", "extra_groups": []} if os.geteuid() == 0 else {}
    return {"cwd": folder, "env": {**os.environ, "HOME": str(folder), "LC_ALL": "C.UTF-8"}, **identity}
