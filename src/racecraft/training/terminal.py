"""The live view of a training in a terminal: a curve of the whole run, the numbers that matter, the evaluations."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Final, Self

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from racecraft.training.progress import EvaluationReport, IterationReport, Lesson

if TYPE_CHECKING:
    from racecraft.race.policy import NetworkPolicy
    from racecraft.sim import Simulation

MAX_WIDTH: Final = 100  # characters; wider than this is hard to read
NARROW: Final = 72  # characters; below it there is no room for the curve
NUMBERS_WIDTH: Final = 30  # characters
CURVE_ROWS: Final = 7
EVALUATIONS: Final = 5  # that are listed
NOTES: Final = 2
LESSON_PAUSE: Final = 10.0  # s between two lines about a teacher, where there is no panel
REFRESH: Final = 4  # pictures per second; each takes some milliseconds from the training
AXIS: Final = ("100 %", "", "", " 50 %", "", "", "  0 %")
# Braille cells: one bit per dot, columns left and right, rows from the bottom up.
_DOTS: Final = ((0x40, 0x04, 0x02, 0x01), (0x80, 0x20, 0x10, 0x08))


def curve(values: list[float], *, width: int, rows: int) -> list[str]:
    """A filled curve in Braille dots, stretched or squeezed to the width, two points to a character.

    Args:
        values: Points from 0 to 1, oldest first; NaN where nothing is known.
        width: Characters.
        rows: Lines.

    Returns:
        Lines, top first.
    """
    heights = np.array(values, np.float64)
    known = np.flatnonzero(np.isfinite(heights))
    cells = [[0x2800] * width for _ in range(rows)]
    if len(known):
        places = np.linspace(0.0, max(len(values) - 1, 1), 2 * width)
        points = np.interp(places, known, heights[known], left=np.nan).clip(0.0, 1.0)
        for column in np.flatnonzero(np.isfinite(points)).tolist():
            for dot in range(round(float(points[column]) * (4 * rows - 1)) + 1):
                cells[rows - 1 - dot // 4][column // 2] |= _DOTS[column % 2][dot % 4]
    return ["".join(map(chr, row)) for row in cells]


class TerminalReporter:
    """Redraws a panel while training goes on; a context manager.

    Without a terminal (a pipe, a log file) it prints one line per evaluation instead, and one every ten seconds while a
    teacher learns, which nobody evaluates.

    Args:
        title: What is trained.
        console: Where to; by default stderr, so that stdout is free for the result.
    """

    def __init__(self, *, title: str, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True)
        self.title = title
        self._completions: list[float] = []
        self._evaluations: list[EvaluationReport] = []
        self._notes: deque[str] = deque(maxlen=NOTES)
        self._latest: IterationReport | None = None
        self._first = 0  # camera steps before this session
        self._told = -math.inf  # s, when the last line about a teacher was printed
        self._live: Live | None = None
        if self.console.is_terminal:
            self._live = Live(get_renderable=self._picture, console=self.console, refresh_per_second=REFRESH)

    def __enter__(self) -> Self:
        """Take the lower part of the terminal."""
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the last picture standing; none, where nothing was trained."""
        if self._live is not None:
            self._live.transient = self._latest is None
            self._live.stop()
            if self._latest is None:
                for note in self._notes:
                    self._print(note)

    def begin(self, simulation: Simulation, policy: NetworkPolicy) -> None:
        """Nothing to show of it in a terminal."""

    def note(self, text: str) -> None:
        """Show a line below the evaluations."""
        self._notes.append(text)
        if self._live is None:
            self._print(text)

    def step(self) -> None:
        """Nothing: the panel has a pace of its own."""

    def iteration(self, report: IterationReport) -> None:
        """Move the curve on, or tell how far a teacher is."""
        self._latest = report
        if report.lesson is not None:
            self._tell_lesson(report.lesson, report.seconds)
            return
        if not self._completions:
            self._first = report.stats.total_steps - report.stats.num_steps
        self._completions.append(report.completion)

    def evaluation(self, report: EvaluationReport) -> None:
        """Note how the policy does when it means it."""
        self._evaluations.append(report)
        if self._live is None:
            lap = f"  best lap {report.best_lap:.2f} s" if report.best_lap is not None else ""
            self._print(
                f"{report.seconds:7.1f} s {report.step:>11,} steps  {_laps(report):>10}  "
                f"{100 * report.completion:3.0f} %{lap}{'  (best so far)' if report.is_best else ''}"
            )

    def _tell_lesson(self, lesson: Lesson, seconds: float) -> None:
        """A line, where there is no panel to show it and the last one is long ago."""
        if self._live is not None or seconds < self._told + LESSON_PAUSE:
            return
        if not math.isinf(self._told):
            pace = _figure(lesson.steps_per_second, ",.0f")
            self._print(
                f"{seconds:7.1f} s  the teacher has learned {_percent(lesson)} of its {lesson.needed:,} steps, "
                f"{pace} a second"
            )
        self._told = seconds

    def _print(self, line: str) -> None:
        self.console.print(line, highlight=False, markup=False, soft_wrap=True)

    # ---- the picture

    def _picture(self) -> RenderableType:
        width = min(self.console.width, MAX_WIDTH)
        inside = width - 4
        if width < NARROW:
            parts: list[RenderableType] = [self._numbers()]
        else:
            columns = Table.grid(padding=(0, 3, 0, 0))
            columns.add_column(width=inside - NUMBERS_WIDTH - 3, no_wrap=True)
            columns.add_column(width=NUMBERS_WIDTH)
            columns.add_row(self._graph(inside - NUMBERS_WIDTH - 3), self._numbers())
            parts = [columns, Text(), self._list()]
        parts += [Text(note, style="dim", no_wrap=True, overflow="ellipsis") for note in self._notes]
        return Panel(Group(*parts), title=Text(f" {self.title} ", style="bold"), border_style="cyan", width=width)

    def _graph(self, width: int) -> Text:
        """Completion over the camera steps of this session: the curve while training, a dot for each evaluation."""
        curve_width = width - len(AXIS[0]) - 1
        lines = curve(self._completions, width=curve_width, rows=CURVE_ROWS)
        steps = self._latest.stats.total_steps if self._latest is not None else 0
        dots: dict[tuple[int, int], str] = {}
        for report in self._evaluations:
            share = (report.step - self._first) / max(steps - self._first, 1)
            column = round(min(max(share, 0.0), 1.0) * (curve_width - 1))
            row = round((1.0 - report.completion) * (CURVE_ROWS - 1))
            dots[row, column] = "bold green" if report.laps_completed == len(report.completions) else "bold yellow"
        graph = Text.assemble(
            ("lap completed  ", "bold"), ("█", "cyan"), (" training  ", "dim"), ("●", "bold yellow"), " evaluation\n"
        )
        for row, (label, line) in enumerate(zip(AXIS, lines, strict=True)):
            graph.append(f"{label:>5} ", style="dim")
            for column, cell in enumerate(line):
                style = dots.get((row, column))
                graph.append("●" if style else cell, style=style or "cyan")
            graph.append("\n")
        left, right = f"{self._first:,}", f"{steps:,} steps"
        graph.append(f"{'':6}{left}{right:>{max(curve_width - len(left), 0)}}", style="dim")
        return graph

    def _numbers(self) -> Table:
        numbers = Table.grid(padding=(0, 1), expand=True)
        numbers.add_column(style="dim", no_wrap=True)
        numbers.add_column(justify="right", no_wrap=True)
        report = self._latest
        if report is None:
            numbers.add_row("starting …", "")
            return numbers
        numbers.add_row("time", _clock(report.seconds))
        numbers.add_row("left", "–" if report.remaining is None else _clock(report.remaining))
        pace = report.steps_per_second
        if report.lesson is None:
            numbers.add_row("camera steps", f"{report.stats.total_steps:,}")
        else:
            pace = report.lesson.steps_per_second
            numbers.add_row("teacher learned", _percent(report.lesson))
        numbers.add_row("steps per second", _figure(pace, ",.0f"))
        numbers.add_row("episodes", f"{report.episodes:,}")
        numbers.add_row("reward per episode", _figure(report.mean_reward, ",.2f"))
        numbers.add_row("entropy", _figure(report.stats.losses.entropy, ".2f"))
        best = max(self._evaluations, key=_rank, default=None)
        style = "bold green" if best is not None and best.laps_completed == len(best.completions) else "bold"
        numbers.add_row("best evaluation", Text("–" if best is None else _laps(best), style=style))
        lap = None if best is None else best.best_lap
        numbers.add_row("best lap", Text("–" if lap is None else f"{lap:.2f} s", style=style))
        return numbers

    def _list(self) -> Table:
        """The last evaluations; empty lines stand for those to come, so that the panel keeps its height."""
        table = Table.grid(padding=(0, 2, 0, 0))
        for width in (10, 12, 12, 10, 9, 4):
            table.add_column(width=width, justify="right", no_wrap=True)
        table.add_row("evaluation", "steps", "laps", "completion", "best lap", "", style="dim")
        shown = self._evaluations[-EVALUATIONS:]
        for report in shown:
            table.add_row(
                f"{report.seconds:.1f} s",
                f"{report.step:,}",
                _laps(report),
                f"{100 * report.completion:.0f} %",
                "–" if report.best_lap is None else f"{report.best_lap:.2f} s",
                Text("best", style="green") if report.is_best else "",
            )
        for _ in range(EVALUATIONS - len(shown)):
            table.add_row()
        return table


def _rank(report: EvaluationReport) -> tuple[bool, int]:
    """The best of the run; of a stretch that has none of its own, the latest."""
    return report.is_best, report.step


def _laps(report: EvaluationReport) -> str:
    return f"{report.laps_completed} of {len(report.completions)} laps"


def _percent(lesson: Lesson) -> str:
    return f"{math.floor(100 * lesson.share)} %"


def _figure(value: float, form: str) -> str:
    return format(value, form) if value == value else "–"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
