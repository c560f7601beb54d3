"""A lesson as a notebook: the same cells in Jupyter's file format, version 4.5."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from racecraft.course.lesson import Lesson
from racecraft.course.percent import Cell
from racecraft.course.quiz import Language
from racecraft.run.atomic import write_file


def to_notebook(cells: Iterable[Cell]) -> dict[str, Any]:
    """The notebook's document, without outputs."""
    return {
        "nbformat": 4,
        "nbformat_minor": 5,
        "metadata": {
            "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"},
            "language_info": {"name": "python"},
        },
        "cells": [_to_document(number, cell) for number, cell in enumerate(cells)],
    }


def write_notebook(lesson: Lesson, folder: Path, language: Language = "en") -> Path:
    """Make a lesson's notebook in a folder, unless it is there: it may hold what a learner wrote.

    Args:
        lesson: Whose cells it holds.
        folder: Where it is kept; made where it is missing.
        language: Of its text. One that is not English is part of the file's name, as in ``01_reward.de.ipynb``.

    Raises:
        OSError: It cannot be written.
    """
    path = folder / f"{lesson.path.stem}{'' if language == 'en' else f'.{language}'}.ipynb"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        document = json.dumps(to_notebook(lesson.cells(language)), indent=1, ensure_ascii=False)
        write_file(path, document.encode() + b"\n", durable=False)
    return path


def _to_document(number: int, cell: Cell) -> dict[str, Any]:
    lines = cell.source.splitlines(keepends=True)
    document: dict[str, Any] = {"cell_type": cell.kind, "id": f"cell-{number}", "metadata": {}, "source": lines}
    if cell.kind == "code":
        document |= {"execution_count": None, "outputs": []}
    return document
