"""Tables on terminals that are too narrow for them."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table

from racecraft.cli.tables import show_table
from racecraft.cli.text import say_measured


def test_no_figure_is_shortened() -> None:
    told = io.StringIO()
    table = Table()
    table.add_column("what", overflow="ellipsis", no_wrap=True)
    for heading in ("best\nlap", "off track", "driven"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_row("a very long name of a model", "13.20 s", "0", "100 %")
    show_table(Console(file=told, width=30), table)
    for figure in ("lap", "13.20 s", "off track", "100 %"):
        assert figure in told.getvalue()


def test_what_was_measured_is_told_beside_the_longest_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    figures = {
        "calls_per_second": 31_234,
        "confinement": {"unconfined_calls_per_processor_second": 45_678, "walls": "Landlock"},
        "limits": {"calls_per_second": {"value": 700_001, "what": "a bare call"}},
    }
    say_measured({"machine": {"processor": "P", "cores": 2, "instruction_set": "avx2"}, "reward": figures})
    told = capsys.readouterr().out
    for figure in ("31,234", "45,678", "700,001 [1]", "4 %", "[1] a bare call", "confinement.walls: Landlock"):
        assert figure in told
