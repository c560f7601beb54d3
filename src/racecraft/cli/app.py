"""The Typer application, the options that several verbs share, and what a verb prints with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft import __version__
from racecraft.errors import ConfigError

app = typer.Typer(
    name="racecraft",
    help="Teach a small car to race: reward function in, lap on video out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich would take two thirds of the time that --help takes
    context_settings={"help_option_names": ["-h", "--help"]},
)

INTERRUPTED = 130  # 128 + SIGINT, as shells say it

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout instead of text.")]
OneModel = Annotated[Path, typer.Argument(help="Run folder, or RUN@CHECKPOINT.")]
Checkpoint = Annotated[str, typer.Option("--checkpoint", help="best, last or a step.")]
AwsLog = Annotated[str, typer.Option("--aws-log", help="File for the log lines that AWS's tools read; - for stdout.")]
TrackOption = Annotated[str, typer.Option("--track", "-t", help="Name of a track, or path of a track file.")]


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the stack trace of an error.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="With --version: the build as one JSON object.")] = False,
) -> None:
    """Options of every verb."""
    if version and as_json:
        from racecraft.bench.machine import describe_build

        print_json(describe_build())
        raise typer.Exit
    if version:
        typer.echo(__version__)
        raise typer.Exit
    if context.invoked_subcommand is None:
        context.fail("Missing command.")


def make_folder_of(file: Path) -> None:
    """Make the folder that a file is to be written into: what was measured or fitted is not lost for want of one.

    Raises:
        ConfigError: It cannot be made.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{file} cannot be written: {error.strerror or error}.") from error


def model_of(context: typer.Context, run: Path, checkpoint: str) -> tuple[Path, str]:
    """The run and its checkpoint, named as ``RUN@CHECKPOINT`` or with ``--checkpoint``, and not in both ways.

    Raises:
        ConfigError: What follows the @ names no checkpoint.
    """
    from racecraft.run.checkpoint import split_model

    path, named = split_model(run)
    if named and is_given(context, "checkpoint"):
        context.fail(f"{run} names a checkpoint, and so does --checkpoint {checkpoint}; give one of them.")
    return Path(path), named or checkpoint


def text() -> Any:
    """What is printed for people; imported late, as rich takes its time."""
    from racecraft.cli import text as sentences

    return sentences


def print_json(document: dict[str, Any]) -> None:
    """One JSON object on stdout."""
    typer.echo(json.dumps(document, allow_nan=False, default=str))


def is_given(context: typer.Context, *options: str) -> bool:
    """Whether one of these options was typed."""
    sources = [context.get_parameter_source(option) for option in options]
    return any(source is not None and source.name == "COMMANDLINE" for source in sources)


def refuse_beside_metadata(context: typer.Context) -> None:
    """AWS's file says what a car sees and does: an option that says it, too, would have no effect."""
    if not is_given(context, "model_metadata"):
        return
    for option in context.command.params:
        if option.name in ("actions", "sensors") and is_given(context, option.name):
            context.fail(f"{option.opts[0]} does not go with --model-metadata, which says that, too; give one of them.")
