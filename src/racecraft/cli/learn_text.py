"""What `racecraft learn` shows: a live curve, and how it ended."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from racecraft.errors import typed
from racecraft.training.terminal import MAX_WIDTH, curve

if TYPE_CHECKING:
    from racecraft.classic import Learned, Progress

ROWS: Final = 8
LABEL: Final = 10  # characters of the curve's axis
ENDED: Final = {
    "return": "Learned it",
    "steps": "All steps are done",
    "seconds": "Time is up",
    "interrupted": "Stopped",
}


class CurveReporter:
    """Redraws a curve of the mean return with every evaluation; a context manager.

    Without a terminal it prints a line per evaluation instead.

    Args:
        title: What is learned.
        is_quiet: Show nothing at all.
        console: Where to; by default stderr, so that stdout is free for the result.
    """

    def __init__(self, *, title: str, is_quiet: bool = False, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._title, self._is_quiet = title, is_quiet
        self._seen: list[Progress] = []
        self._live: Live | None = None
        if self._console.is_terminal and not is_quiet:
            self._live = Live(get_renderable=self._picture, console=self._console, auto_refresh=False)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.transient = not self._seen
            self._live.stop()

    def __call__(self, progress: Progress) -> None:
        """Show an evaluation."""
        self._seen.append(progress)
        if self._live is not None:
            self._live.refresh()
        elif not self._is_quiet:
            best = "  (best so far)" if progress.is_best else ""
            line = (
                f"{progress.seconds:7.1f} s {progress.steps:>11,} steps  return {progress.mean_return:10.2f}"
                f"  while learning {_figure(progress.training_return):>10}{_left(progress)}{best}"
            )
            self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def _picture(self) -> RenderableType:
        width = min(self._console.width, MAX_WIDTH)
        if not self._seen:
            return Panel(Text("playing …", style="dim"), title=self._title, border_style="cyan", width=width)
        returns = [progress.mean_return for progress in self._seen]
        low, high = min(returns), max(returns)
        span = high - low or 1.0
        heights = [0.05 + 0.95 * (value - low) / span for value in returns]
        graph = Text.assemble(("return of greedy episodes\n", "bold"))
        for row, line in enumerate(curve(heights, width=max(width - 4 - LABEL - 1, 8), rows=ROWS)):
            label = _figure(high) if row == 0 else _figure(low) if row == ROWS - 1 else ""
            graph.append(f"{label:>{LABEL}} ", style="dim")
            graph.append(f"{line}\n", style="cyan")
        last, best = self._seen[-1], max(returns)
        numbers = Text(
            f"{last.seconds:.1f} s   {last.steps:,} of {last.total_steps:,} steps   now {_figure(last.mean_return)}   "
            f"best {_figure(best)}   while learning {_figure(last.training_return)}{_left(last)}"
        )
        return Panel(Group(graph, numbers), title=self._title, border_style="cyan", width=width)


def _left(progress: Progress) -> str:
    """How long the other steps will take at most, where that is worth knowing."""
    minutes = progress.seconds_left / 60.0
    if not minutes >= 1.0:
        return ""
    hours, rest = divmod(round(minutes), 60)
    return f"   at most {f'{hours} h {rest} min' if hours else f'{rest} min'} more"


def say_learned(learned: Learned, film: Path | None) -> None:
    """How learning ended, and where its files are."""
    console = Console()
    _say(
        console,
        (ENDED[learned.reason], "bold"),
        f" after {learned.wall_seconds:.1f} s and {learned.steps:,} steps: mean return of 100 greedy episodes ",
        (f"{learned.mean_return:.2f}", "bold"),
        f", while learning {_figure(learned.training_return)}.",
    )
    _say(console, "Run folder: ", (str(learned.run), "bold"))
    if film is not None:
        say_film(film)
    else:
        _say(console, "Watch it:   ", (f"racecraft learn --resume {typed(learned.run)} --watch", "bold"))


def say_film(film: Path) -> None:
    """Where a film is."""
    _say(Console(), "Film:       ", (str(film), "bold"))


def say_tuned() -> None:
    """The pairs whose settings are known to work."""
    from racecraft.classic import RECIPES

    table = Table(box=SIMPLE_HEAD, title="Settings are tuned for")
    for heading in ("environment", "algorithm", "steps at most", "done at a return of"):
        table.add_column(heading)
    for (environment, algorithm), recipe in RECIPES.items():
        goal = _figure(recipe.goal) if math.isfinite(recipe.goal) else "–"
        table.add_row(environment, algorithm, f"{recipe.settings.steps:,}", goal)
    Console().print(table)
    _say(Console(), "Any other id of Gymnasium works, too: ", ("racecraft learn ENV --algorithm NAME", "bold"))


def _figure(value: float) -> str:
    return f"{value:,.2f}" if math.isfinite(value) else "–"


def _say(console: Console, *parts: str | tuple[str, str]) -> None:
    console.print(Text.assemble(*parts), soft_wrap=True, highlight=False)
