"""`racecraft report` and `racecraft share`."""

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


@app.command()
def share(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    evaluation: Annotated[
        str, typer.Option("--evaluation", help="Time stamp of the evaluation; by default the newest.")
    ] = "",
    language: Annotated[str, typer.Option("--language", "-l", help="Of the page: en or de.")] = "en",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default share.html in the run folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a best lap as one HTML page to send around.

    It opens offline; the replay of that evaluation is inside.
    """
    from racecraft.analysis.share import write_share
    from racecraft.analysis.share_page import LANGUAGES
    from racecraft.checks import check_choice

    check_choice("language", language, LANGUAGES)
    path = write_share(run, output, stamp=evaluation, language=language)
    if as_json:
        print_json({"run": str(run), "share": str(path), "bytes": path.stat().st_size})
    else:
        typer.echo(f"The lap is in {path}.")
