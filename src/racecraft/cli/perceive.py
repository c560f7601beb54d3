"""`racecraft perceive`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json, text


@app.command()
def perceive(
    context: typer.Context,
    sources: Annotated[
        list[Path] | None, typer.Argument(help="Pictures, folders of them, a video, a replay or a run folder.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for painted pictures, or an .mp4 of a video, replay or run."),
    ] = None,
    weights: Annotated[Path | None, typer.Option("--weights", help="Other weights than those brought along.")] = None,
    train: Annotated[Path | None, typer.Option("--train", help="Learn anew, and write the weights here.")] = None,
    updates: Annotated[int | None, typer.Option("--updates", help="With --train: gradient steps.")] = None,
    roads: Annotated[int | None, typer.Option("--roads", help="With --train: generated roads to learn on.")] = None,
    store: Annotated[int | None, typer.Option("--store", help="With --train: pictures remembered.")] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="With --train: decides everything.")] = 1,
    as_json: Json = False,
) -> None:
    """Say what pictures show of the road, and paint it."""
    from racecraft.perception import Lessons, Perceiver
    from racecraft.perception import perceive as look
    from racecraft.perception import train as learn

    if train is not None:
        if sources or output or weights:
            context.fail("--train looks at no pictures; call perceive again for those.")
        given = {"updates": updates, "roads": roads, "store": store}
        lessons = Lessons(seed=seed, **{name: value for name, value in given.items() if value is not None})

        def tell(update: int, loss: float) -> None:
            text().say_progress(f"{update:,} of {lessons.updates:,} updates, loss {loss:.3f}")

        learn(lessons, tell=tell).save(train)
        if as_json:
            print_json({"weights": str(train), "bytes": train.stat().st_size, "updates": lessons.updates})
        else:
            typer.echo(f"The weights are in {train}.")
        return
    perceiver = Perceiver() if weights is None else Perceiver(weights)
    told = look(sources or [], output=output, perceiver=perceiver)
    if as_json:
        print_json({"pictures": told, "output": None if output is None else str(output)})
        return
    from racecraft.cli import perceive_text

    perceive_text.say_perceived(told, output)
