"""A league has one server at a time: a second would count quotas, places and wrong passwords by itself."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa
from leagues import running_league
from postgres_servers import PostgresServer

from racecraft.errors import RunError
from racecraft.serve import server
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store import sole
from racecraft.serve.store.database import Database
from racecraft.serve.store.sole import sole_server

SOON = 30.0  # s


def a_second_is_refused(url: str) -> None:
    with (
        pytest.raises(RunError, match="Another server of this league is running on the same database"),
        sole_server(url, on_loss=pytest.fail, patience=0.3),
    ):
        pytest.fail("two servers count apart")


@pytest.mark.costly
def test_a_second_server_of_a_league_is_refused_until_the_first_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "sole_server", lambda url, on_loss: sole_server(url, on_loss=on_loss, patience=0.3))
    runs = tmp_path / "runs"
    settings = ServeSettings(runs=runs, port=0, league=True)
    with running_league(runs) as league:
        with pytest.raises(RunError, match="Another server"):
            server.serve(settings, on_ready=pytest.fail)
        elsewhere = ServeSettings(runs=tmp_path / "elsewhere", port=0, league=True, database=settings.database_url)
        with pytest.raises(RunError, match="Another server"):
            server.serve(elsewhere, on_ready=pytest.fail)
        league.console.kill()
        with sole_server(settings.database_url, on_loss=pytest.fail, patience=SOON):
            pass


@pytest.mark.parametrize("moment", ["before it listens", "while it serves"])
def test_a_server_that_lost_its_place_stops(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    told: list[Callable[[], None]] = []

    @contextmanager
    def place(url: str, on_loss: Callable[[], None]) -> Iterator[None]:
        if moment == "before it listens":
            on_loss()
        told.append(on_loss)
        yield

    monkeypatch.setattr(server, "sole_server", place)
    links: queue.Queue[str] = queue.Queue()
    settings = ServeSettings(runs=tmp_path / "runs", port=0, league=True)
    serving = threading.Thread(target=server.serve, args=(settings,), kwargs={"on_ready": links.put}, daemon=True)
    serving.start()
    link = links.get(timeout=SOON)
    if moment == "while it serves":
        assert httpx.get(f"{link.partition('/?')[0]}/api/health", timeout=SOON).status_code == 204
        told[0]()
    serving.join(SOON)
    assert not serving.is_alive(), "it would count beside the other"


def test_who_starts_while_the_one_before_stops_waits_for_it(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'console.db'}"
    with ExitStack() as first:
        first.enter_context(sole_server(url, on_loss=pytest.fail))
        has_left = threading.Event()
        first.callback(has_left.set)  # is done before the lock is given back
        first_leaves = threading.Timer(0.5, first.close)
        first_leaves.start()
        with sole_server(url, on_loss=pytest.fail, patience=SOON):
            assert has_left.is_set()
        first_leaves.join()


def test_where_no_lock_can_be_it_is_said(tmp_path: Path) -> None:
    (tmp_path / "console.db.server").mkdir()
    with (
        pytest.raises(RunError, match="cannot be opened: Is a directory"),
        sole_server(f"sqlite:///{tmp_path / 'console.db'}", on_loss=pytest.fail),
    ):
        pytest.fail("nobody would know of it")


def test_a_second_server_on_postgresql_is_refused_from_another_folder(postgres: PostgresServer) -> None:
    url = postgres.new_database()
    with sole_server(url, on_loss=pytest.fail):
        a_second_is_refused(url)
        with sole_server(postgres.new_database(), on_loss=pytest.fail, patience=0.3):
            pass  # another league of the same PostgreSQL
    with sole_server(url, on_loss=pytest.fail, patience=0.3):
        pass


@pytest.mark.costly  # it waits, mostly
def test_a_server_whose_connection_is_cut_takes_its_place_again_or_stops(
    postgres: PostgresServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sole, "WATCH", 0.2)
    url, lost = postgres.new_database(), threading.Event()
    database = Database(url)

    def cut() -> None:
        held = "SELECT pid FROM pg_locks WHERE locktype = 'advisory' AND database = (SELECT oid FROM pg_database"
        with database.engine.connect() as connection:
            ended = f"SELECT pg_terminate_backend(pid) FROM ({held} WHERE datname = current_database())) AS holders"
            assert len(connection.execute(sa.text(ended)).all()) == 1

    with sole_server(url, on_loss=lost.set):
        cut()
        time.sleep(2.0)
        a_second_is_refused(url)
        assert not lost.is_set()

        monkeypatch.setattr(sole, "WATCH", 4.0)
        time.sleep(0.5)
        cut()
        with sole_server(url, on_loss=pytest.fail, patience=SOON):  # quicker than the first
            assert lost.wait(SOON), "it would count beside the other"
    database.close()
