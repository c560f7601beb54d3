"""`racecraft verify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json, text


@app.command()
def verify(
    replay: Annotated[Path, typer.Argument(help="Replay file, as evaluations and races write it.")],
    as_json: Json = False,
) -> None:
    """Drive a replay again from its stored actions and say whether every bit is the same."""
    from racecraft.race import read_replay
    from racecraft.race import verify as drive_again

    found = drive_again(read_replay(replay))
    if as_json:
        print_json(found.to_dict())
    else:
        text().say_verified(found)
    if not found.is_genuine:
        raise typer.Exit(1)
