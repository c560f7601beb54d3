"""`racecraft export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Checkpoint, Json, OneModel, app, model_of, print_json


@app.command()
def export(
    context: typer.Context,
    run: OneModel,
    to: Annotated[str, typer.Option("--to", help="What for: car, onnx, tflite or openvino.")] = "car",
    checkpoint: Checkpoint = "best",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File to write; by default it is called like the run and lies in it."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write what a physical car takes, or the network alone."""
    from racecraft.car import export_run
    from racecraft.cli import car_text

    run, checkpoint = model_of(context, run, checkpoint)
    exported = export_run(run, to=to, output=output, checkpoint=checkpoint)
    if as_json:
        print_json(exported.to_dict())
    else:
        car_text.say_exported(exported)
