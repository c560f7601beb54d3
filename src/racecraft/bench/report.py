"""Benchmark results as a table for people."""

from __future__ import annotations

from typing import Any

from rich.table import Table


def table(results: dict[str, Any]) -> Table:
    """One line per figure, with the machine's limit and our share of it where there is one."""
    machine = results["machine"]
    view = Table(
        title=f"{machine['processor']}, {machine['cores']} cores, {machine['instruction_set']}",
        header_style="bold",
        border_style="dim",
    )
    view.add_column("what")
    view.add_column("measured", justify="right")
    view.add_column("limit", justify="right")
    view.add_column("")
    for group, figures in results.items():
        if group == "machine":
            continue
        for name, value in _lines(group, figures):
            limit = figures.get("limit_" + name.split(".", 1)[-1])
            share = f"{100 * value / limit:.0f} % of {figures['limit']}" if limit else ""
            view.add_row(name, _number(value), _number(limit) if limit else "", share)
    return view


def _lines(group: str, figures: dict[str, Any]) -> list[tuple[str, Any]]:
    """The figures worth a line, with their full names."""
    lines: list[tuple[str, Any]] = []
    for name, value in figures.items():
        if name.startswith("limit") or name == "runs":
            continue
        if isinstance(value, int | float | list):
            lines.append((f"{group}.{name}", value))
        elif isinstance(value, dict):
            lines += [(f"{group}.{name}.{key}", inner) for key, inner in value.items() if not isinstance(inner, dict)]
        elif name == "skipped":
            lines.append((f"{group}.skipped", value))
    return lines


def _number(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(_number(item) for item in value)
    if isinstance(value, float):
        return f"{value:,.2f}"
    return f"{value:,}" if isinstance(value, int) else str(value)
