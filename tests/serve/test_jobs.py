"""The queue: one owner to a job, leases, cancelling; and servers and workers that are killed."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from datetime import timedelta
from importlib import import_module
from pathlib import Path

import pytest
import sqlalchemy as sa
from postgres_servers import PostgresServer
from running_consoles import LEISURELY, running_console

from racecraft.errors import ConfigError, RunError
from racecraft.serve.jobs.queue import KINDS, MAX_DEATHS, MAX_LOSSES, JobQueue, kinds_of
from racecraft.serve.jobs.turns import waiting_line
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.database import Database, upgrade
from racecraft.serve.store.tables import Job, Table, User, now


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    yield database
    database.close()


@pytest.fixture
def queue(database: Database) -> JobQueue:
    return JobQueue(database)


def expire(database: Database) -> None:
    with database.transaction() as session:
        session.execute(sa.update(Job).values(lease_until=now() - timedelta(seconds=1)))


def state(queue: JobQueue, job_id: str) -> str:
    job = queue.get(job_id)
    assert job is not None
    return job.state


def test_the_migrations_make_the_tables_that_the_code_expects(database: Database) -> None:
    database.migrate()  # a second time changes nothing
    inspector = sa.inspect(database.engine)
    for table in Table.metadata.tables.values():
        columns = {column["name"]: column for column in inspector.get_columns(table.name)}
        assert set(columns) == set(table.columns.keys())
        assert all(columns[c.name]["nullable"] == c.nullable for c in table.columns)


@pytest.mark.costly
def test_the_migrations_and_the_tables_made_at_once_are_the_same(database_url: str) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    database = Database(database_url)
    with database._alone() as connection:
        upgrade(connection)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": False})
        assert compare_metadata(context, Table.metadata) == []
    database.migrate()  # nothing is left to do, and the local user is there
    database.close()


def test_a_start_with_nothing_to_do_waits_for_nobody_who_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("racecraft.serve.store.database.PATIENCE", 0.2)
    first, second = (Database(f"sqlite:///{tmp_path / 'console.db'}") for _ in range(2))
    first.migrate()
    with first._alone():
        second.migrate()
    first.close()
    second.close()


OPENS = """
import sys
from racecraft.serve.store.database import Database

for url in sys.stdin:
    print(flush=True)
    input()
    database = Database(url.strip())
    database.migrate()
    database.close()
    print("migrated", flush=True)
"""


@pytest.fixture(scope="module")
def two_servers() -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that open what they are told; most of their start is loading."""
    command = [sys.executable, "-c", OPENS]
    both = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    yield both
    for process in both:
        process.communicate()
    assert [process.returncode for process in both] == [0, 0]


def opened_together(both: Sequence[subprocess.Popen[str]], urls: Sequence[str]) -> None:
    """Two processes bring each of some databases up to date, both at the same moment."""
    for url in urls:
        for said, answer in ((url, "\n"), ("", "migrated\n")):
            for process in both:
                print(said, file=process.stdin, flush=True)
            assert [process.stdout.readline() for process in both if process.stdout] == [answer] * 2


@pytest.mark.costly
def test_two_servers_that_make_a_database_at_the_same_moment_make_one(
    tmp_path: Path, two_servers: list[subprocess.Popen[str]]
) -> None:
    opened_together(two_servers, [f"sqlite:///{tmp_path / f'{number}.db'}" for number in range(20)])


@pytest.mark.costly
def test_two_servers_bring_an_old_database_up_to_date_once(
    database_url: str, two_servers: list[subprocess.Popen[str]]
) -> None:
    database = Database(database_url)
    with database._alone() as connection:
        upgrade(connection, "0015")
    opened_together(two_servers, [database_url])
    database.require_current()
    with database.transaction() as session:
        assert list(session.scalars(sa.select(User.name))) == ["you"]
    database.close()


@pytest.mark.costly
def test_two_servers_that_fill_an_empty_postgresql_fill_it_once(
    postgres: PostgresServer, two_servers: list[subprocess.Popen[str]]
) -> None:
    opened_together(two_servers, [postgres.new_database() for _ in range(10)])


def test_a_database_that_cannot_be_opened_is_told(tmp_path: Path) -> None:
    (tmp_path / "file.db").write_bytes(b"not a database, but long enough to be read as one" * 100)
    with pytest.raises(RunError, match="cannot be opened"):
        Database(f"sqlite:///{tmp_path / 'file.db'}").migrate()


@pytest.mark.parametrize(
    "url", ["sqlite", "sqlite:x.db", "sqlite://", "sqlite:///", "sqlite:///:memory:", "mysql://a@b/c"]
)
def test_what_is_no_database_is_refused(tmp_path: Path, url: str) -> None:
    told = url if url.startswith("sqlite") else "mysql"
    with pytest.raises(ConfigError, match=f"^database is '{told}'; allowed are sqlite:///FILE and "):
        ServeSettings(runs=tmp_path, database=url)


def test_a_folder_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"^runs is .*; allowed is a path in UTF-8\.$"):
        ServeSettings(runs=tmp_path / "b\udcffd")


def test_an_address_of_a_database_that_cannot_be_read_is_told_without_its_password() -> None:
    with pytest.raises(ConfigError, match="address of the console's database cannot be read") as told:
        Database("postgresql+psycopg://racecraft:secret:p@rt@db.local:secret/racecraft")
    assert "secret" not in str(told.value)


def test_a_database_lies_in_its_folder_whatever_that_is_called(tmp_path: Path) -> None:
    folder = tmp_path / "which? 50% #1"
    folder.mkdir()
    database = Database(f"sqlite:///{folder / 'console.db'}")
    database.migrate()
    database.close()
    assert (folder / "console.db").is_file()
    assert [path.name for path in tmp_path.iterdir()] == [folder.name]


def test_jobs_are_claimed_in_order_by_kind(queue: JobQueue) -> None:
    first, second = queue.add("train", "a", {}), queue.add("train", "b", {})
    other = queue.add("evaluate", "a", {})
    assert queue.claim(("evaluate",), owner="x").id == other.id  # type: ignore[union-attr]
    assert queue.claim(("train",), owner="x").id == first.id  # type: ignore[union-attr]
    assert queue.claim(("train",), owner="y").id == second.id  # type: ignore[union-attr]
    assert queue.claim(("train", "evaluate"), owner="z") is None


def test_nobodys_hundred_jobs_stand_before_anothers_first(database: Database, queue: JobQueue) -> None:
    with database.transaction() as session:
        session.add(User(id=2, name="Bob", handle="bob"))
    bob = queue.of(2)
    running = queue.add("train", "many-0", {})
    assert queue.claim(("train",), owner="w") is not None
    many = [queue.add("train", f"many-{number}", {}) for number in range(1, 101)]
    first, second = bob.add("train", "bobs-first", {}), bob.add("train", "bobs-second", {})
    assert bob.before(first) == ["…"], "only what has the place already"
    with database.transaction() as session:
        line = [job.id for job in waiting_line(session, ("train",), now())]
    assert line[:2] == [running.id, first.id]
    assert line[2:4] == [many[0].id, second.id], "turn by turn"
    assert (found := queue.claim(("train",), owner="w")) is not None
    assert found.id == first.id


def test_many_workers_never_own_a_job_together(database: Database) -> None:
    queue = JobQueue(database)
    for number in range(30):
        queue.add("train", f"run-{number}", {})
    claimed: list[str] = []

    def work(owner: str) -> None:
        mine = Database(database.url)
        while (job := JobQueue(mine).claim(("train",), owner=owner)) is not None:
            claimed.append(job.id)
        mine.close()

    threads = [threading.Thread(target=work, args=(str(number),)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(claimed) == len(set(claimed)) == 30


def test_a_job_whose_worker_is_gone_is_another_s(database: Database, queue: JobQueue) -> None:
    job = queue.add("train", "a", {})
    queue.claim(("train",), owner="first")
    assert queue.heartbeat(job.id, owner="first").word == "go on"
    queue.take_back_expired()
    assert state(queue, job.id) == "running"
    expire(database)
    queue.take_back_expired()
    assert queue.claim(("train",), owner="second") is not None
    assert queue.heartbeat(job.id, owner="first").word == "lost"
    assert not queue.finish(job.id, owner="first", state="done", result={})
    assert queue.finish(job.id, owner="second", state="done", result={"x": 1})
    assert queue.get(job.id).result == {"x": 1}  # type: ignore[union-attr]


def test_a_job_that_kills_its_workers_is_given_up(queue: JobQueue) -> None:
    job = queue.add("train", "a", {})
    for attempt in range(MAX_LOSSES):
        assert queue.claim(("train",), owner=str(attempt)) is not None
        queue.release(str(attempt))
    assert state(queue, job.id) == "failed"
    assert queue.claim(("train",), owner="x") is None


def test_a_job_that_gets_further_each_time_is_not_given_up(queue: JobQueue) -> None:
    job = queue.add("train", "a", {})
    for attempt in range(3 * MAX_LOSSES):
        assert queue.claim(("train",), owner=str(attempt)) is not None
        queue.heartbeat(job.id, owner=str(attempt), has_progressed=attempt % 2 == 0)
        queue.release(str(attempt))
    assert state(queue, job.id) == "queued"


def test_a_job_that_is_lost_with_its_machine_is_given_up_later(queue: JobQueue, database: Database) -> None:
    job = queue.add("train", "a", {})
    for attempt in range(MAX_DEATHS):
        assert queue.claim(("train",), owner=str(attempt)) is not None
        if attempt % 2:
            queue.release(str(attempt), has_company=True)  # as found by the next server
        else:
            expire(database)
            queue.take_back_expired()
    assert state(queue, job.id) == "failed"
    ended = queue.get(job.id)
    assert ended is not None
    assert f"died {MAX_DEATHS} times" in (ended.error or {})["message"]


def test_servers_that_are_stopped_do_not_count_as_losses(queue: JobQueue) -> None:
    job = queue.add("train", "a", {})
    for attempt in range(3 * MAX_LOSSES):
        assert queue.claim(("train",), owner=str(attempt)) is not None
        queue.hand_back(str(attempt))
    assert state(queue, job.id) == "queued"


def test_what_runs_takes_places_of_its_kinds_on_its_machine(queue: JobQueue) -> None:
    for kind in ("train", "train", "evaluate"):
        queue.add(kind, "a", {})
    assert queue.has_room(("train", "evaluate"), machine="", places=1)
    queue.claim(("train",), owner="x")
    queue.claim(("evaluate",), owner="y")
    assert [queue.has_room(("train",), machine="", places=places) for places in (1, 2)] == [False, True]
    assert [queue.has_room(("train", "evaluate"), machine="", places=places) for places in (2, 3)] == [False, True]
    assert queue.has_room(("train", "evaluate"), machine="elsewhere", places=1)


def test_every_kind_of_job_has_a_function() -> None:
    for kind in KINDS.values():
        module, _, function = kind.work.partition(":")
        assert callable(getattr(import_module(module), function))
    assert {name for slot in ("training", "other") for name in kinds_of(slot)} == set(KINDS)


def test_cancelling(queue: JobQueue) -> None:
    waiting, running = queue.add("train", "a", {}), queue.add("evaluate", "a", {})
    queue.cancel(waiting.id)
    assert state(queue, waiting.id) == "cancelled"
    queue.claim(("evaluate",), owner="x")
    queue.cancel(running.id)
    assert queue.heartbeat(running.id, owner="x").word == "stop"
    queue.release("x")
    assert state(queue, running.id) == "cancelled"  # not started again


@pytest.mark.slow
def test_a_killed_server_and_a_killed_worker_lose_nothing(runs: Path) -> None:
    with running_console(runs) as console:
        name = console.create(name="tough", until="20000 steps")
        console.wait_for(lambda: console.client.get(f"/api/models/{name}").json()["checkpoints"])
        console.kill()
    with running_console(runs) as console:
        job = console.client.get("/api/jobs").json()[0]
        ended = console.wait_for(console.job_ended(job["id"]))
        assert ended["state"] == "done"
        assert ended["result"]["steps"] >= 20_000
        assert len(console.client.get("/api/jobs").json()) == 1


@pytest.mark.slow
def test_a_stopped_server_hands_its_training_to_the_next(runs: Path) -> None:
    with running_console(runs) as console:
        name = console.create(name="patient", until="4000 steps", reward=LEISURELY)  # 8 s
        console.wait_for(lambda: console.client.get(f"/api/models/{name}/history").json()["points"])
    with running_console(runs) as console:
        job = console.client.get("/api/jobs").json()[0]
        ended = console.wait_for(console.job_ended(job["id"]))
        assert ended["state"] == "done"
        assert ended["result"]["steps"] >= 4000
        assert ended["attempts"] == 2


@pytest.mark.costly
def test_a_training_that_is_done_leaves_nothing_in_the_log(tmp_path: Path) -> None:
    with running_console(tmp_path / "runs") as console:
        console.create(name="a", train=False, track="oval", until="256 steps")
        job = console.client.post("/api/models/a/train", json={}).json()["id"]
        assert console.wait_for(console.job_ended(job))["state"] == "done"
    assert (tmp_path / "runs" / ".racecraft" / "jobs.log").read_text() == ""
