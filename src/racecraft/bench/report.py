"""Benchmark results for people: a table of figures, and below it what their limits are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

UNSHOWN = ("limits", "runs", "parts_percent", "cars", "batch", "name", "version", "observation", "num_envs")


def table(results: dict[str, Any]) -> tuple[Table, list[Text]]:
    """One line per figure, with the machine's limit and our share of it where there is one; and what is said below."""
    machine = results["machine"]
    view = Table(
        title=f"{machine['processor']}, {machine['cores']} cores, {machine['instruction_set']}",
        title_justify="left",
        header_style="bold",
        box=SIMPLE_HEAD,
        pad_edge=False,
    )
    view.add_column("figure", overflow="fold", min_width=12)
    view.add_column("measured", justify="right", no_wrap=True)
    view.add_column("limit", justify="right", no_wrap=True)
    view.add_column("share", justify="right", no_wrap=True)
    notes: list[str] = []
    for group, figures in results.items():
        if group == "machine":
            continue
        view.add_row(Text(group, style="bold"))
        for name, value, limit in _lines(figures):
            if isinstance(value, str):
                notes.append(f"{group} {name}: {value}")
                continue
            if limit is None:
                view.add_row(f"  {name}", _number(value))
                continue
            notes.append(f"[{len(notes) + 1}] {limit['what']}")
            highest, share = _number(limit["value"]), f"{100 * value / limit['value']:.0f} %"
            view.add_row(f"  {name}", _number(value), f"{highest} [{len(notes)}]", share)
        if parts := figures.get("parts_percent"):
            shares = ", ".join(f"{name} {share:.0f} %" for name, share in parts.items())
            notes.append(f"{group} spends its time on: {shares}")
    return view, [Text(note, style="dim") for note in notes]


def _lines(figures: dict[str, Any], inside: str = "") -> Iterator[tuple[str, Any, dict[str, Any] | None]]:
    """The figures worth a line: name, value, limit."""
    limits = figures.get("limits", {})
    for name, value in figures.items():
        if name in UNSHOWN:
            continue
        if isinstance(value, dict):
            yield from _lines(value, f"{inside}{name}.")
        elif value is not None:
            yield f"{inside}{name}", value, limits.get(name)


def _number(value: Any) -> str:
    """A figure for people; of several measurements their span."""
    if isinstance(value, list):
        return f"{min(value):.2f} … {max(value):.2f}" if value else "–"
    if isinstance(value, int) or (isinstance(value, float) and value >= 1000):
        return f"{value:,.0f}"
    return f"{value:,.2f}" if isinstance(value, float) else str(value)
