"""A heat on one HTML page to be sent around, or as a picture: all cars on their road, the result, the replay inside.

race.replay, who came in how -> standings, the cars (share.js), the winner's racing line, the file itself
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from racecraft.analysis.report_page import page, section
from racecraft.analysis.share_page import LANGUAGES, Shown, line_of, number, proof, script, stage, words_of
from racecraft.analysis.share_picture import draw_line, finish_picture
from racecraft.errors import ReplayError
from racecraft.race.recording import Recording
from racecraft.replay.replay import MAX_CELLS, read_replay
from racecraft.track.picture import describe
from racecraft.version import VERSION


@dataclass(frozen=True, kw_only=True)
class Placed:
    """How a car came in."""

    car: int
    """Its number in the replay file."""
    name: str
    place: int | None
    """None of a car that was not ranked."""
    score: float | None
    """What it is ranked by, s."""
    best_lap: float | None
    """Seconds."""
    gap: float | None
    """Behind the winner, s."""


def share_heat(
    file: Path, rows: Sequence[Placed], *, title: str, language: str = "en", max_numbers: int = MAX_CELLS
) -> str:
    """A heat as one HTML text.

    Args:
        file: Its replay file.
        rows: The result, the winner first.
        title: What the heat is called.
        language: ``en`` or ``de``.
        max_numbers: As for `read_replay`.

    Raises:
        ReplayError: The file cannot be read, or lacks a car of the result.
    """
    words, drives = words_of(language), _drives(file, rows, max_numbers)
    road, _ = describe(drives[0].track)
    cars = [Shown(row.name, drive) for row, drive in zip(rows, drives, strict=True)]
    winner = rows[0]
    return page(
        title,
        f"{escape(road)} · {escape(words['made'])}",
        [(what, value, "") for what, value in _figures(winner, words)],
        stage(cars, words, heading=words["heat"]) + _result(rows, words),
        [
            section(f"{words['line_of']} {winner.name}", line_of(drives[0], words)),
            section(words["proof"], proof(file.read_bytes(), "heat.replay", words["proof_heat"], words)),
        ],
        versions={"racecraft": VERSION},
        script=script(),
        language=language if language in LANGUAGES else "en",
    )


def draw_heat(
    file: Path,
    rows: Sequence[Placed],
    path: Path,
    *,
    title: str,
    language: str = "en",
    max_numbers: int = MAX_CELLS,
) -> Path:
    """The winner's racing line and the result as a picture, with the replay file inside; otherwise as `share_heat`.

    Raises:
        RacecraftError: The file cannot be read, or lacks a car of the result, or the picture cannot be written.
    """
    words, drives = words_of(language), _drives(file, rows, max_numbers)
    figures = [(what.upper(), value) for what, value in _figures(rows[0], words)]
    road, _ = describe(drives[0].track)
    draw_line(drives[0], path, title=title, subtitle=road, figures=figures, words=words)
    return finish_picture(path, words["heat"], "\n".join(_lines(rows, words)), replay=file.read_bytes())


def _drives(file: Path, rows: Sequence[Placed], max_numbers: int) -> list[Recording]:
    cars = read_replay(file, max_numbers=max_numbers).cars
    if any(row.car >= len(cars) for row in rows):
        raise ReplayError(f"{file.name} does not have all cars of the heat.")
    return [cars[row.car].recording for row in rows]


def _figures(winner: Placed, words: dict[str, str]) -> list[tuple[str, str]]:
    found = [(words["winner"], winner.name)]
    if winner.score is not None:
        found.append((words["total"], f"{number(winner.score, 3, words)} s"))
    return found


def _cells(row: Placed, words: dict[str, str]) -> list[str]:
    shown = ["–" if value is None else f"{number(value, 3, words)} s" for value in (row.score, row.best_lap)]
    gap = f"+{number(row.gap, 3, words)} s" if row.gap else "–"
    return ["–" if row.place is None else str(row.place), row.name, *shown, gap]


def _result(rows: Sequence[Placed], words: dict[str, str]) -> str:
    head = "".join(f'<th scope="col">{escape(words[key])}</th>' for key in ("place", "name", "total", "best", "gap"))
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in _cells(row, words))}</tr>" for row in rows)
    return f'<div class="scroll"><table class="heat"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _lines(rows: Sequence[Placed], words: dict[str, str]) -> list[str]:
    """A line a car: place, name, time, how far behind."""
    cells = [_cells(row, words) for row in rows]
    return [" · ".join(cell for cell in (*row[:3], row[4]) if cell != "–") for row in cells]
