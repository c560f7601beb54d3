"""How a worker at the database hears of a new job: long before it would have looked at the whole queue again."""

from __future__ import annotations

import threading
import time

import pytest

from racecraft.serve.jobs import queue as queues
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.store.database import Database

SOON = 30.0  # s; without a word it would be a minute


def heard(queue: JobQueue) -> threading.Thread:
    listening = threading.Thread(target=queue.listen, daemon=True)
    listening.start()
    return listening


@pytest.mark.costly
def test_who_listens_hears_of_each_new_job_for_workers_once(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(queues, "PATIENCE", 2 * SOON)
    queue = JobQueue(database)
    queue.add("train", "before", {}, cargo=Cargo())
    queue.listen()  # one that waits already

    listening = heard(queue)
    queue.add("train", "at-home", {})  # which does not travel
    listening.join(1.0)
    assert listening.is_alive(), "neither the old one nor one for another machine is news"
    queue.add("train", "away", {}, cargo=Cargo())
    listening.join(SOON)
    assert not listening.is_alive()

    assert queue.claim(("train",), owner="a") is not None
    for job in queue.list():
        queue.cancel(job.id)
    listening = heard(queue)
    time.sleep(3 * queues.GLANCE)
    assert listening.is_alive(), "nothing waits"
    queue.add("train", "again", {}, cargo=Cargo())
    listening.join(SOON)
    assert not listening.is_alive()


def test_nobody_listens_for_ever(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queues, "PATIENCE", 0.2)
    began = time.monotonic()
    JobQueue(database).listen()
    assert time.monotonic() - began < SOON
