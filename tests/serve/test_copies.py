"""Which of a race's entries are marked as somebody else's: the later of two that choose alike, in one race alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.race.likeness import FRAMES
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Choices, Group, Job, Race, Submission, User
from racecraft.serve.submissions.copies import accept, keep_choices, mark_copies, packed

ADA, BOB = 2, 3
CUP, OTHER = 1, 2


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(f"sqlite:///{tmp_path / 'console.sqlite'}")
    database.migrate()
    with database.transaction() as session:
        session.add_all([User(id=ADA, name="Ada", handle="ada"), User(id=BOB, name="Bob", handle="bob")])
        session.add(Group(id=1, title="Class"))
        session.flush()
        for number in (CUP, OTHER):
            session.add(Race(id=number, owner_id=1, group_id=1, title="Cup", track="oval", ranking="total"))
    yield database
    database.close()


def driver(seed: int) -> Any:
    """What somebody chooses on the hidden frames: mrad and mm/s  (FRAMES, 2)."""
    return np.random.default_rng(seed).integers((-500, 500), (500, 4000), (FRAMES, 2))


Judge = Callable[..., int]


@pytest.fixture
def judge(database: Database) -> Judge:
    """Hands in an entry and judges what it chooses; its number."""

    def judge(user: int, choices: Any, *, race: int = CUP) -> int:
        with database.transaction() as session:
            count = session.scalar(sa.select(sa.func.count(Submission.id))) or 0
            job = Job(id=f"j{count}", kind="judge", run="", state="done")
            session.add(job)
            session.flush()
            entry = Submission(race_id=race, user_id=user, job_id=job.id, digest=f"{count:064}", model="m")
            session.add(entry)
            session.flush()
            number, job_id = entry.id, job.id
        look(database, job_id, choices)
        return number

    return judge


def look(database: Database, job: str, choices: Any) -> None:
    with database.transaction() as session:
        keep_choices(session, job, packed(choices.tolist()))
    with database.transaction() as session:
        mark_copies(session, job)


def marks(session: Session) -> dict[int, int]:
    """Of marked entries, whose earlier one they are like."""
    rows = session.execute(sa.select(Choices.submission_id, Choices.like_id).where(Choices.like_id.is_not(None)))
    return {row.submission_id: row.like_id for row in rows}


def test_the_later_of_two_that_choose_alike_is_marked(database: Database, judge: Judge) -> None:
    first, _ = judge(ADA, driver(1)), judge(BOB, driver(2))
    nearly = driver(1) + np.random.default_rng(5).integers(-20, 20, (FRAMES, 2))
    copy = judge(BOB, nearly)
    with database.transaction() as session:
        assert marks(session) == {copy: first}
        assert session.get_one(Choices, copy).likeness > 0.9
        assert accept(session, copy)
        assert not accept(session, first)
    with database.transaction() as session:
        assert session.get_one(Choices, copy).is_accepted


def test_one_s_own_entries_and_those_of_other_races_are_no_copies(database: Database, judge: Judge) -> None:
    judge(ADA, driver(1))
    judge(ADA, driver(1))
    judge(BOB, driver(1), race=OTHER)
    with database.transaction() as session:
        assert marks(session) == {}


def test_who_is_judged_late_marks_what_was_handed_in_after_it(database: Database, judge: Judge) -> None:
    first, second = judge(ADA, driver(1)), judge(BOB, driver(2))
    look(database, "j0", driver(2))  # judged anew, with what it chooses now
    with database.transaction() as session:
        assert marks(session) == {second: first}


@pytest.mark.parametrize(
    "choices", [[], [[1, 2]], [[0.5, 1.0]] * FRAMES, [[40_000, 1]] * FRAMES, [["a", "b"]] * FRAMES]
)
def test_choices_that_are_none(choices: Any) -> None:
    with pytest.raises(ValueError, match="no choices"):
        packed(choices)
