"""The worker that waits: it does the next job, is replaced when it dies, and does not outlive its server."""

from __future__ import annotations

import asyncio
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from running_consoles import running_console
from running_workers import processes_on

from racecraft.errors import RunError
from racecraft.run.lock import exclusive_lock
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Standby, Supervisor
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.database import Database
from racecraft.training import train

PATIENCE = 120.0  # s; the machine may be busy


@pytest.fixture
def settings(tmp_path: Path) -> ServeSettings:
    settings = ServeSettings(runs=tmp_path / "runs")
    (settings.state / "workers").mkdir(parents=True)
    return settings


@pytest.fixture
def standby(settings: ServeSettings) -> Iterator[Standby]:
    folder, log = settings.state / "workers", settings.state / "jobs.log"
    standby = Standby(settings.runs, workers=folder, access=Access.of(settings), log=log)
    yield standby
    standby.close()


@pytest.mark.costly
def test_the_waiting_worker_does_the_next_job(settings: ServeSettings, standby: Standby) -> None:
    database = Database(settings.database_url)
    database.migrate()
    queue = JobQueue(database)
    standby.prepare()
    waiting = standby._waiting
    standby.prepare()
    assert standby._waiting is waiting
    job = queue.add("evaluate", "nothing", {})
    assert queue.claim(("evaluate",), owner=standby.name()) is not None
    worker = standby.start(job.id)
    assert worker is waiting
    assert worker.wait(PATIENCE) == 0
    assert worker.stdin is not None
    worker.stdin.close()
    ended = queue.get(job.id)
    assert ended is not None
    assert ended.state == "failed"
    assert "nothing" in (ended.error or {})["message"]
    database.close()


@pytest.mark.costly
def test_after_a_short_job_it_waits_for_another(settings: ServeSettings, standby: Standby) -> None:
    database = Database(settings.database_url)
    database.migrate()
    queue = JobQueue(database)
    workers = []
    for _ in range(2):
        job, name = queue.add("judge", "", {}), standby.name()  # of no submission, which is its sentence
        assert queue.claim(("judge",), owner=name) is not None
        workers.append(standby.start(job.id))
        assert select.select([standby.bell], [], [], PATIENCE)[0], "it rings when a job has ended"
        os.read(standby.bell, 10)
        assert queue.held(name) is None
        assert (ended := queue.get(job.id)) is not None
        assert ended.state == "failed"
        assert workers[-1].poll() is None
        assert standby.take(name, workers[-1])
    assert workers[0] is workers[1]
    assert not standby.take("another", workers[0]), "one is enough"
    database.close()


@pytest.mark.costly
@pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")
def test_a_worker_waits_once_somebody_looks_at_a_page(tmp_path: Path) -> None:
    with running_console(tmp_path) as console:
        for _ in range(3):
            assert console.client.get("/api/jobs").status_code == 200
        assert processes_on(tmp_path) == []
        assert console.client.get("/").status_code == 200
        console.wait_for(lambda: len(processes_on(tmp_path)) == 1)


def test_on_another_machine_a_worker_waits_from_the_start(settings: ServeSettings) -> None:
    database = Database(settings.database_url)
    database.migrate()
    supervisor = Supervisor(settings, JobQueue(database), Access.of(settings), is_home=False)
    supervisor._tend()
    assert len(list((settings.state / "workers").iterdir())) == 1
    asyncio.run(supervisor.stop())
    database.close()


def test_one_that_died_is_replaced(standby: Standby) -> None:
    standby.prepare()
    dead = standby._waiting
    assert dead is not None
    dead.kill()
    dead.wait()
    standby.prepare()
    assert standby._waiting is not None
    assert standby._waiting.pid != dead.pid


def test_it_holds_its_lock_from_its_first_moment_to_its_last(settings: ServeSettings, standby: Standby) -> None:
    standby.prepare()
    (lock,) = (settings.state / "workers").iterdir()
    assert lock.name == standby.name()
    with pytest.raises(RunError), exclusive_lock(lock):  # so no server takes it for dead while it loads
        pass
    assert standby._waiting is not None
    standby._waiting.kill()
    standby._waiting.wait()
    with exclusive_lock(lock):
        pass


@pytest.mark.costly
def test_without_a_server_nobody_waits(standby: Standby) -> None:
    standby.prepare()
    worker, standby._waiting = standby._waiting, None
    assert worker is not None
    assert worker.stdin is not None
    worker.stdin.close()  # as the system does when the server is killed
    assert worker.wait(PATIENCE) == 0


@pytest.mark.costly
def test_a_worker_does_not_load_the_server() -> None:
    said = """
import sys
from racecraft.serve.jobs.worker import load
load()
print(sorted(name for name in sys.modules if name == "fastapi" or name.endswith(".schemas")))
"""
    done = subprocess.run([sys.executable, "-c", said], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.costly
def test_a_console_starts_without_what_few_of_its_pages_need() -> None:
    said = """
import sys
from racecraft.serve import serve
print([name for name in ("fidelity", "sweeping", "tuning") if f"racecraft.{name}" in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", said], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.costly
def test_a_worker_that_waited_has_all_that_a_training_needs(tmp_path: Path) -> None:
    run = train("oval", until="1 steps", num_envs=2, num_threads=1, root=tmp_path, name="calm").run
    said = f"""
import sys
from pathlib import Path
from racecraft.serve.jobs.worker import load
load()
before = set(sys.modules)
from racecraft.run import RunFolder
from racecraft.training import Until
from racecraft.training.job import Training
Training(RunFolder(Path({str(run)!r})), until=Until(steps=2000)).run()
print(sorted(name for name in set(sys.modules) - before if name.startswith(("racecraft", "pydantic"))))
"""
    done = subprocess.run([sys.executable, "-c", said], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"
