"""`racecraft report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default report.html in the run folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a run's report: one HTML page that opens offline."""
    from racecraft.analysis import write_report

    path = write_report(run, output)
    if as_json:
        print_json({"run": str(run), "report": str(path), "bytes": path.stat().st_size})
    else:
        typer.echo(f"The report is in {path}.")
