"""A lesson as a page shows it: text, code with what came out of it, quiz. The console and the site tell it alike.

lesson's three files, shown/ -> `page_of` -> JSON -> web/src/course
"""

from __future__ import annotations

from typing import Final, Literal

from pydantic import BaseModel, ConfigDict

from racecraft.course.lesson import Lesson
from racecraft.course.phrases import said_in
from racecraft.course.quiz import Question, Words
from racecraft.course.shown import Output, Printed, read_shown
from racecraft.course.verdict import MARKS

PLAYTHING: Final = "plaything "
EXERCISE: Final = "exercise "
"""Beginnings of a cell's title."""


class PageCell(BaseModel):
    """A piece of a lesson."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: Literal["text", "code"]
    source: str
    """Markdown, or Python."""
    german: str = ""
    """The text in German, and of code what its check says; empty where there is nothing of the kind."""
    exercise: str = ""
    """Such as ``4.bellman``, where this is the cell to change."""
    plaything: str = ""
    """What to play with below the text, by its name in web/src/course/playthings."""
    outputs: list[Output] = []
    """What the code printed and drew when it ran last."""


class LessonFacts(BaseModel):
    """What a list says of a lesson."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    number: int
    name: str
    """Of its files, such as ``04_q_table``."""
    title: Words
    goal: Words
    seconds: float
    """That it runs from top to bottom."""
    exercises: list[str]
    questions: int


class LessonPage(LessonFacts):
    """A lesson, whole."""

    cells: list[PageCell]
    quiz: list[Question]


def facts_of(lesson: Lesson) -> LessonFacts:
    """What a list says of it.

    Raises:
        ConfigError: One of its files is damaged.
    """
    facts = lesson.facts
    return LessonFacts(
        number=lesson.number,
        name=lesson.path.stem,
        title=facts.title,
        goal=facts.goal,
        seconds=facts.seconds,
        exercises=[exercise for cell in lesson.cells() if (exercise := _exercise(lesson, cell.title))],
        questions=len(facts.questions),
    )


def page_of(lesson: Lesson) -> LessonPage:
    """All of it.

    Raises:
        ConfigError: One of its files is damaged.
    """
    outputs, cells = read_shown(lesson).outputs, list[PageCell]()
    num_code = 0
    for cell, german in zip(lesson.cells(), lesson.cells("de"), strict=True):
        is_code = cell.kind == "code"
        printed = outputs.get(num_code, []) if is_code else []
        cells.append(
            PageCell(
                kind="code" if is_code else "text",
                source=cell.source,
                german=_verdict(printed) if is_code else german.source if german != cell else "",
                exercise=_exercise(lesson, cell.title),
                plaything=cell.title.removeprefix(PLAYTHING) if cell.title.startswith(PLAYTHING) else "",
                outputs=printed,
            )
        )
        num_code += is_code
    return LessonPage(**vars(facts_of(lesson)), cells=cells, quiz=list(lesson.facts.questions))


def _verdict(outputs: list[Output]) -> str:
    """What a check says of the exercise as it stands, in German, where it is all that was printed."""
    text = outputs[0].text if len(outputs) == 1 and isinstance(outputs[0], Printed) else ""
    mark = next((mark for mark in MARKS.values() if text.startswith(mark)), "")
    return f"{said_in('de', mark)} {said_in('de', text.removeprefix(mark).strip())}" if mark else ""


def _exercise(lesson: Lesson, title: str) -> str:
    return f"{lesson.number}.{title.removeprefix(EXERCISE)}" if title.startswith(EXERCISE) else ""
