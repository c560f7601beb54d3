"""Which lessons somebody has read, and how well they answered the questions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sqlalchemy as sa
from sqlalchemy.dialects import sqlite
from sqlalchemy.orm import Session

from racecraft.course.lesson import Lesson
from racecraft.course.progress import read_progress
from racecraft.serve.lessons.schemas import LessonProgress
from racecraft.serve.problems import Conflict
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import StudiedLesson, now


def progress_of(database: Database, people: Iterable[int]) -> dict[int, dict[int, LessonProgress]]:
    """How far people are, by person and lesson; what was not begun is not there."""
    wanted = list(people)
    found: dict[int, dict[int, LessonProgress]] = {user_id: {} for user_id in wanted}
    with database.transaction() as session:
        for row in session.scalars(sa.select(StudiedLesson).where(StudiedLesson.user_id.in_(wanted))):
            found[row.user_id][row.lesson] = LessonProgress(is_read=row.read is not None, quiz=row.quiz)
    return found


def record(
    database: Database, user_id: int, lesson: Lesson, *, is_read: bool, answers: Sequence[int] | None
) -> LessonProgress:
    """Keep what somebody has done; what they had done before stays, of quizzes the best.

    Raises:
        Conflict: There are not as many answers as questions.
    """
    share = None if answers is None else _share(lesson, answers)
    with database.transaction() as session:
        # whoever answers the last question at the foot of a page has read it at the same moment
        session.execute(_begun(session, user_id, lesson.number))
        row = session.get_one(StudiedLesson, (user_id, lesson.number), with_for_update=True)
        if is_read and row.read is None:
            row.read = now()
        if share is not None:
            row.quiz = max(share, row.quiz or 0.0)
        return LessonProgress(is_read=row.read is not None, quiz=row.quiz)


def with_solved(progress: LessonProgress, number: int) -> LessonProgress:
    """With what the command line has kept on this machine, which is one person's.

    Raises:
        ConfigError: That file is damaged.
    """
    kept = read_progress()
    shares = [share for share in (progress.quiz, kept.quizzes.get(number)) if share is not None]
    solved = sorted(name for name in kept.exercises if name.startswith(f"{number}."))
    return LessonProgress(is_read=progress.is_read, quiz=max(shares, default=None), solved=solved)


def _begun(session: Session, user_id: int, lesson: int) -> sa.Insert:
    """A row for a lesson, unless another request makes it meanwhile."""
    row = {"user_id": user_id, "lesson": lesson}
    if session.get_bind().dialect.name == "postgresql":
        from sqlalchemy.dialects import postgresql  # takes its time to load, and most consoles do without

        return postgresql.insert(StudiedLesson).values(**row).on_conflict_do_nothing()
    return sqlite.insert(StudiedLesson).values(**row).on_conflict_do_nothing()


def _share(lesson: Lesson, answers: Sequence[int]) -> float:
    questions = lesson.facts.questions
    if len(answers) != len(questions):
        raise Conflict(f"There are {len(answers)} answers, and {len(questions)} questions.")
    return sum(answer == one.answer for answer, one in zip(answers, questions, strict=True)) / len(questions)
