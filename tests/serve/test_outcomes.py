"""What comes of a job: what could not be read again is not kept, on either database, and breaks no page."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from leagues import untrained_run

from racecraft.errors import RunError
from racecraft.serve.jobs.outcome import MAX_DEPTH
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.worker import Worker
from racecraft.serve.models.garage import Garage
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    yield database
    database.close()


@pytest.fixture
def queue(database: Database) -> JobQueue:
    return JobQueue(database)


def deep(levels: int) -> list[Any]:
    return [deep(levels - 1)] if levels > 1 else []


def claimed(queue: JobQueue) -> Job:
    queue.add("train", "a", {})
    job = queue.claim(("train",), owner="one")
    assert job is not None
    return job


def after(queue: JobQueue, job: Job) -> Job:
    found = queue.get(job.id)
    assert found is not None
    return found


@pytest.mark.parametrize(
    "told",
    [
        *(math.nan, [math.inf], {"deep": -math.inf}, 10**400, "zero \0", {"zero \0": 1}),
        *("half \ud800", {"half \udfff": 1}, deep(MAX_DEPTH), Path("no JSON"), {1: "no text"}),
    ],
    ids=ascii,
)
def test_what_could_not_be_read_again_is_not_kept(queue: JobQueue, told: object) -> None:
    job = claimed(queue)
    for name in ("result", "error"):
        outcome: dict[str, Any] = {name: {"x": told}}
        with pytest.raises(RunError, match="cannot be kept"):
            queue.finish(job.id, owner="one", state="done", **outcome)
    assert after(queue, job).state == "running"


def test_all_else_of_json_is_kept_as_it_is(queue: JobQueue) -> None:
    job = claimed(queue)
    result = {"x": deep(MAX_DEPTH - 1), "ä": ["\U0001f600", 1.5, 10**300, True, None, {"": {}}]}
    assert queue.finish(job.id, owner="one", state="done", result=result)
    assert after(queue, job).result == result


def test_a_job_at_home_that_leaves_no_json_fails_with_a_sentence(
    queue: JobQueue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where PostgreSQL refused it, its process tried again for ever, as if the database were away."""
    for result in ({"best": math.nan}, OSError("no file a\0\ud800b")):

        def work(_: object, result: Any = result) -> dict[str, Any]:
            if isinstance(result, Exception):
                raise result
            return dict(result)

        monkeypatch.setattr("racecraft.serve.jobs.worker.work", work)
        job = claimed(queue)
        Worker(queue, job, owner="one", runs=tmp_path)._do()
        ended = after(queue, job)
        assert ended.state == "failed"
        assert ended.error is not None
        assert "cannot be kept" in ended.error["message"] or ended.error["message"] == "no file a��b"


def test_a_result_of_nan_from_before_hides_no_model(database: Database, tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    untrained_run(runs, "a")
    nan = math.nan if database.url.startswith("sqlite") else None  # the other never took it
    with database.transaction() as session:
        session.add(Job(id="1", kind="train", run="a", state="done", result={"reason": "interrupted", "loss": nan}))
    assert [card.status for card in Garage(runs, runs / STATE_FOLDER, database).cards()] == ["stopped"]
