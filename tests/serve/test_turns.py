"""Places go round between people: who is asked for theirs, who gets it, and that nothing is lost by it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from leagues import ok, running_league
from running_consoles import LEISURELY

from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.turns import FIRST_TURN, PATIENCE, SLOW, SPARE, TURN, waiting_line
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, User

TRAIN = ("train", "tune")
OTHER = ("evaluate", "ladder")
ADA, BOB, CYD = 1, 2, 3
SECOND = timedelta(seconds=1)


class Machine:
    """A queue, and a machine with one place whose clock is put forward."""

    def __init__(self, database: Database) -> None:
        self.database = database
        with database.transaction() as session:
            session.add_all([User(id=BOB, name="Bob", handle="bob"), User(id=CYD, name="Cyd", handle="cyd")])

    def add(self, user: int, kind: str = "train") -> str:
        return JobQueue(self.database, user_id=user).add(kind, "run", {}).id

    def tend(self, kinds: tuple[str, ...] = TRAIN) -> list[str]:
        """What a supervisor does; the jobs that it started."""
        queue, started = JobQueue(self.database), []
        while queue.has_room(kinds, machine="m", places=1):
            job = queue.claim(kinds, owner=f"worker-{self.new()}", machine="m")
            if job is None:
                break
            started.append(job.id)
        queue.make_room(kinds, machine="m", places=1)
        return started

    def new(self) -> int:
        self.count = getattr(self, "count", 0) + 1
        return self.count

    def later(self, by: timedelta) -> None:
        """As if everything had happened so much earlier."""
        names = ("created", "started", "held_since", "rested", "asked")
        with self.database.transaction() as session:
            for job in session.scalars(sa.select(Job)):
                for name in names:
                    if (moment := getattr(job, name)) is not None:
                        setattr(job, name, moment - by)

    def told(self, job_id: str) -> str:
        return JobQueue(self.database).heartbeat(job_id, owner=self.row(job_id).owner).word

    def rest(self, job_id: str) -> None:
        JobQueue(self.database).hand_back(self.row(job_id).owner)

    def row(self, job_id: str) -> Any:
        with self.database.transaction() as session:
            return session.get_one(Job, job_id)


@pytest.fixture
def machine(database_url: str) -> Iterator[Machine]:
    database = Database(database_url)
    database.migrate()
    yield Machine(database)
    database.close()


def test_a_training_gives_its_place_to_who_has_none_and_goes_on_after_them(machine: Machine) -> None:
    hundred, began = [machine.add(ADA) for _ in range(100)], time.monotonic()
    assert machine.tend() == hundred[:1]
    bobs = machine.add(BOB)
    assert machine.tend() == []
    assert machine.told(hundred[0]) == "go on", "it has only just begun"
    machine.later(FIRST_TURN)
    machine.tend()
    assert machine.told(hundred[0]) == "rest"
    assert machine.tend() == [], "it is being saved"
    machine.rest(hundred[0])
    assert machine.tend() == [bobs]
    assert machine.told(bobs) == "go on"
    machine.later(TURN - SECOND)
    machine.tend()
    assert machine.told(bobs) == "go on", "coming back costs a start, so who was served before waits longer"
    machine.later(SECOND)
    machine.tend()
    assert machine.told(bobs) == "rest"
    machine.rest(bobs)
    assert machine.tend() == [hundred[0]], "what had begun goes on before the next of the hundred"
    used, took = machine.row(hundred[0]).used, time.monotonic() - began
    assert -0.01 < used - FIRST_TURN.total_seconds() < took


def test_who_is_alone_is_never_asked(machine: Machine) -> None:
    first, _ = machine.add(ADA), machine.add(ADA)
    assert machine.tend() == [first]
    machine.later(timedelta(hours=1))
    assert machine.tend() == []
    assert machine.told(first) == "go on"


def test_the_line_stands_as_places_will_be_given(machine: Machine) -> None:
    first, second, bobs = machine.add(ADA), machine.add(ADA), machine.add(BOB)
    assert machine.tend() == [first]
    with machine.database.transaction() as session:
        line = [job.id for job in waiting_line(session, TRAIN, machine.database.moment(session))]
    assert line == [first, bobs, second]


def test_who_does_not_let_go_delays_nobody(machine: Machine) -> None:
    stuck, bobs = machine.add(ADA), machine.add(BOB)
    assert machine.tend() == [stuck]
    machine.later(FIRST_TURN)
    machine.tend()
    assert machine.told(stuck) == "rest"
    machine.later(SLOW)
    assert machine.tend() == [bobs], "beside it"
    assert machine.row(stuck).state == "running"


def test_what_cannot_be_saved_goes_on_beside_others_up_to_a_limit(machine: Machine) -> None:
    ladder, second = machine.add(ADA, "ladder"), machine.add(ADA, "evaluate")
    assert machine.tend(OTHER) == [ladder]
    machine.later(FIRST_TURN)
    with machine.database.transaction() as session:
        session.add_all([User(id=number, name=f"u{number}", handle=f"u{number}") for number in range(10, 20)])
    others = [machine.add(number, "evaluate") for number in range(10, 20)]
    started = []
    for _ in range(12):
        machine.tend(OTHER)
        started += machine.tend(OTHER)
        machine.later(FIRST_TURN)
    assert started == others[:SPARE]
    assert machine.told(ladder) == "go on"
    assert machine.row(second).state == "queued", "whose owner has a place already"


def test_what_has_rested_long_is_not_passed_over_for_ever(machine: Machine) -> None:
    patient = machine.add(ADA)
    machine.tend()
    machine.later(FIRST_TURN)
    machine.add(BOB)
    machine.tend()
    machine.rest(patient)
    (bobs,) = machine.tend()
    newer = machine.add(CYD)
    machine.later(FIRST_TURN)
    machine.tend()
    machine.rest(bobs)
    assert machine.tend() == [newer], "what never ran comes first"
    machine.later(PATIENCE)
    machine.rest(newer)
    assert machine.tend() == [patient]


def test_what_is_lost_with_its_process_keeps_its_turn(machine: Machine) -> None:
    lost = machine.add(ADA)
    machine.tend()
    machine.add(BOB)
    JobQueue(machine.database).release(machine.row(lost).owner)
    assert machine.tend() == [lost]


@pytest.mark.slow
def test_a_first_training_starts_soon_beside_another_s_and_both_end(tmp_path: Path) -> None:
    with running_league(tmp_path / "runs") as league:
        ada, bob = (league.join(league.code(league.group("5b")), name) for name in ("Ada", "Bob"))
        for number in range(5):
            ok(
                ada.post("/api/models", json={"name": f"long-{number}", "until": "30 minutes", "reward": LEISURELY}),
                201,
            )
        league.console.wait_for(lambda: ok(ada.get("/api/models/long-0/history"))["points"])
        time.sleep(FIRST_TURN.total_seconds())
        ok(bob.post("/api/models", json={"name": "short", "until": "3000 steps"}), 201)

        def ended() -> Any:
            job = ok(bob.get("/api/jobs"))[0]
            return job if job["state"] == "done" else None

        job = league.console.wait_for(ended)
        waited = _moment(job["started"]) - _moment(job["created"])
        assert waited < 20.0  # s, of a turn of thirty; the machine may be busy

        def goes_on() -> Any:
            first = ok(ada.get("/api/jobs"))[-1]
            return first if first["state"] == "running" and first["attempts"] == 2 else None

        assert league.console.wait_for(goes_on)["run"] == "long-0"
        assert [job["attempts"] for job in ok(ada.get("/api/jobs"))] == [0, 0, 0, 0, 2]


def _moment(text: str) -> float:
    from datetime import datetime

    return datetime.fromisoformat(text).timestamp()
