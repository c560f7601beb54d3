"""`racecraft serve`: the console in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json
from racecraft.extras import needed_for


@app.command()
def serve(
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    port: Annotated[int, typer.Option("--port", "-p", help="Of 127.0.0.1; 0 takes a free one.")] = 8321,
    database: Annotated[
        str,
        typer.Option(
            "--database",
            envvar="RACECRAFT_DATABASE",
            help="postgresql+psycopg://… instead of SQLite in the runs folder.",
        ),
    ] = "",
    artifacts: Annotated[
        str,
        typer.Option(
            "--artifacts", envvar="RACECRAFT_ARTIFACTS", help="s3://BUCKET/PREFIX or file:///FOLDER to copy runs to."
        ),
    ] = "",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the link in a browser.")] = True,
    as_json: Json = False,
) -> None:
    """Open the console in a browser: train, watch and race."""
    from racecraft.serve.quick import loading

    with needed_for("The console"), loading():
        from racecraft.serve import ServeSettings
        from racecraft.serve import serve as run_server

    def ready(link: str) -> None:
        if as_json:
            print_json({"link": link})
        else:
            typer.echo(f"The console is open at {link}\nThe link works once. Ctrl-C stops the console.")
        if browser and not as_json:
            import webbrowser

            webbrowser.open(link)

    run_server(ServeSettings(runs=runs, port=port, database=database, artifacts=artifacts), on_ready=ready)
