"""Lessons as plain Python files in jupytext's percent format: what stands between two lines of ``# %%`` is a cell.

    # %% [markdown]
    # Text of the lesson.

    # %%
    print("code")

A word after ``# %%`` is the cell's title.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

_MARK: Final = re.compile(r"^# %%(?P<title>[^\[\n]*)(?P<text>\[(?:markdown|md)\])?\s*$")


@dataclass(frozen=True)
class Cell:
    """A piece of a lesson."""

    kind: str
    """``code`` or ``markdown``."""
    title: str
    """What its first line says, such as ``exercise inside``; mostly nothing."""
    source: str
    """Code, or text without the leading ``# ``."""
    line: int
    """Of the file, from 1, where the source begins."""


def read_cells(text: str) -> list[Cell]:
    """Cells of a file in their order; a cell of nothing is left out.

    Args:
        text: Of the file. What comes before the first ``# %%`` is code.
    """
    cells: list[Cell] = []
    kind, title, lines, first = "code", "", list[str](), 1
    for number, line in enumerate([*text.splitlines(), "# %%"], 1):
        mark = _MARK.match(line)
        if mark is None:
            lines.append(line)
            continue
        source = "\n".join(map(_uncommented, lines) if kind == "markdown" else lines)
        if source.strip():
            skipped = len(source) - len(source.lstrip("\n"))
            cells.append(Cell(kind, title, source.strip("\n"), first + skipped))
        kind, title = "markdown" if mark["text"] else "code", mark["title"].strip()
        lines, first = [], number + 1
    return cells


def _uncommented(line: str) -> str:
    return line.removeprefix("#").removeprefix(" ")
