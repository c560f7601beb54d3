"""Tables of figures on terminals of any width."""

from __future__ import annotations

from typing import Final

from rich.console import Console
from rich.table import Table

WIDEST: Final = 10_000
"""Characters of any table."""


def show_table(console: Console, table: Table) -> None:
    """Print a table whose figures are whole: too wide a one goes on in the terminal's next line.

    Rich would shorten figures, 100 % to 10…, and leave out columns that have no room. Names may still be folded.
    """
    spare = 0  # characters that folding saves
    for column in table.columns:
        cells = [console.measure(cell) for cell in (column.header, *column.cells)]
        if column.no_wrap and column.justify == "right":
            column.min_width = max(cell.maximum for cell in cells)
        elif column.overflow == "fold":
            spare += max(0, max(cell.minimum for cell in cells) - (column.min_width or 1))
    needed = console.measure(table, options=console.options.update(width=WIDEST)).minimum - spare
    if needed > console.width:
        table.width = needed
    console.print(table, crop=False)
