"""The live view of a training in a terminal: two curves, the numbers that matter, and what happened last."""

from __future__ import annotations

import math
from collections import deque

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from racecraft.training.progress import EvaluationReport, IterationReport

CURVE_WIDTH = 48  # characters, two points each
CURVE_ROWS = 6
NOTES = 4
# Braille cells: one bit per dot, columns left and right, rows from the bottom up.
_DOTS = ((0x40, 0x04, 0x02, 0x01), (0x80, 0x20, 0x10, 0x08))


def curve(values: list[float], *, low: float, high: float, width: int, rows: int) -> list[str]:
    """A filled curve in Braille dots, two points to a character, the newest at the right.

    Args:
        values: Points, oldest first; the last ``2 * width`` are shown.
        low: Value at the bottom.
        high: Value at the top.
        width: Characters.
        rows: Lines.

    Returns:
        Lines, top first.
    """
    points = values[-2 * width :]
    points = [math.nan] * (2 * width - len(points)) + points
    cells = [[0x2800] * width for _ in range(rows)]
    for i, value in enumerate(points):
        if not math.isfinite(value):
            continue
        height = round((min(max(value, low), high) - low) / (high - low) * (4 * rows - 1))
        for dot in range(height + 1):
            cells[rows - 1 - dot // 4][i // 2] |= _DOTS[i % 2][dot % 4]
    return ["".join(map(chr, row)) for row in cells]


class TerminalReporter:
    """Redraws a panel while training goes on; a context manager.

    Without a terminal (a pipe, a log file) it prints one line per evaluation instead.
    """

    def __init__(self, *, title: str, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True)
        self.title = title
        self._training: list[float] = []
        self._rewards: list[float] = []
        self._evaluations: list[EvaluationReport] = []
        self._notes: deque[str] = deque(maxlen=NOTES)
        self._latest: IterationReport | None = None
        self._live = (
            Live(self._render(), console=self.console, refresh_per_second=8) if self.console.is_terminal else None
        )

    def __enter__(self) -> TerminalReporter:
        """Take the lower part of the terminal."""
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the last picture standing."""
        if self._live is not None:
            self._live.update(self._render())
            self._live.stop()

    def note(self, text: str) -> None:
        """Show a line under the curves."""
        self._notes.append(text)
        self._show(text)

    def iteration(self, report: IterationReport) -> None:
        """Move the training curve on."""
        self._latest = report
        self._training.append(report.completion)
        self._rewards.append(report.mean_reward)
        if self._live is not None:
            self._live.update(self._render())

    def evaluation(self, report: EvaluationReport) -> None:
        """Note how the policy does when it means it."""
        self._evaluations.append(report)
        lap = f", best lap {report.best_lap:.2f} s" if report.best_lap is not None else ""
        trials = len(report.completions)
        self.note(
            f"{report.seconds:6.1f} s  step {report.step:>9,}  evaluation: {report.laps_completed} of {trials} laps, "
            f"{100 * report.completion:.0f} % of the way{lap}{'  *best*' if report.is_best else ''}"
        )

    def _show(self, line: str) -> None:
        if self._live is None:
            self.console.print(line, highlight=False)
        else:
            self._live.update(self._render())

    def _render(self) -> RenderableType:
        grid = Table.grid(padding=(0, 3))
        grid.add_column()
        grid.add_column()
        training = self._training
        lines = curve(training, low=0.0, high=1.0, width=CURVE_WIDTH, rows=CURVE_ROWS)
        axis = ["100 %", *[""] * (CURVE_ROWS - 2), "  0 %"]
        graph = Text("Lap completed while training\n", style="bold")
        for label, line in zip(axis, lines, strict=True):
            graph.append(f"{label:>6} ", style="dim")
            graph.append(line + "\n", style="cyan")
        grid.add_row(graph, self._numbers())
        notes = Text("\n".join(self._notes), style="dim")
        return Panel(Group(grid, notes), title=f"[bold]{self.title}[/bold]", border_style="cyan", expand=False)

    def _numbers(self) -> RenderableType:
        numbers = Table.grid(padding=(0, 2))
        numbers.add_column(style="dim")
        numbers.add_column(justify="right")
        report = self._latest
        if report is None:
            numbers.add_row("starting …", "")
            return numbers
        best = max((e for e in self._evaluations), key=lambda e: (e.completion, -(e.best_lap or 1e6)), default=None)
        numbers.add_row("time", _clock(report.seconds))
        numbers.add_row("left", "until the laps" if report.remaining is None else _clock(report.remaining))
        numbers.add_row("camera steps", f"{report.stats.total_steps:,}")
        numbers.add_row("steps per second", f"{report.steps_per_second:,.0f}")
        numbers.add_row("episodes", f"{report.episodes:,}")
        numbers.add_row("reward per episode", f"{report.mean_reward:.2f}")
        if best is not None:
            style = "bold green" if best.laps_completed == len(best.completions) else "bold"
            numbers.add_row(
                "best evaluation", Text(f"{best.laps_completed} of {len(best.completions)} laps", style=style)
            )
            if best.best_lap is not None:
                numbers.add_row("best lap", Text(f"{best.best_lap:.2f} s", style=style))
        numbers.add_row("entropy", f"{report.stats.losses.entropy:.2f}")
        return numbers


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
