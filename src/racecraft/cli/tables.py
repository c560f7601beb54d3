"""Tables of figures on terminals of any width."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table


def show_table(console: Console, table: Table) -> None:
    """Print a table whose figures are whole: too wide a one goes on in the terminal's next line.

    Rich would shorten figures, 100 % to 10…, and leave out columns that have no room. Words may still be shortened.
    """
    for column in table.columns:
        if column.no_wrap and column.justify == "right":
            column.min_width = max(console.measure(cell).maximum for cell in (column.header, *column.cells))
    console.print(table, crop=False)
