"""What `racecraft sweep` prints for people."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from racecraft.cli.tables import show_table
from racecraft.errors import typed

if TYPE_CHECKING:
    from racecraft.sweeping import Board, Figure
    from racecraft.tuning.trial import Report

NOTHING: Final = "-"


def say_run(run: str, how: Report | Exception) -> None:
    """One training that ended, on stderr."""
    line = Text.assemble((run, "bold"), "  ")
    if isinstance(how, Exception):
        line.append(f"failed: {how}", style="red")
    elif how.reason == "interrupted":
        line.append(f"saved after {how.steps:,} steps", style="yellow")
    else:
        lap = f", best lap {how.best_lap:.3f} s" if how.best_lap is not None else ""
        line.append(f"{how.steps:,} steps in {how.seconds:.1f} s{lap}", style="dim")
    Console(stderr=True).print(line, soft_wrap=True)


def say_board(name: str, board: Board, *, runs: Path) -> None:
    """The leaderboard, and how to go on."""
    console = Console()
    table = Table(box=SIMPLE_HEAD, header_style="bold", pad_edge=False)
    table.add_column("", justify="right")
    table.add_column("setting", overflow="fold", min_width=8)
    table.add_column("seeds", justify="right")
    table.add_column("laps after, steps", justify="right", no_wrap=True)
    table.add_column("best lap, s", justify="right", no_wrap=True)
    table.add_column("", min_width=len("tied"))
    for row in board.places:
        if not row.seeds:
            table.add_row("", row.setting, "0", NOTHING, NOTHING, "not begun", style="dim")
            continue
        table.add_row(
            str(row.place),
            row.setting,
            str(row.seeds),
            _shown(row.laps_after, ",.0f", row.seeds),
            _shown(row.best_lap, ".3f", row.seeds),
            Text("tied", style="yellow") if row.is_tied else "",
        )
    show_table(console, table)
    ranges = "Means over seeds, with the range that holds the true mean with 95 %."
    tied = " Tied may be as good as the first: train more seeds." if any(row.is_tied for row in board.places) else ""
    console.print(Text(ranges + tied, style="dim"), soft_wrap=True)
    console.print(
        Text.assemble("Go on:  ", (f"racecraft sweep --resume {typed(name)} --runs {typed(runs)}", "bold")),
        soft_wrap=True,
    )


def _shown(figure: Figure, form: str, seeds: int) -> str:
    """A mean, its interval, and of how many seeds it is where others did not come so far."""
    if figure.mean is None:
        return NOTHING
    text = f"{figure.mean:{form}}"
    if figure.low is not None and figure.high is not None:
        text += f"  {figure.low:{form}} to {figure.high:{form}}"
    return text if figure.count == seeds else f"{text}  ({figure.count} of {seeds})"
