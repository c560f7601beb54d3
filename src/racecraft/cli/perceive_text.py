"""What `racecraft perceive` prints for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from racecraft.cli.tables import show_table
from racecraft.errors import printable

MOST_ROWS: Final = 40


def say_perceived(told: Sequence[dict[str, Any]], output: Path | None) -> None:
    """A row for each picture, the first ones of many, and where they are painted."""
    console = Console()
    table = Table(box=SIMPLE_HEAD)
    for column in ("picture", "road", "offset", "heading", "middle at rows 60, 75, 90, 105", "in the way"):
        table.add_column(column, justify="left" if column == "picture" else "right")
    for one in told[:MOST_ROWS]:
        middle = "  ".join("   –" if column is None else f"{column:4.0f}" for column in one["middle"])
        table.add_row(
            printable(Path(one["file"]).name),
            "yes" if one["on_road"] else "no",
            f"{100 * one['offset_m']:+.0f} ± {100 * one['offset_error_m']:.0f} cm",
            f"{math.degrees(one['heading_rad']):+.0f} ± {math.degrees(one['heading_error_rad']):.0f}°",
            middle,
            "–" if one["distance_m"] is None else f"{one['distance_m']:.1f} m",
        )
    show_table(console, table)
    if len(told) > MOST_ROWS:
        console.print(f"{len(told) - MOST_ROWS:,} more; --json has them all.")
    if output is not None:
        console.print(f"Painted in {printable(str(output))}.")
