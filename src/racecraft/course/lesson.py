"""The lessons: where their files are, and what is known of each without running it.

A lesson is three files in ``lessons/``: ``04_q_table.py`` holds its text and code, ``04_q_table.toml`` its title, goal,
run time and quiz, ``answers/04_q_table.py`` the right answers to its exercises, and wrong ones. ``de/04_q_table.md``
holds its text in German.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, ValidationError

from racecraft.checks import check_whole
from racecraft.course.percent import Cell, read_cells
from racecraft.course.quiz import Language, Question, Words
from racecraft.course.translation import read_translation, text_digest, translation_path
from racecraft.errors import ConfigError

HERE: Final = Path(__file__).resolve()


class Facts(BaseModel):
    """What a lesson's TOML file says."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: Words
    goal: Words
    """What a learner can do or explain afterwards, in one sentence."""
    seconds: float
    """That it takes from top to bottom on one core of two, about."""
    questions: tuple[Question, ...]


@dataclass(frozen=True)
class Lesson:
    """One lesson."""

    number: int
    path: Path
    """Its text and code."""

    @cached_property
    def facts(self) -> Facts:
        """Title, goal, run time and quiz.

        Raises:
            ConfigError: Its file is damaged.
        """
        path = self.path.with_suffix(".toml")
        try:
            return Facts.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, ValidationError) as error:
            raise ConfigError(f"{path} does not describe a lesson: {' '.join(str(error).split())}") from error

    @property
    def answers(self) -> Path:
        """Its right and wrong answers."""
        return self.path.parent / "answers" / self.path.name

    def cells(self, language: Language = "en") -> list[Cell]:
        """Its text and code, piece by piece; text that nobody has translated is in English, code always the same."""
        cells = read_cells(self.path.read_text(encoding="utf-8"))
        if language == "en":
            return cells
        texts = read_translation(translation_path(self.path, language))
        return [
            replace(cell, source=texts.get(text_digest(cell.source), cell.source)) if cell.kind == "markdown" else cell
            for cell in cells
        ]


def lessons_folder() -> Path:
    """Where the lessons lie: in the installed package, or in the checkout that it runs from.

    Raises:
        ConfigError: Neither has them.
    """
    for folder in (HERE.parents[1] / "lessons", HERE.parents[3] / "lessons"):
        if folder.is_dir():
            return folder
    raise ConfigError("The lessons are not installed.", hint="Install Racecraft again, or use a checkout of it.")


def lessons() -> list[Lesson]:
    """All lessons in their order."""
    return [Lesson(int(path.name[:2]), path) for path in sorted(lessons_folder().glob("[0-9][0-9]_*.py"))]


def find_lesson(number: int) -> Lesson:
    """One lesson by its number.

    Raises:
        ConfigError: There is none of this number.
    """
    known = {lesson.number: lesson for lesson in lessons()}
    check_whole("number", number, 0, 99)
    if number not in known:
        raise ConfigError(f"There is no lesson {number}; there are {', '.join(map(str, known))}.")
    return known[number]
