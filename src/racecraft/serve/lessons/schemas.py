"""What browser and server tell each other about lessons; a lesson itself is `racecraft.course.page.LessonPage`."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from racecraft.course.page import LessonFacts
from racecraft.serve.schemas import Message


class LessonProgress(Message):
    """How far somebody is in a lesson."""

    is_read: bool = False
    """To the end."""
    quiz: float | None = None
    """Best share of right answers; None before the first."""
    solved: list[str] = Field(default_factory=list[Any])
    """Exercises, as the command line keeps them for whoever starts a console of their own."""


class LessonCard(Message):
    """A lesson in the list, and how far one is."""

    facts: LessonFacts
    progress: LessonProgress


class LessonStep(Message):
    """What somebody has done in a lesson."""

    is_read: bool = False
    answers: Annotated[list[Annotated[int, Field(ge=0, lt=10)]] | None, Field(max_length=50)] = None
    """To all questions in their order, by index; None for who only read."""


class MemberLessons(Message):
    """How far somebody in a group is."""

    id: int
    name: str
    real_name: str
    lessons: dict[int, LessonProgress]
    """By number; what was not begun is not there."""
