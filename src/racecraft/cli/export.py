"""`racecraft export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json


@app.command()
def export(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    to: Annotated[str, typer.Option("--to", help="What for: car.")] = "car",
    checkpoint: Annotated[str, typer.Option("--checkpoint", help="best, last or a step.")] = "best",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default NAME.tar.gz in the run folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write the archive that a physical car takes."""
    from racecraft.car import export_run
    from racecraft.cli import car_text

    exported = export_run(run, to=to, output=output, checkpoint=checkpoint)
    if as_json:
        print_json(exported.to_dict())
    else:
        car_text.say_exported(exported)
