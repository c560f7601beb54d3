"""What `racecraft export` prints for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

if TYPE_CHECKING:
    from racecraft.car import ExportedModel


def say_exported(exported: ExportedModel) -> None:
    """What was written, and what a car makes of it."""
    console = Console()
    for note in exported.notes:
        console.print(Text.assemble(("note: ", "bold"), note), soft_wrap=True)
    kind = f"{exported.network}, step {exported.step:,}, {exported.size / 1e6:.1f} MB"
    console.print(Text.assemble("For the car: ", (str(exported.archive), "bold"), (f"  {kind}", "dim")), soft_wrap=True)
