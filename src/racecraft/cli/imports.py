"""`racecraft import`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json, text


@app.command("import")
def import_(
    path: Annotated[
        Path, typer.Argument(help="deepracer-for-cloud folder, model folder or archive, or reward_function.py.")
    ],
    track: Annotated[
        str, typer.Option("--track", "-t", help="Name or file of a track; by default the files' own world.")
    ] = "",
    reward: Annotated[
        str, typer.Option("--reward", "-r", help="Preset or file; by default the files' own reward function.")
    ] = "",
    network: Annotated[
        str, typer.Option("--network", help="RACECRAFT_SMALL is much faster than AWS's, and begins with fresh weights.")
    ] = "",
    checkpoint: Annotated[
        str,
        typer.Option(
            "--checkpoint", "-c", help="Whose weights: best, last, an iteration, a file's name, or none for fresh ones."
        ),
    ] = "best",
    name: Annotated[str | None, typer.Option("--name", "-n", help="Name of the run.")] = None,
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    as_json: Json = False,
) -> None:
    """Make a run from the original's files and weights."""
    from racecraft.importing import import_run

    result = import_run(path, root=runs, name=name, track=track, reward=reward, network=network, checkpoint=checkpoint)
    if as_json:
        print_json(result.to_dict())
    else:
        text().say_imported(result)
