"""What a worker takes by its token: one job at a time, on a machine of its own, until it lets go or loses it."""

from __future__ import annotations

from typing import Any

import pytest

from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.problems import Conflict
from racecraft.serve.settings import MAX_MACHINE
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.serve.workers.leases import Lease, Leases
from racecraft.version import VERSION

TOKEN = 7


@pytest.fixture
def queue(database: Database) -> JobQueue:
    return JobQueue(database)


@pytest.fixture
def leases(database: Database, queue: JobQueue) -> Leases:
    return Leases(database, queue)


def add(queue: JobQueue, kind: str = "train", *, run: str = "run") -> str:
    return queue.add(kind, run, {}, cargo=Cargo()).id


def take(lease: Lease, machine: str = "lab", kinds: tuple[str, ...] = ("train",), **more: Any) -> Job | None:
    return lease.take("training", list(kinds), machine=machine, places=1, **{"of_version": VERSION, **more})


def test_a_worker_has_one_job_and_machines_of_one_token_have_names(queue: JobQueue, leases: Leases) -> None:
    first, second, third = (add(queue, run=run) for run in ("a", "b", "c"))
    names = "lab", "x" * (MAX_MACHINE + 9), "y" * MAX_MACHINE
    taken = [take(leases.of(TOKEN, f"{number:016x}"), name) for number, name in enumerate(names)]
    assert [job and job.id for job in taken] == [first, second, third]
    machines = [job and job.machine for job in taken]
    assert machines == ["lab#7", "x" * (MAX_MACHINE - 2) + "#7", "y" * (MAX_MACHINE - 2) + "#7"]
    again = take(leases.of(TOKEN, f"{0:016x}"))
    assert again is not None, "who did not hear the answer is told it again"
    assert again.id == first
    add(queue, run="d")
    assert take(leases.of(TOKEN, "a" * 16)) is None, "the one place of that machine is taken"
    assert take(leases.of(TOKEN + 1, "a" * 16)) is not None, "a machine of another token is another one"


def test_what_it_cannot_do_stays(queue: JobQueue, leases: Leases) -> None:
    queue.add("train", "run", {})  # which does not travel
    add(queue, "evaluate")  # for places of another kind
    lease = leases.of(TOKEN, "a" * 16)
    assert take(lease, kinds=("train", "evaluate", "nonsense")) is None
    with pytest.raises(Conflict, match="does not have this job"):
        lease.required()
    with pytest.raises(Conflict, match=r"this worker is 0\.0\.1"):
        take(lease, of_version="0.0.1")


def test_what_it_lets_go_of_is_taken_by_another(queue: JobQueue, leases: Leases) -> None:
    job = add(queue)
    losses = 0
    for why in ("asked", "died", "all died"):
        one = leases.of(TOKEN, "a" * 16)
        assert take(one) is not None
        assert one.required().id == job
        with one.holding(queue.get(job)):
            pass
        one.release(why)  # type: ignore[arg-type]
        losses += why != "asked"
        assert one.held() is None
        assert (queue.get(job).state, queue.get(job).losses) == ("queued", losses)
        with pytest.raises(Conflict), one.holding(queue.get(job)):
            pass
        with pytest.raises(Conflict):
            one.finish(job, "done", result={}, error=None)


def test_what_a_worthless_token_has_goes_to_others(queue: JobQueue, leases: Leases) -> None:
    class Good:
        def worker_tokens(self) -> set[int]:
            return {TOKEN + 1}

    keys: Any = Good()
    leases.end_without_token(keys)
    add(queue, run="a")
    add(queue, run="b")
    worthless, good = leases.of(TOKEN, "a" * 16), leases.of(TOKEN + 1, "a" * 16)
    assert take(worthless) is not None
    assert take(good) is not None
    home = queue.add("evaluate", "run", {}).id
    assert queue.claim(("evaluate",), owner="f" * 16, machine="here") is not None
    leases.end_without_token(keys)
    assert worthless.held() is None
    assert good.held() is not None
    assert queue.get(home).state == "running"
