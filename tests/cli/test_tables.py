"""Tables on terminals that are too narrow for them."""

from __future__ import annotations

import io

from rich.console import Console
from rich.table import Table

from racecraft.cli.tables import show_table


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
