"""An object store that takes a question and never answers: who looks at the console does not hang with it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from racecraft.serve.jobs import follower as followers
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.follower import AT_ONCE, Follower
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store import objects
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.objects import NoAnswer, ObjectStore
from racecraft.serve.store.tables import Job

SOON = 10.0  # s; the store says nothing for much longer


class Silent:
    """A store that lets everybody wait until a test lets it speak."""

    url = "s3://racing/silent"

    def __init__(self) -> None:
        self.speaks = threading.Event()
        self.asked: list[str] = []

    def get(self, key: str) -> Any:
        self.asked.append(key)
        self.speaks.wait()
        raise NoAnswer("it is out of order")


@pytest.fixture
def silent() -> Iterator[Silent]:
    store = Silent()
    with ExitStack() as stack:
        stack.callback(store.speaks.set)
        yield store


def ended(queue: JobQueue, name: str, settings: ServeSettings) -> Job:
    (folder := settings.runs / name).mkdir(parents=True)
    (folder / "run.json").write_text("{}")
    queue.add("train", name, {}, cargo=Cargo())
    job = queue.claim(("train",), owner=name, machine="elsewhere")
    assert job is not None
    assert queue.finish(job.id, owner=name, state="done", result={})
    job.state = "done"
    return job


def returns(action: Callable[[], object]) -> bool:
    """Whether something comes back soon."""
    thread = threading.Thread(target=action, daemon=True)
    thread.start()
    thread.join(SOON)
    return not thread.is_alive()


@pytest.fixture
def follower(silent: Silent, database: Database, tmp_path: Path) -> Follower:
    store: Any = silent
    settings = ServeSettings(runs=tmp_path / "runs", machine="home")
    return Follower(Artifacts(store), settings=settings, queue=JobQueue(database))


def test_a_store_that_hangs_keeps_nobody_who_looks_at_jobs(
    silent: Silent, follower: Follower, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(followers, "SEEN", 0.2)
    settings, queue = ServeSettings(runs=tmp_path / "runs"), JobQueue(database)
    jobs = [ended(queue, f"run-{number}", settings) for number in range(AT_ONCE + 2)]
    assert returns(lambda: [follower.see(job) for job in jobs + jobs])
    assert len(silent.asked) <= AT_ONCE, "few wait for it, however many ask"
    asked = len(silent.asked)
    silent.speaks.set()
    for thread in threading.enumerate():
        if thread.name == "bring":
            thread.join(SOON)
    follower.see(jobs[0])
    assert len(silent.asked) > asked, "it is asked again once it answers"


def test_who_waits_for_the_same_job_hears_of_it_when_it_is_here(
    silent: Silent, follower: Follower, database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(followers, "SEEN", 10 * SOON)
    brought: list[str] = []

    def bring(_: object, job: Job) -> None:
        silent.speaks.wait()
        brought.append(job.id)

    monkeypatch.setattr(follower, "_bring", bring)
    job = ended(JobQueue(database), "run", ServeSettings(runs=tmp_path / "runs"))
    heard = [threading.Thread(target=follower.see, args=(job,), daemon=True) for _ in range(5)]
    for thread in heard:
        thread.start()
    heard[0].join(0.2)
    assert all(thread.is_alive() for thread in heard), "it is not told before it is here"
    silent.speaks.set()
    for thread in heard:
        thread.join(SOON)
    assert not any(thread.is_alive() for thread in heard)
    assert brought == [job.id]
    follower.see(job)
    assert brought == [job.id], "and is not brought again"


def test_a_store_that_hangs_keeps_few_threads(silent: Silent, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server has some forty; who starts a training would take one for minutes."""
    pytest.importorskip("obstore")
    monkeypatch.setattr(objects, "WAIT", 0.1)
    store = ObjectStore(f"file://{tmp_path}/store")
    store.put("a", b"some bytes")
    reply = store.get("a")
    with monkeypatch.context() as hanging:
        hanging.setattr(store, "_api", SimpleNamespace(put=lambda *_: silent.speaks.wait()))
        waiting = [threading.Thread(target=store.put, args=("b", b""), daemon=True) for _ in range(objects.AT_ONCE)]
        for thread in waiting:
            thread.start()
        for _ in range(3):
            with pytest.raises(NoAnswer, match="too many wait for it"):
                store.delete(["a"])
        with pytest.raises(NoAnswer, match="too many wait for it"):
            reply.read()
        silent.speaks.set()
        for thread in waiting:
            thread.join(SOON)
    assert store.get("a").read() == b"some bytes"
