"""What `racecraft tune` prints for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from racecraft.cli.tables import show_table
from racecraft.errors import typed

if TYPE_CHECKING:
    from racecraft.tuning import Outcome, TrialOutcome

SHOWN: Final = 8  # trials in the table, the best first
NUMBER: Final = 8  # characters of the longest number in the table, where names may be folded and numbers not
WIDTH: Final = 24  # characters of the longest bar


def say_trial(trial: TrialOutcome, goal: str) -> None:
    """One trial that ended, on stderr."""
    line = Text.assemble((f"trial {trial.number:>3}  ", "dim"), _state(trial, goal))
    line.append("  " + ", ".join(f"{name} {value:.4g}" for name, value in trial.params.items()), style="dim")
    Console(stderr=True).print(line, soft_wrap=True)


def say_tuned(outcome: Outcome) -> None:
    """The best trials, what mattered, and how to go on."""
    console = Console()
    best, baseline = outcome.best, outcome.baseline
    ranked = sorted((t for t in outcome.trials if t.value is not None and t.state == "complete"), key=_value)
    if ranked:
        show_table(console, _trials(outcome, ranked))
    counts = ", ".join(
        f"{sum(trial.state == state for trial in outcome.trials)} {state}"
        for state in ("complete", "pruned", "out of time", "fail")
        if any(trial.state == state for trial in outcome.trials)
    )
    number = len(outcome.trials)
    console.print(Text(f"{number} trial{'' if number == 1 else 's'}: {counts}.", style="dim"), soft_wrap=True)
    if outcome.importances:
        show_table(console, _importances(outcome))
    else:
        console.print(Text("Too few trials ended to say what mattered.", style="dim"), soft_wrap=True)
    if best is not None:
        line = Text.assemble(("Best: ", "bold"), f"trial {best.number}, ", _state(best, outcome.goal))
        if baseline is not None and baseline.number != best.number:
            line.append("; what you have now: ")
            line.append(_state(baseline, outcome.goal))
        console.print(line, soft_wrap=True)
        console.print(Text.assemble("Run folder: ", (best.run, "bold")), soft_wrap=True)
        console.print(
            Text.assemble("Train on:   ", (f"racecraft train --from {typed(best.run)}", "bold")), soft_wrap=True
        )
    console.print(
        Text.assemble("Continue:   ", (f"racecraft tune --resume {typed(outcome.folder)} --minutes 10", "bold")),
        soft_wrap=True,
    )


def _trials(outcome: Outcome, ranked: list[TrialOutcome]) -> Table:
    table = Table(box=SIMPLE_HEAD, header_style="bold", pad_edge=False)
    table.add_column("trial", justify="right")
    table.add_column("best lap" if outcome.goal == "lap_time" else "laps after", justify="right", no_wrap=True)
    for parameter in outcome.space:
        table.add_column(parameter.name, justify="right", overflow="fold", min_width=NUMBER)
    shown = ranked[:SHOWN]
    baseline = outcome.baseline
    if baseline is not None and baseline not in shown:
        shown = [*shown, baseline]
    for trial in shown:
        is_now = baseline is not None and trial.number == baseline.number
        numbers = (_number(trial.params[parameter.name]) for parameter in outcome.space)
        name = f"{trial.number} (now)" if is_now else str(trial.number)
        style = "bold" if trial is ranked[0] else "dim" if is_now else ""
        table.add_row(name, _state(trial, outcome.goal), *numbers, style=style)
    return table


def _importances(outcome: Outcome) -> Table:
    table = Table(box=SIMPLE_HEAD, header_style="bold", pad_edge=False)
    table.add_column("what mattered")
    table.add_column("", no_wrap=True)
    table.add_column("searched", justify="right", no_wrap=True)
    table.add_column("best", justify="right")
    ranges = {parameter.name: parameter for parameter in outcome.space}
    best = outcome.best
    largest = max(outcome.importances.values()) or 1.0
    for name, share in sorted(outcome.importances.items(), key=lambda item: -item[1]):
        bar = "█" * max(1, round(WIDTH * share / largest)) if share > 0 else ""
        parameter = ranges[name]
        found = "" if best is None else f"{best.params[name]:.4g}"
        table.add_row(name, f"{bar} {100 * share:.0f} %", f"{parameter.low:.4g} to {parameter.high:.4g}", found)
    return table


def _number(value: float) -> str:
    exact = f"{value:.4g}"
    return exact if len(exact) <= NUMBER else f"{value:.3g}"


def _state(trial: TrialOutcome, goal: str) -> str:
    """How a trial ended, in a few words."""
    if trial.state == "fail":
        return f"failed: {trial.error}"
    share = "" if trial.completion is None else f"{100 * trial.completion:.0f} % of a lap"
    if trial.state != "complete":
        return f"{trial.state}, {share}" if share else trial.state
    if goal == "lap_time" and trial.best_lap_seconds is not None:
        return f"{trial.best_lap_seconds:.2f} s"
    if goal == "laps" and trial.completion is not None and trial.completion >= 1 and trial.value == trial.steps:
        return f"{trial.steps:,} steps"
    return share


def _value(trial: TrialOutcome) -> tuple[float, int]:
    assert trial.value is not None
    return trial.value, trial.number
