"""The course in the console: lessons as they are, progress of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest

from racecraft.course import checks_of, find_lesson, lessons, read_progress
from racecraft.course import progress as progress_file
from racecraft.course.page import page_of
from racecraft.course.shown import read_shown
from racecraft.errors import ConfigError
from racecraft.serve.lessons.studies import progress_of, record, with_solved
from racecraft.serve.problems import Conflict
from racecraft.serve.store.database import Database


@pytest.fixture
def database(tmp_path: Path) -> Database:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    return database


def test_what_somebody_did_stays_and_of_quizzes_the_best(database: Database) -> None:
    lesson = find_lesson(4)
    right = [question.answer for question in lesson.facts.questions]
    assert record(database, 1, lesson, is_read=False, answers=right).quiz == 1
    assert not record(database, 1, lesson, is_read=False, answers=None).is_read
    wrong = [(answer + 1) % 3 for answer in right]
    assert record(database, 1, lesson, is_read=True, answers=[*wrong[:-1], right[-1]]).quiz == 1
    after = record(database, 1, lesson, is_read=False, answers=None)
    assert (after.is_read, after.quiz) == (True, 1)
    assert record(database, 1, find_lesson(3), is_read=False, answers=[9] * 4).quiz == 0
    with pytest.raises(Conflict, match="There are 1 answers, and 4 questions"):
        record(database, 1, lesson, is_read=True, answers=[0])
    assert set(progress_of(database, [1])[1]) == {3, 4}
    assert progress_of(database, [2]) == {2: {}}


def test_the_command_line_counts_for_who_is_alone(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    progress_file.record_exercise("4.bellman")
    progress_file.record_exercise("1.inside")
    progress_file.record_quiz(4, 0.75)
    mine = record(database, 1, find_lesson(4), is_read=True, answers=[9] * 4)
    told = with_solved(mine, 4)
    assert (told.is_read, told.quiz, told.solved) == (True, 0.75, ["4.bellman"])
    progress_file.progress_path().write_text("{")
    with pytest.raises(ConfigError, match="no progress"):
        read_progress()


def test_a_page_holds_what_the_lesson_printed_and_drew() -> None:
    for lesson in lessons():
        page = page_of(lesson)
        assert [cell.source for cell in page.cells] == [cell.source for cell in lesson.cells()]
        assert page.exercises == [cell.exercise for cell in page.cells if cell.exercise]
        assert page.exercises == [f"{lesson.number}.{name}" for name in checks_of(lesson.number)]
        code = [cell for cell in page.cells if cell.kind == "code"]
        assert {number: cell.outputs for number, cell in enumerate(code) if cell.outputs} == read_shown(lesson).outputs
        named = [cell.title.removeprefix("plaything ") for cell in lesson.cells() if cell.title.startswith("plaything")]
        assert [cell.plaything for cell in page.cells if cell.plaything] == named
        pictures = [one for cell in page.cells for one in cell.outputs if one.kind == "picture"]
        assert len(pictures) >= 2, lesson.path.stem
