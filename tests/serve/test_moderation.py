"""Names that others see and that will not do: who organises gives others, and those stay."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from courts import ADA, RACE, Court, HereBench
from leagues import untrained_run

from racecraft.race.entry_file import pack_entry
from racecraft.replay.replay import read_replay
from racecraft.serve.people.people import People, add_person
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.tables import Member, Submission
from racecraft.serve.submissions import tasks

TEACHER = 1


@pytest.fixture
def court(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Court]:
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    court = Court(tmp_path)
    with court.database.transaction() as session:
        session.add(Member(group_id=1, user_id=TEACHER, role="organiser"))
    yield court
    court.database.close()


def test_who_was_given_a_name_does_not_take_the_old_one_again(court: Court) -> None:
    people = People(court.database)
    people.rename(ADA, "Rude")
    people.rename(ADA, "Countess", by_organiser=True)
    with pytest.raises(Conflict, match="gave you this name"):
        people.rename(ADA, "Rude")
    assert people.get(ADA).name == "Countess"
    people.rename(ADA, "Ada", by_organiser=True)
    assert people.get(ADA).name == "Ada"


@pytest.mark.costly
def test_an_entry_that_was_given_a_name_keeps_it_on_the_board_and_in_its_replay(court: Court, tmp_path: Path) -> None:
    def names() -> tuple[str, list[str]]:
        _, board, _ = court.league.board(RACE, user_id=ADA, top=10)
        path = tasks.submission_folder(court.root / STATE_FOLDER, task.job.id) / tasks.REPLAY
        return board.rows[0].model, list(read_replay(path).names)

    entry = pack_entry(untrained_run(tmp_path / "runs", "novice"))
    task = court.enter(entry)
    number = court.entries.submit(RACE, entry, model="novice", user_id=ADA)
    rename: dict[str, Any] = {"race_id": RACE, "submission_id": number, "model": "polite"}
    with pytest.raises(Conflict, match="not judged yet"):
        court.entries.rename_model(**rename, user_id=TEACHER)
    court.end(task, "done", result=tasks.judge(task))
    assert names() == ("novice", ["novice, trial 1", "novice, trial 2"])
    with pytest.raises(NotFound):
        court.entries.rename_model(**rename, user_id=ADA)
    with pytest.raises(NotFound):
        court.entries.rename_model(**{**rename, "submission_id": number + 1}, user_id=TEACHER)
    court.entries.rename_model(**rename, user_id=TEACHER)
    assert names() == ("polite", ["polite, trial 1", "polite, trial 2"])

    assert court.entries.submit(RACE, entry, model="rude", user_id=ADA) == number
    court.entries.judge_again(RACE, number, user_id=TEACHER)
    task = court.claim()
    court.end(task, "done", result=tasks.judge(task))
    assert names() == ("polite", ["polite, trial 1", "polite, trial 2"])

    court.entries.judge_again(RACE, number, user_id=TEACHER)
    court.end(court.claim(), "cancelled")
    court.entries.submit(RACE, entry, model="rude", user_id=ADA)  # whose job has ended, so it is a new one
    task = court.claim()
    court.end(task, "done", result=tasks.judge(task))
    assert names() == ("polite", ["polite, trial 1", "polite, trial 2"])


@pytest.mark.parametrize("name", ["you", "You", "Ｙou!"])
def test_nobody_is_called_as_pages_know_who_has_no_name_yet(court: Court, name: str) -> None:
    people = People(court.database)
    people.rename(TEACHER, "Ms Frizzle")
    with pytest.raises(Conflict, match="looks like one that is"):
        people.rename(ADA, name)
    with pytest.raises(Conflict, match="looks like one that is"), court.database.transaction() as session:
        add_person(session, name)


def test_nobody_lets_in_again_what_left_with_its_owner(court: Court, tmp_path: Path) -> None:
    number = court.entries.submit(RACE, pack_entry(untrained_run(tmp_path / "runs", "novice")), model="x", user_id=ADA)
    out: dict[str, Any] = {"race_id": RACE, "submission_id": number, "user_id": TEACHER}
    court.entries.disqualify(reason="Too early.", **out)
    court.entries.disqualify(reason="", **out)
    People(court.database).remove(ADA)
    for reason in ("", "Too late."):
        with pytest.raises(Conflict, match="deleted their account"):
            court.entries.disqualify(reason=reason, **out)
    with court.database.transaction() as session:
        assert session.get_one(Submission, number).disqualified == "Withdrawn by its owner."
